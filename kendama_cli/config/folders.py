"""What the folders of configuration hold: files, groups, and the choices of a group; nothing here opens a file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from kendama_cli.config.site import Site


def configuration_files(site: Site) -> Iterator[Path]:
    """Every YAML file on the search path, those in linked folders too, as Hydra follows links."""
    return (path for folder in site.conf_folders for path in _files(folder))


def group_options(site: Site, group: str) -> list[str]:
    """The names that a configuration group offers on the search path."""
    return sorted({file.stem for folder in site.conf_folders for file in (folder / group).glob("*.yaml")})


def groups(site: Site) -> list[str]:
    """The configuration groups on the search path, nested ones by their path (``learn/task``)."""
    found = ((folder, file.parent) for folder in site.conf_folders for file in _files(folder))
    return sorted({place.relative_to(folder).as_posix() for folder, place in found if place != folder})


def _files(folder: Path) -> Iterator[Path]:
    for place, folders, names in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not _holds(os.path.join(place, name), place))
        yield from (Path(place) / name for name in sorted(names) if name.endswith(".yaml"))


def _holds(inner: str, place: str) -> bool:
    """Whether ``inner``, a folder in ``place``, is a link to a folder that holds it: it would be followed for ever."""
    if not os.path.islink(inner):
        return False
    return os.path.realpath(inner) in {os.path.realpath(one) for one in (Path(place), *Path(place).parents)}
