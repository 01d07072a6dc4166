"""WHERE things are: the home folder and the search path of conf/, pipelines/ and data/. Never part of a key."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.errors import UsageError
from kendama_cli.store.durable import is_text


@dataclass(frozen=True)
class Site:
    """The folders of one invocation; in each search path the first folder that has a file wins."""

    home: Path
    conf_folders: tuple[Path, ...]
    pipeline_folders: tuple[Path, ...]
    data_roots: tuple[Path, ...]
    considered: tuple[Path, ...] = ()
    """Every folder that conf/ and pipelines/ were looked for in, whether it exists or not."""


def bundled_root() -> Path:
    """Return the folder that holds the ``conf/``, ``pipelines/`` and ``data/`` that came with this installation."""
    package = Path(__file__).parents[1]
    in_wheel = package / "bundled"
    return in_wheel if in_wheel.is_dir() else package.parent


def find_site(home: Path | None = None, config_dir: Path | None = None) -> Site:
    """Return the site for the current folder, ``KENDAMA_HOME``, ``KENDAMA_CONFIG_DIR`` and the command line's
    options.

    ``config_dir`` may be a folder that holds ``conf/`` (and ``pipelines/``), or a ``conf`` folder itself. Raises
    UsageError where it does not exist.
    """
    here = Path.cwd()
    roots = [here]
    conf: list[Path] = []
    if config_dir is None and os.environ.get("KENDAMA_CONFIG_DIR"):
        config_dir = Path(os.environ["KENDAMA_CONFIG_DIR"])
    if config_dir is not None:
        chosen = Path(os.path.expanduser(config_dir)).resolve()
        if not chosen.is_dir():
            raise UsageError(f"--config-dir {config_dir}: no such folder; name one that holds conf/ or YAML groups")
        if (chosen / "conf").is_dir() or (chosen / "pipelines").is_dir():
            roots.insert(0, chosen)
        else:
            conf.append(chosen)
            roots.insert(0, chosen.parent)
    roots.append(bundled_root())
    home = home or Path(os.environ.get("KENDAMA_HOME") or ".kendama")
    conf_folders = [*conf, *(root / "conf" for root in roots)]
    pipeline_folders = [*(folder / "pipelines" for folder in conf), *(root / "pipelines" for root in roots)]
    home = Path(os.path.expanduser(home)).absolute()
    for what, folder in (("--home", home), *(("the folder of configuration", folder) for folder in conf_folders)):
        if not is_text(str(folder)):
            raise UsageError(f"{what} {str(folder)!a} is not UTF-8 text; rename it, or name another folder")
    if home.exists() and not home.is_dir():
        raise UsageError(f"--home {home} is a file; name a folder, which need not exist yet")
    return Site(
        home=home,
        conf_folders=_existing(conf_folders),
        pipeline_folders=_existing(pipeline_folders),
        data_roots=_existing([here, *roots]),
        considered=(*conf_folders, *pipeline_folders),
    )


def _existing(folders: list[Path]) -> tuple[Path, ...]:
    resolved = [folder.resolve() for folder in folders if folder.is_dir()]
    return tuple(dict.fromkeys(resolved))


def configuration_files(site: Site) -> Iterator[Path]:
    """Return every YAML file on the search path, those in linked folders too, as Hydra follows links."""
    return (path for folder in site.conf_folders for path in _files(folder))


def group_options(site: Site, group: str) -> list[str]:
    """Return the names that a configuration group offers on the search path."""
    return sorted({file.stem for folder in site.conf_folders for file in (folder / group).glob("*.yaml")})


def groups(site: Site) -> list[str]:
    """Return the configuration groups on the search path, nested ones by their path (``learn/task``)."""
    found = ((folder, file.parent) for folder in site.conf_folders for file in _files(folder))
    return sorted({location.relative_to(folder).as_posix() for folder, location in found if location != folder})


def _files(folder: Path) -> Iterator[Path]:
    for location, folders, names in os.walk(folder, followlinks=True):
        folders[:] = sorted(name for name in folders if not _holds(os.path.join(location, name), location))
        yield from (Path(location) / name for name in sorted(names) if name.endswith(".yaml"))


def _holds(inner: str, location: str) -> bool:
    """Return True if ``inner``, a folder in ``location``, links to a folder that contains it: following it would never
    end.
    """
    if not os.path.islink(inner):
        return False
    return os.path.realpath(inner) in {os.path.realpath(one) for one in (Path(location), *Path(location).parents)}
