"""Files that a table names: beside it or below its folder, and nowhere else."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath

from kendama_cli.errors import InputError


def listed_file(table: Path, name: str, where: str) -> Path:
    """Return the file called ``name`` in the row ``where`` of ``table``; it may be absent.

    Raises InputError where it would be anywhere else than below the table's folder, by its name or by a link.
    """
    parts = PureWindowsPath(name)  # which takes both kinds of slashes
    folder = table.parent
    try:
        is_below = not parts.anchor and ".." not in parts.parts and "\0" not in name
        if is_below and (folder / name).resolve().is_relative_to(folder.resolve()):
            return folder / name
    except (OSError, RuntimeError):  # a name that is too long, links in a circle
        pass
    remedy = "name files by their paths from the table's folder, without '..' or links out of it"
    raise InputError(str(table), f"{name[:200]!r} is no file below {folder}", where=where, remedy=remedy)
