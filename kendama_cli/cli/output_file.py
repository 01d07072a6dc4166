"""Files that a command writes where its user says: refused before the work starts, and written in the end."""

from __future__ import annotations

import tempfile
from pathlib import Path

from kendama_cli.errors import UsageError
from kendama_cli.store.durable import write_file


def refuse_output(output: Path, what: str = "", *endings: str, option: str = "-o") -> None:
    """Raise UsageError where ``output``, named by ``option``, cannot be written.

    ``what`` says of what kind it is ("a track is a CSV or an MCAP log"), ``endings`` the names' endings that are
    allowed, any without one. Whether the folder takes a file is found by making one in it: permissions do not tell of a
    file system that is mounted for reading only.
    """
    if output.is_dir():
        inside = output / f"output{endings[0] if endings else ''}"
        raise UsageError(f"{option} {output}: it is a folder; name a file in it, such as {inside}")
    if endings and output.suffix.lower() not in endings:
        names = " or ".join(str(output.with_suffix(ending)) for ending in endings if ending != ".yml")
        raise UsageError(f"{option} {output}: {what}; name it {names}")
    folder = output.absolute().parent
    if not folder.exists():
        raise UsageError(f"{option} {output}: there is no folder {output.parent}; make it, or name another one")
    if not folder.is_dir():
        raise UsageError(f"{option} {output}: {output.parent} is no folder; name a folder that is there")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise UsageError(
            f"{option} {output}: the folder {output.parent} takes no file ({reason}); name another one"
        ) from error


def write_output(output: Path, data: bytes, *, option: str = "-o") -> None:
    """Replace ``output``, named by ``option``, by ``data``, durably; raises StoreError where the disk refuses."""
    write_file(output, data, option=option)
