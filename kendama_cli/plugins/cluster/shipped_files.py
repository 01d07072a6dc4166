"""Input files on a machine that did not name them: where they are there, or copies of them from the shared store."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from kendama_cli.errors import StageError
from kendama_cli.plugins.cluster.shared import SharedStore
from kendama_cli.store import durable
from kendama_cli.store.store import Store


def placed_files(files: Mapping[str, Mapping[str, str]], store: Store) -> dict[str, str]:
    """Place the sender's ``files`` on this machine; return their paths here by those there, empty if the same.

    Files that belong together stand in one folder as they did there. Raises RemoteError where one is nowhere.
    """
    if all(_is_here(path, facts["sha256"]) for path, facts in files.items()):
        return {}
    assert isinstance(store.shared, SharedStore)
    inputs = store.home / "inputs" / durable.sha256(durable.canonical_json(files))[:32]
    places = {}
    for path, facts in files.items():
        folder = os.path.dirname(facts["beside"])
        inside = os.path.relpath(path, folder)
        if inside.startswith(os.pardir):
            raise StageError(f"{facts['beside']} lists {inside}: a table's files must be below its folder to travel")
        # a bag is called by its folder
        place = inputs / durable.sha256(folder.encode())[:16] / os.path.basename(folder) / inside
        if not _is_here(str(place), facts["sha256"]):
            store.shared.fetch_file(facts["sha256"], place)
        places[path] = str(place)
    return places


def _is_here(path: str, digest: str) -> bool:
    try:
        return durable.file_sha256(Path(path)) == digest
    except OSError:
        return False
