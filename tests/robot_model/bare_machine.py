"""Runs a command where the system has no libGL and no libX11: ``python bare_machine.py FOLDER COMMAND...``.

It wants a mount namespace of its own (``unshare --mount``). There the folders of the system's libraries are replaced
by folders of links to everything in them but those libraries; FOLDER is an empty folder to work in.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HIDDEN = ("libGL", "libX11", "libEGL", "libOpenGL")


def library_folders() -> list[Path]:
    """Every folder in which the loader finds one of the hidden libraries."""
    cache = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True, check=False)
    paths = [Path(line.rpartition("=> ")[2]) for line in cache.stdout.splitlines() if "=> " in line]
    return sorted({path.parent.resolve() for path in paths if path.name.startswith(HIDDEN)})


def hide(folder: Path, work: Path) -> None:
    """Cover ``folder`` by links to all of it but the hidden libraries."""
    original, links = work / "original", work / "links"
    for made in (original, links):
        made.mkdir(parents=True)
    subprocess.run(["mount", "--rbind", str(folder), str(original)], check=True)
    for entry in original.iterdir():
        if not entry.name.startswith(HIDDEN):
            (links / entry.name).symlink_to(entry)
    subprocess.run(["mount", "--bind", str(links), str(folder)], check=True)


if __name__ == "__main__":
    for number, place in enumerate(library_folders()):
        hide(place, Path(sys.argv[1]) / str(number))
    os.execvp(sys.argv[2], sys.argv[2:])
