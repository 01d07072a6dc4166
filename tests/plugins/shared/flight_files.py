"""Recordings of one track in every format that is read."""

import struct

import numpy as np


def csv_text(track):
    rows = [
        ",".join("" if np.isnan(value) else f"{value:.6f}" for value in (t, *point))
        for t, point in zip(track.t_s, track.position_m, strict=True)
    ]
    return "\n".join(["t_s,x_m,y_m,z_m", *rows]) + "\n"


def qualisys_text(track, rate_hz):
    millimetres = np.nan_to_num(1000 * track.position_m)
    head = [
        f"NO_OF_FRAMES\t{len(track.t_s)}", "NO_OF_CAMERAS\t4", "NO_OF_MARKERS\t2", f"FREQUENCY\t{rate_hz:g}",
        "DATA_INCLUDED\t3D", "MARKER_NAMES\tbase\t", "Frame\tTime\tbase X\tbase Y\tbase Z\t X\t Y\t Z\t",
    ]  # fmt: skip
    rows = [
        f"{i + 1}\t{t:.5f}\t1.0\t2.0\t3.0\t" + "\t".join(f"{value:.3f}" for value in point)
        for i, (t, point) in enumerate(zip(track.t_s, millimetres, strict=True))
    ]
    return "\n".join([*head, *rows]) + "\n"


def motive_text(track):
    """y up, as Motive has it; a rigid body with its rotation."""
    head = [
        "Format Version,1.22,Take Name,throws,Length Units,Meters,Coordinate Space,Global", "",
        ",," + ",".join(["Rigid Body"] * 7), ",," + ",".join(["ball"] * 7), ",," + ",".join(['"ID"'] * 7),
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position", "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z",
    ]  # fmt: skip
    rows = []
    for i, (t, (x, y, z)) in enumerate(zip(track.t_s, track.position_m, strict=True)):
        cells = ["", "", ""] if np.isnan(x) else [f"{value:.6f}" for value in (x, z, -y)]
        rows.append(",".join([str(i), f"{t:.6f}", "0", "0", "0", "1", *cells]))
    return "\n".join([*head, *rows]) + "\n"


def c3d_bytes(track, rate_hz, *, floats=True, processor=84):
    """A C3D with one point 'ball' and one analog channel, in millimetres."""
    order = ">" if processor == 86 else "<"
    scale = -0.1 if floats else 0.1

    def real(values):
        values = np.asarray(values, dtype=np.float64)
        if processor != 85:
            return values.astype(f"{order}f4").tobytes()
        return (4 * values).astype("<f4").view("<u2").reshape(-1, 2)[:, ::-1].tobytes()

    def entry(number, name, body):
        return struct.pack("bb", len(name), number) + name + struct.pack(f"{order}H", 2 + len(body)) + body

    group = entry(-1, b"POINT", b"\0")
    rate = entry(1, b"RATE", struct.pack("bB", 4, 0) + real([rate_hz]) + b"\0")
    units = entry(1, b"UNITS", struct.pack("bBB", -1, 1, 2) + b"mm" + b"\0")
    labels = entry(1, b"LABELS", struct.pack("bBBB", -1, 2, 8, 1) + b"ball    " + b"\0")
    parameters = struct.pack("4B", 1, 0x50, 1, processor) + group + rate + units + labels
    header = struct.pack("2B", 2, 0x50) + struct.pack(f"{order}5H", 1, 1, 1, len(track.t_s), 0)
    header += real([scale]) + struct.pack(f"{order}2H", 3, 1) + real([rate_hz])
    seen = np.isfinite(track.position_m).all(axis=1)
    points = np.nan_to_num(1000 * track.position_m) / (1.0 if floats else scale)
    residual = np.where(seen, 0.0, -1.0)
    table = np.column_stack([points, residual, np.full(len(seen), 7.0)])
    data = real(table.ravel()) if floats else table.round().astype(f"{order}i2").tobytes()
    whole = header.ljust(512, b"\0") + parameters.ljust(512, b"\0") + data
    return whole + b"\0" * (-len(whole) % 512)
