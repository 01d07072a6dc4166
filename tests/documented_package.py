"""The packages in examples/ that the how-to pages show: a copy beside ours, as if it were installed."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def copy_example(name: str, folder: Path) -> None:
    """Copy the files of the package ``examples/NAME`` into ``folder``."""
    shutil.copytree(EXAMPLES / name, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))


def install_example(name: str, folder: Path) -> None:
    """Copy ``examples/NAME`` into ``folder`` and make it look installed there."""
    copy_example(name, folder)
    points = tomllib.loads((folder / "pyproject.toml").read_text())["project"]["entry-points"]
    groups = {group: "\n".join(f"{point} = {value}" for point, value in one.items()) for group, one in points.items()}
    declare_installed(folder, name, groups)


def declare_installed(folder: Path, name: str, groups: dict[str, str]) -> None:
    """Make the package ``name`` in ``folder`` look installed, with its entry points by group (LINE per entry point)."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [line for group, entry in groups.items() for line in (f"[{group}]", entry)]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
