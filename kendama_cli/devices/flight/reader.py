"""Recorded tracks of points from files of any known kind, told apart by what is in them."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.devices.flight import c3d, motive, qualisys
from kendama_cli.devices.flight.mcap_tracks import read_mcap_tracks
from kendama_cli.devices.flight.table import checked, read_table
from kendama_cli.errors import InputError
from kendama_cli.vision.flight_search import RecordedTrack

MCAP_MAGIC = b"\x89MCAP0\r\n"
KNOWN = "give a CSV with the columns t_s,x_m,y_m,z_m, a Qualisys TSV, a Motive CSV, a C3D, or an MCAP with transforms"


def read_tracks(path: Path) -> list[RecordedTrack]:
    """Every point's track in the file; raises InputError for a file that is none of the known kinds, or damaged."""
    name = str(path)
    if path.is_dir():
        raise InputError(name, "is a folder, not a file", remedy=KNOWN)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(name, "no such file", remedy=KNOWN) from None
    except OSError as wrong:
        raise InputError(name, f"cannot be read ({wrong.strerror})", remedy=KNOWN) from None
    if not content.strip():
        raise InputError(name, "is empty", remedy=KNOWN)
    if content.startswith(MCAP_MAGIC):
        tracks = read_mcap_tracks(path)
    elif c3d.is_c3d(content):
        tracks = c3d.read_c3d(name, content)
    else:
        tracks = _from_text(name, content)
    return [checked(name, track) for track in tracks]


def _from_text(path: str, content: bytes) -> list[RecordedTrack]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        problem = f"not UTF-8 text (byte 0x{content[wrong.start]:02x}), and neither MCAP nor C3D"
        raise InputError(path, problem, where=f"byte {wrong.start}", remedy=KNOWN) from None
    if "\0" in text:
        problem = "not a text file (it holds a zero byte), and neither MCAP nor C3D"
        raise InputError(path, problem, where=f"character {text.index(chr(0))}", remedy=KNOWN)
    if qualisys.is_qualisys(text):
        return qualisys.read_qualisys(path, text)
    if motive.is_motive(text):
        return motive.read_motive(path, text)
    return read_table(path, text)
