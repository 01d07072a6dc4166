"""Files and compositions of ``conf/`` that several workers of one run need, made by the first of them that asks.

A composition by Hydra takes a third of a second, and tests in many processes ask for the same choices of the same
files. One is known by the content of every file, so that whoever writes a file has its own.
"""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

from filelock import FileLock

from kendama_cli.config import hydra_compose
from kendama_cli.config.site import bundled_root
from kendama_cli.pipeline.command_cache import environment_now
from tests import alone

BUNDLED = str(bundled_root() / "conf")


def made_once(name: str, make: Callable[[Path], object]) -> Path:
    """The file or folder ``name`` of this run, as ``make`` left it at the path that it was given."""
    place = alone.shared_folder() / name
    with FileLock(f"{place}.lock"):
        if not place.exists():
            make(part := place.with_name(f"part-{name}"))
            part.rename(place)
    return place


def share_compositions(folder: Path) -> None:
    """Keep what Hydra composes in ``folder``, and take it from there."""
    folder.mkdir(exist_ok=True)
    compose = hydra_compose._compose_files.__wrapped__

    @functools.lru_cache(maxsize=64)
    def composed(folders: tuple[Path, ...], states: tuple[tuple[Any, ...], ...], chosen: tuple[str, ...]) -> Any:
        contents = [(_place(path, folders), _content(path, state)) for path, *state in states]
        place = folder / hashlib.sha256(repr((contents, chosen)).encode()).hexdigest()
        with FileLock(f"{place}.lock", poll_interval=0.01):
            if place.exists():
                config, read = pickle.loads(place.read_bytes())
                if environment_now(read) == read:
                    return config, read
            made = compose(folders, states, chosen)
            part = place.with_suffix(".part")
            part.write_bytes(pickle.dumps(made))
            part.rename(place)  # whole, or not there if this process is killed
            return made

    hydra_compose._compose_files = composed


def _place(path: str, folders: tuple[Path, ...]) -> tuple[int, str]:
    """A file's folder, of which the first that has a file counts, and its path in it."""
    return next((i, path[len(str(root)) :]) for i, root in enumerate(folders) if path.startswith(f"{root}{os.sep}"))


def _content(path: str, state: list[int]) -> bytes | None:
    """Read anew where a test may have written it twice within one tick of its stamp; None of a link to nothing."""
    try:
        return _read(path, *state) if path.startswith(BUNDLED) else Path(path).read_bytes()
    except OSError:
        return None


@functools.cache
def _read(path: str, *state: int) -> bytes:
    return hashlib.sha256(Path(path).read_bytes()).digest()
