"""Packages beside ours: wheels in a new environment, and those of examples/, as if they were installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def wheel_of(source: Path, folder: Path) -> Path:
    """Build the wheel of ``source`` in ``folder``, by the build backend of the test's own environment."""
    build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    subprocess.run([*build, str(source)], check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def new_environment(folder: Path, *wheels: Path) -> Path:
    """Install wheels in a new environment in ``folder``; the libraries come from the test's own. Return its programs.

    It has no pip, whose own installation would take as long as all else: the test's own pip installs there too.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    python = folder / "bin" / "python"
    install = ["install", "-q", "--no-deps", "--no-index", *map(str, wheels)]
    subprocess.run([sys.executable, "-m", "pip", "--python", python, *install], check=True)
    where = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    own = Path(subprocess.check_output(where, text=True).strip())
    # an editable install of ours, whose .pth lies in the same folder, is not read from there
    (own / "libraries.pth").write_text("\n".join(path for path in sys.path if path.endswith("site-packages")))
    return python.parent


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
