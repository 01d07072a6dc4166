"""Writes small convolutional networks as ONNX files (protobuf, by hand)."""

import struct

import numpy as np


def varint(value):
    out = b""
    while True:
        value, low = value >> 7, value & 0x7F
        out += bytes([low | (0x80 if value else 0)])
        if not value:
            return out


def field(number, value):
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    if isinstance(value, float):
        return varint(number << 3 | 5) + struct.pack("<f", value)
    content = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(content)) + content


def tensor(name, values):
    """Whole numbers as int64, others as float32."""
    whole = np.asarray(values).dtype == np.int64
    values = np.asarray(values, dtype=np.int64 if whole else np.float32)
    dims = b"".join(field(1, int(one)) for one in values.shape)
    return dims + field(2, 7 if whole else 1) + field(8, name) + field(9, values.tobytes())


def value_info(name, shape):
    dims = b"".join(field(1, field(1, int(one))) for one in shape)
    return field(1, name) + field(2, field(1, field(1, 1) + field(2, dims)))


def node(kind, inputs, output, **attributes):
    made = b"".join(field(1, one) for one in inputs) + field(2, output) + field(3, output) + field(4, kind)
    for name, values in attributes.items():
        ints = [values] if isinstance(values, int) else values
        kept = field(3, values) if isinstance(values, int) else b"".join(field(8, one) for one in ints)
        made += field(5, field(1, name) + kept + field(20, 2 if isinstance(values, int) else 7))
    return made


def model(nodes, weights, shape_in, shape_out, output):
    graph = b"".join(field(1, one) for one in nodes) + field(2, "net")
    graph += b"".join(field(5, tensor(name, values)) for name, values in weights.items())
    graph += field(11, value_info("image", shape_in)) + field(12, value_info(output, shape_out))
    return field(1, 8) + field(7, graph) + field(8, field(1, "") + field(2, 13))


def disc_finder(width, height, radius_px, *, steep=20.0, least=0.5, boxes=False, last="Sigmoid"):
    """A network that gives the probability of a red disc about each place: what is redder inside than around, through a
    logistic (or what ``last`` names); or boxes of that size about each place, one row for each."""
    side = 2 * round(1.6 * radius_px) + 1
    v, u = np.indices((side, side)) - side // 2
    off = np.hypot(u, v)
    inside, around = off <= radius_px, (off > 1.15 * radius_px) & (off <= 1.6 * radius_px)
    kernel = inside / inside.sum() - around / around.sum()
    weights = {
        "kernel": steep * np.stack([kernel, -kernel / 2, -kernel / 2])[None],
        "bias": np.array([-steep * least]),
    }
    nodes = [
        node(
            "Conv", ["image", "kernel", "bias"], "sum", pads=[side // 2] * 4, kernel_shape=[side, side], strides=[1, 1]
        ),
        node(last, ["sum"], "heat"),
    ]
    if not boxes:
        return model(nodes, weights, (1, 3, height, width), (1, 1, height, width), "heat")
    rows, columns = np.mgrid[:height, :width]
    size = np.full((height, width), 2 * radius_px)
    weights["places"] = np.stack([columns + 0.5, rows + 0.5, size, size])[None]
    weights["rows"] = np.array([1, 5, height * width], dtype=np.int64)
    nodes += [node("Concat", ["places", "heat"], "both", axis=1), node("Reshape", ["both", "rows"], "table")]
    return model(nodes, weights, (1, 3, height, width), (1, 5, height * width), "table")
