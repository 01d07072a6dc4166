"""Files that a command writes where its user says: refused before the work starts, and written in the end."""

from __future__ import annotations

import tempfile
from pathlib import Path

from kendama_cli.errors import UsageError
from kendama_cli.store.durable import write_file


def refuse_output(output: Path, what: str = "", *endings: str, option: str = "-o") -> None:
    """Raise UsageError where ``output``, named by ``option``, cannot be written.

    ``what`` says of what kind it is ("a track is a CSV"), ``endings`` the names' endings that are
    allowed, any without one. Folders that are not there are made when it is written. Whether a folder takes a file is
    found by making one in it: permissions do not tell of a file system that is mounted for reading only.
    """
    if output.is_dir():
        inside = output / f"output{endings[0] if endings else ''}"
        raise UsageError(f"{option} {output}: it is a folder; name a file in it, such as {inside}")
    if endings and output.suffix.lower() not in endings:
        names = " or ".join(str(output.with_suffix(ending)) for ending in endings if ending != ".yml")
        raise UsageError(f"{option} {output}: {what}; name it {names}")
    folder = next(one for one in output.absolute().parents if one.exists())
    if not folder.is_dir():
        raise UsageError(f"{option} {output}: {_shown(folder, output)} is no folder; name another one")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise UsageError(
            f"{option} {output}: the folder {_shown(folder, output)} takes no file ({reason}); name another one"
        ) from error


def _shown(folder: Path, output: Path) -> Path:
    """Return a folder above ``output`` as its user would write it."""
    here = Path.cwd()
    return folder.relative_to(here) if not output.is_absolute() and folder.is_relative_to(here) else folder


def write_output(output: Path, data: bytes, *, option: str = "-o") -> None:
    """Replace ``output``, named by ``option``, by ``data``, durably; raises StoreError where the disk refuses."""
    write_file(output, data, option=option)
