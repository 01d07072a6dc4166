"""The kinds of files that recordings of motion come in, told apart by how they begin: one table for every reader.

The hand (``capture=file``, ``capture=body``), the measured toy and ``kendama log predict`` open their files here.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.errors import InputError
from kendama_cli.log.container import MAGIC as MCAP_MAGIC

HEAD_BYTES = 4096
C3D_BLOCK_BYTES = 512
C3D_KEY = 0x50
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
VICON_PARTS = ("Trajectories", "Devices", "Segments", "Joints", "Model Outputs")
STREAM_HEADER = "t_s,x_m,y_m,z_m,qw,qx,qy,qz"


@dataclass(frozen=True)
class RecordingFormat:
    """One kind of file: what messages call it, whether a file's first 4096 bytes are of it, and its usual endings.

    ``endings`` decide only where a file begins as none of the others does, so that a damaged one is called so.
    """

    name: str
    begins: Callable[[bytes], bool]
    endings: tuple[str, ...] = ()


def _is_c3d(head: bytes) -> bool:
    """Return True if ``head`` has the address of its parameters, then the key (C3D user guide, header section)."""
    block = head[:C3D_BLOCK_BYTES]
    return len(block) == C3D_BLOCK_BYTES and block[1] == C3D_KEY and 2 <= block[0] <= 20 and b"\0" in block


def _text(head: bytes) -> str:
    encoding = "utf-16" if head.startswith(UTF_16) else "utf-8-sig"
    return head.decode(encoding, errors="replace").replace("\r\n", "\n").lstrip('"')


MCAP = RecordingFormat("an MCAP with poses", lambda head: head.startswith(MCAP_MAGIC), (".mcap",))
BAG = RecordingFormat("a ROS bag", lambda head: head.startswith((b"#ROSBAG V", b"SQLite format 3\0")), (".bag", ".db3"))
C3D = RecordingFormat("a C3D", _is_c3d)
PARQUET = RecordingFormat("a Parquet table", lambda head: head.startswith(b"PAR1"), (".parquet",))
NPZ = RecordingFormat("an npz", lambda head: head.startswith(b"PK\3\4"), (".npz",))
BVH = RecordingFormat("a BVH", lambda head: _text(head).lstrip().startswith("HIERARCHY"), (".bvh",))
QUALISYS = RecordingFormat("a Qualisys TSV", lambda head: _text(head).startswith("NO_OF_FRAMES\t"))
TRC = RecordingFormat("a TRC", lambda head: _text(head).startswith("PathFileType"))
VICON = RecordingFormat("a Vicon CSV", lambda head: _text(head).startswith(VICON_PARTS))
MOTIVE = RecordingFormat("a Motive CSV", lambda head: _text(head).startswith("Format Version"))
STREAM = RecordingFormat("a stream that was kept", lambda head: f"\n{STREAM_HEADER}\n" in f"\n{_text(head)}")
TABLE = RecordingFormat("a table of text", lambda head: True)

_EXPORT = "export it as CSV from the program that made it"
FOREIGN: tuple[tuple[str, tuple[bytes, ...], tuple[str, ...], str], ...] = (
    ("a spreadsheet", (b"\xd0\xcf\x11\xe0",), (".xlsx", ".xlsm", ".xls", ".ods"), "save it as CSV in its program"),
    ("compressed", (b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"(\xb5/\xfd", b"7z\xbc\xaf"), (".zip",), "unpack it"),
    ("a file of MATLAB", (b"MATLAB ",), (".mat",), "write a table of it there, by writematrix or writetable"),
    ("an array of NumPy", (b"\x93NUMPY",), (), "write its columns by numpy.savetxt or by name with numpy.savez"),
    ("an HDF5 file", (b"\x89HDF",), (".h5", ".hdf5"), "write its columns as CSV, by pandas for instance"),
    ("a Python pickle", tuple(b"\x80%c" % one for one in range(2, 6)), (".pkl", ".pickle"), "write its columns as CSV"),
    ("JSON", (b"{", b"[{", b"[[", b"[\n"), (), "write its columns as CSV, by pandas for instance"),
    ("a log of PX4", (b"ULog",), (".ulg",), "make CSV of it by ulog2csv"),
    ("a picture", (b"\x89PNG", b"\xff\xd8\xff"), (), _EXPORT),
    ("a video", (b"\x1aE\xdf\xa3",), (".mp4", ".mov", ".avi", ".mkv", ".webm"), "type: kendama explain capture"),
)
"""Kinds of files that no reader reads: name, beginnings, usual endings of the binary forms, and what to do instead."""

FORMATS = (MCAP, BAG, C3D, PARQUET, NPZ, BVH, QUALISYS, TRC, VICON, MOTIVE, STREAM, TABLE)
"""In the order in which they are tried; what is none of the others is a table."""


def format_of(path: Path, *, remedy: str, folder_remedy: str | None = None) -> RecordingFormat:
    """Return the format of a recording in a file (or the folder of a ROS 2 bag).

    Raises InputError with ``remedy`` where it cannot be read or is empty, with ``folder_remedy`` for another folder.
    """
    name = str(path)
    if path.name == "metadata.yaml" and path.is_file():  # stands for the folder
        return BAG
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return BAG
        if (path / "meta/info.json").is_file():  # a LeRobot dataset
            return PARQUET
        raise InputError(name, "is a folder, not a file", remedy=folder_remedy or remedy)
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except FileNotFoundError:
        raise InputError(name, "no such file", remedy=remedy) from None
    except OSError as wrong:
        raise InputError(name, f"cannot be read ({wrong.strerror})", remedy=remedy) from None
    if not head.strip():
        raise InputError(name, "is empty, no row", remedy=f"export or record it again, or {remedy}")
    ending = path.suffix.lower() if head.startswith(b"PK") or b"\0" in head else ""  # text is a table by any name
    for what, begins, endings, advice in FOREIGN:
        if head.startswith(begins) or ending in endings:
            raise InputError(name, f"is {what}, which is not read", remedy=advice)
    begun = next(one for one in FORMATS if one.begins(head))
    return begun if begun is not TABLE else next((one for one in FORMATS if path.suffix.lower() in one.endings), TABLE)


def layout_command(path: str) -> str:
    """Return the command that finds out how a recording is laid out."""
    return f"kendama capture layout {shlex.quote(path)}"


def name_of(path: str) -> str:
    """Return the name of the recording: of its file without the ending, or of a bag's folder."""
    file = Path(path)
    return file.parent.name if file.name == "metadata.yaml" else file.stem


def text_of(path: str, content: bytes, *, remedy: str) -> str:
    """Return the text of a file: UTF-16 with a byte order mark, UTF-8, or else Windows' Western European.

    Raises InputError where it is none.
    """
    try:
        text = content.decode("utf-16") if content.startswith(UTF_16) else content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")  # a name or a unit in the head, say
    if (zero := text.find("\0")) >= 0:
        export = f"export it as CSV from the program that made it, or {remedy}"
        raise InputError(path, "not a text file (it holds a zero byte)", where=f"byte {zero}", remedy=export)
    return text
