"""Folders of configuration beyond the first, brought to Hydra as its documentation asks: by a search path plugin."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from hydra.core.config_search_path import ConfigSearchPath, SearchPathQuery
from hydra.core.plugins import Plugins
from hydra.plugins.search_path_plugin import SearchPathPlugin


class FurtherFolders(SearchPathPlugin):
    """Puts ``folders`` behind the folder that Hydra was initialised with, before the schema; Hydra constructs it."""

    folders: tuple[Path, ...] = ()

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Called by Hydra while it is initialised."""
        for folder in reversed(self.folders):
            search_path.append("kendama", f"file://{folder}", anchor=SearchPathQuery(provider="main"))


@contextlib.contextmanager
def further_folders(folders: Sequence[Path]) -> Iterator[None]:
    """Have Hydra look into ``folders`` too, in this order, when it is initialised meanwhile."""
    Plugins.instance().register(FurtherFolders)
    FurtherFolders.folders = tuple(folders)
    try:
        yield
    finally:
        FurtherFolders.folders = ()
