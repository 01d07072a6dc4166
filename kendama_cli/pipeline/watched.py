"""Every file and folder that decides what a run with nothing to do says, with the state in which it was read."""

from __future__ import annotations

import contextlib
import glob
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.pipeline.command_cache import Stamps, stamps
from kendama_cli.pipeline.plan import Planner
from kendama_cli.schema.settings import input_files

STANDARD_LIBRARY = os.path.dirname(os.__file__)


def configuration_stamps(folders: Sequence[Path], pipeline: str) -> Stamps:
    """Return the state of all files that configuration and pipelines are read from: ``folders`` whole, existing or
    not.
    """
    named = [Path(pipeline)] if pipeline.endswith((".yaml", ".yml")) else []
    return stamps([*named, *(path for folder in folders for path in _tree(folder))])


def input_stamps(planner: Planner, settings: Mapping[str, Any], roots: Sequence[Path]) -> Stamps | None:
    """Return the state of input files, code and installed packages; None if a file has changed since it was read.

    ``settings`` are those that the configuration gave, ``roots`` the folders in which their files were looked for.
    """
    nodes = {node for spec in planner.pipeline.stages for node in spec.config.values()}
    patterns = {pattern for node in nodes for found in input_files(settings[node]).values() for pattern in found}
    if any("**" in pattern for pattern in patterns):
        return None
    looked = {path for pattern in patterns for path in looked_at(pattern, roots)}
    read = planner.index.read
    found = stamps([*looked, *planner.index.folders, *_installed(), *_modules(), *read])
    return found if all(found[path] == state for path, state in read.items()) else None


def looked_at(pattern: str, roots: Sequence[Path]) -> Iterator[Path]:
    """Return the files and folders whose state decides which files ``pattern`` matches, up to the first absent one."""
    expanded = Path(os.path.expanduser(pattern))
    if expanded.is_absolute():
        roots, expanded = [Path(expanded.anchor)], expanded.relative_to(expanded.anchor)
    for root in roots:
        yield root / expanded  # a file whose name has the signs of a pattern
        locations = [root]
        for part in expanded.parts:
            if glob.has_magic(part):
                yield from locations
            locations = [
                Path(path)
                for location in locations
                for path in (glob.glob(str(location / part)) if glob.has_magic(part) else [location / part])
            ]
        yield from locations


def _tree(folder: Path) -> Iterator[Path]:
    yield folder
    for location, folders, files in os.walk(folder, followlinks=True):
        yield from (Path(location) / name for name in folders)
        yield from (Path(location) / name for name in files if name.endswith((".yaml", ".yml")))


def _installed() -> Iterator[Path]:
    """Return the folders of ``sys.path``, and the entry points of the packages installed there."""
    for name in sys.path:
        folder = Path(name or ".")
        yield folder
        with contextlib.suppress(OSError):  # one that this user may not read holds no package either
            yield from folder.glob("*-info/entry_points.txt")


def _modules() -> Iterator[str]:
    """Return the files of the modules imported by now, but the standard library's."""
    for module in list(sys.modules.values()):
        file = getattr(module, "__file__", None)
        if file is not None and (not file.startswith(STANDARD_LIBRARY) or "-packages" in file):
            yield file
