"""Boxes about ball and cup of a video of a swing: where they lie, and their files."""

from __future__ import annotations

import shlex
from pathlib import Path

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.boxes import image_files


def swing_boxes(path: Path) -> dict[str, Path]:
    """Return the folders with the boxes of ball and cup of the video ``path``: beside it."""
    folder = path.with_name(f"{path.stem}-boxes")
    return {"ball": folder, "cup": folder / "cup"}


def box_files(path: Path) -> list[Path]:
    """Return the files of a video's boxes; raises InputError where there are none of ball or cup."""
    for thing, folder in swing_boxes(path).items():
        if not (folder / "labels").is_dir():
            remedy = f"draw them: kendama camera train {shlex.quote(str(path))} --cup"
            raise InputError(str(path), f"no boxes show its {thing}: there is no {folder / 'labels'}", remedy=remedy)
    return [
        file
        for folder in swing_boxes(path).values()
        for file in (*sorted((folder / "labels").glob("*.txt")), *image_files([folder]))
    ]
