"""Small files that mean gigabytes: each reader refuses them in one line, before it allocates what they declare.

Each is read in a process of its own whose memory and processor time the system bounds: one that takes more than 1 GiB
or 10 s does not end with a refusal.
"""

from __future__ import annotations

import bz2
import functools
import io
import struct
import subprocess
import sys
import zipfile
import zlib
from pathlib import Path

import cv2
import lz4.frame
import numpy as np
import pytest
import zstandard

from kendama_cli.schema.unpacking import unpacked_arrays, unpacked_chunk

MB = 1 << 20
ZEROS = bytes(MB)
READERS = {
    "log": "from kendama_cli.log.reader import LogFile as read",
    "taught": "from kendama_cli.plugins.films.training import TrainedBall\n"
    "read = lambda path: TrainedBall.from_bytes(path.read_bytes())",
    "policy": "from kendama_cli.learning.verification import load_policy\nread = lambda path: load_policy(str(path))",
    "image": "from kendama_cli.plugins.films.boxes import read_image as read",
    "film": "from kendama_cli.plugins.shared.videos.video import VideoFile as read",
    "picture": "import numpy as np\nfrom kendama_cli.rendering.background import _image\n"
    "read = lambda path: _image(path, np.zeros((2, 2)), np.zeros((2, 2)))",
    "urdf": "from kendama_cli.robot_model.urdf_tree import read_tree\nread = lambda path: read_tree(str(path))",
    "yaml": "from kendama_cli.schema.plain_yaml import load_yaml\nread = lambda path: load_yaml(path.read_text())",
    "bag": "from kendama_cli.plugins.shared.recordings.bag import read_bag as read",
}
CODE = """
import resource, sys, pathlib
from kendama_cli.errors import KendamaError
{importing}
base = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (base + (1 << 30), base + (1 << 30)))
resource.setrlimit(resource.RLIMIT_CPU, (11 + int(sum(resource.getrusage(resource.RUSAGE_SELF)[:2])), 99))
try:
    read(pathlib.Path(sys.argv[1]))
except (KendamaError, ValueError) as error:
    print("refused:", error)
"""


def refused(reader: str, path: Path) -> str:
    """What is said against the file; empty where it was read."""
    command = [sys.executable, "-c", CODE.format(importing=READERS[reader]), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def mcap(compression: str, packed: bytes, size: int) -> bytes:
    def text(value: str) -> bytes:
        return struct.pack("<I", len(value)) + value.encode()

    def record(kind: int, body: bytes) -> bytes:
        return struct.pack("<BQ", kind, len(body)) + body

    chunk = struct.pack("<QQQI", 0, 1, size, 0) + text(compression) + struct.pack("<Q", len(packed)) + packed
    magic = b"\x89MCAP0\r\n"
    end = record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0))
    return magic + record(1, text("x") + text("y")) + record(6, chunk) + end + magic


@functools.cache
def squeezed(method: str, blocks: int, block: bytes = ZEROS) -> bytes:
    """``block`` over and over, packed as a stream, so that this process does not hold it either."""
    out = io.BytesIO()
    packer = zstandard.ZstdCompressor(level=1).stream_writer(out, closefd=False) if method == "zstd" else None
    with packer or lz4.frame.LZ4FrameFile(out, "w") as stream:
        for _ in range(blocks):
            stream.write(block)
    return out.getvalue()


@pytest.mark.parametrize("told", [1152 * MB, 64 * MB, 2**63], ids=["as it is", "less than it is", "absurd"])
@pytest.mark.parametrize("method", ["zstd", "lz4"])
def test_a_log_whose_chunk_means_gigabytes_is_refused(method: str, told: int, tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(mcap(method, squeezed(method, 1152), told))
    said = refused("log", path)
    assert "it has more than the 67108864 bytes" in said if told == 64 * MB else "allowed: 268 MB" in said


def test_a_log_of_very_many_records_that_say_nothing_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    block = struct.pack("<BQ", 0x80, 0) * 4096
    blocks = 200 * MB // len(block)
    path.write_bytes(mcap("zstd", squeezed("zstd", blocks, block), blocks * len(block)))
    assert "allowed: 537 MB" in refused("log", path)


def test_a_chunk_is_unpacked_as_it_was_packed() -> None:
    plain = bytes(range(256)) * 1000
    for method, packed in (("zstd", zstandard.compress(plain)), ("lz4", lz4.frame.compress(plain)), ("", plain)):
        assert unpacked_chunk(packed, method, len(plain), MB) == plain
        with pytest.raises(ValueError, match="than the"):
            unpacked_chunk(packed, method, len(plain) + 1, MB)
    two = zstandard.compress(plain) + zstandard.compress(plain)
    assert unpacked_chunk(two, "zstd", 2 * len(plain), MB) == plain + plain
    with pytest.raises(ValueError, match="compression 'xz'"):
        unpacked_chunk(b"", "xz", 0, MB)


def array_head(count: int) -> bytes:
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (count,)})
    return head.getvalue()


def test_an_archive_whose_arrays_mean_gigabytes_is_refused(tmp_path: Path) -> None:
    with (
        zipfile.ZipFile(tmp_path / "arrays.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("radius_px.npy", "w", force_zip64=True) as member,
    ):
        member.write(array_head(1152 * MB // 8))
        for _ in range(1152):
            member.write(ZEROS)
    (tmp_path / "artifact.json").write_text("{}")
    assert "allowed: " in refused("taught", tmp_path / "arrays.npz")
    assert "allowed: " in refused("policy", tmp_path / "artifact.json")


def test_arrays_come_back_and_a_head_or_method_that_promises_more_is_refused() -> None:
    out = io.BytesIO()
    np.savez(out, a=np.arange(6.0).reshape(2, 3), b=np.array(True))
    found = unpacked_arrays(out.getvalue())
    assert found["a"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert found["b"].item() is True
    for method in (zipfile.ZIP_STORED, zipfile.ZIP_BZIP2):
        lying = io.BytesIO()
        with zipfile.ZipFile(lying, "w", method) as archive:
            archive.writestr("a.npy", array_head(1 << 50) + bytes(64))
        with pytest.raises(ValueError, match=r"Memory|reading array|method"):
            unpacked_arrays(lying.getvalue())


@functools.cache
def png(side: int) -> bytes:
    def part(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    packer = zlib.compressobj(1)
    body = b"".join(packer.compress(ZEROS) for _ in range(side * (3 * side + 1) // MB + 1)) + packer.flush()
    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", body) + part(b"IEND", b"")


@pytest.mark.parametrize("reader", ["image", "picture"])
def test_an_image_of_very_many_pixels_is_refused(reader: str, tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(png(16_000))
    assert str(path) in refused(reader, path)


def test_a_film_of_huge_frames_is_refused_and_an_image_of_any_camera_is_read(tmp_path: Path) -> None:
    film = tmp_path / "bomb.avi"
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"MJPG"), 30, (9000, 9000))
    writer.write(np.zeros((9000, 9000, 3), np.uint8))
    writer.release()
    assert "its frames are 9000 x 9000 px; allowed: at most 67 million pixels" in refused("film", film)
    image = tmp_path / "camera.png"
    cv2.imwrite(str(image), np.zeros((6000, 8000), np.uint8))
    assert refused("image", image) == ""


def test_texts_that_grow_when_they_are_read_are_refused(tmp_path: Path) -> None:
    names = [f'<!ENTITY a{i} "{f"&a{i - 1};" * 10 if i else "x" * 100}">' for i in range(12)]
    urdf = tmp_path / "bomb.urdf"
    urdf.write_text(f"<?xml version='1.0'?><!DOCTYPE robot [{''.join(names)}]><robot name='&a11;'/>")
    assert str(urdf) in refused("urdf", urdf)
    lines = (f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))
    yaml = tmp_path / "bomb.yaml"
    yaml.write_text("a0: &a0 [x, x]\n" + "".join(lines))
    assert refused("yaml", yaml) != ""


@pytest.mark.slow  # packs what the bag means
def test_a_bag_whose_chunk_means_gigabytes_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="needs rosbags (pip install '.[ros]')")
    packer = bz2.BZ2Compressor()
    packed = b"".join(packer.compress(ZEROS) for _ in range(1200)) + packer.flush()

    def record(data: bytes, **fields: bytes) -> bytes:
        named = [name.encode() + b"=" + value for name, value in fields.items()]
        head = b"".join(struct.pack("<I", len(one)) + one for one in named)
        return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data

    connection = record(struct.pack("<I", 5) + b"type=" * 1, op=b"\x07", conn=struct.pack("<I", 0), topic=b"/pose")
    chunk = record(packed, op=b"\x05", compression=b"bz2", size=struct.pack("<I", 1200 * MB))
    info = record(
        struct.pack("<II", 0, 1),
        op=b"\x06",
        ver=struct.pack("<I", 1),
        chunk_pos=struct.pack("<Q", 4117),
        start_time=bytes(8),
        end_time=bytes(8),
        count=struct.pack("<I", 1),
    )
    start = struct.pack("<Q", 4117 + len(chunk))
    one = struct.pack("<I", 1)
    first = record(b" " * 4027, op=b"\x03", index_pos=start, conn_count=one, chunk_count=one)
    path = tmp_path / "bomb.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + first + chunk + connection + info)
    assert str(path) in refused("bag", path)
