"""Hydra's compose API behind plain values and errors of one line; only this folder imports Hydra."""

from __future__ import annotations

import contextlib
import copy
import functools
import os
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra._internal.core_plugins.file_config_source import FileConfigSource
from hydra.core.config_search_path import ConfigSearchPath, SearchPathQuery
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import OverrideType
from hydra.core.plugins import Plugins
from hydra.errors import OverrideParseException
from hydra.plugins.config_source import ConfigResult
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import DictConfig, OmegaConf
from omegaconf.basecontainer import BaseContainer
from omegaconf.resolvers import oc

from kendama_cli.config.site import Site, configuration_files, group_options, groups
from kendama_cli.config.typed import EXAMPLE, as_meant, for_shell, several_values, unreadable
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.command_cache import environment_now, settled, stamps
from kendama_cli.schema.hints import listed, nearest, unknown_key, value_hint
from kendama_cli.schema.plain_yaml import TooMuchError, check_plain, check_yaml, load_yaml
from kendama_cli.schema.renames import new_key, new_value

Environment = dict[str, str | None]
"""Values by name; None for a variable that was not set."""


class FurtherFolders(SearchPathPlugin):
    """Puts ``folders`` in the place of the folder that Hydra was initialised with; Hydra constructs it."""

    folders: tuple[Path, ...] = ()

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Put the folders on Hydra's search path; Hydra calls it while it is initialised."""
        for element in search_path.get_path():
            if element.provider == "main" and self.folders:
                element.path = f"{KindDefaults.scheme()}://{self.folders[0]}"
        for folder in reversed(self.folders[1:]):
            path = f"{KindDefaults.scheme()}://{folder}"
            search_path.append("kendama", path, anchor=SearchPathQuery(provider="main"))


class KindDefaults(FileConfigSource):
    """Files of a group that hold only what differs: the missing keys are those of the group's file ``<kind>.yaml``.

    Hydra constructs it, for folders by this scheme. A file with a list of ``defaults`` says itself what it is based on.
    """

    @staticmethod
    def scheme() -> str:
        """Return the scheme of paths that Hydra reads through this class."""
        return "kind"

    def load_config(self, config_path: str) -> ConfigResult:
        """Read a file; one with a ``kind`` that has a file of its own in the group gets it as its first default."""
        read = super().load_config(config_path)
        group, _, name = config_path.removesuffix(".yaml").rpartition("/")
        config = read.config
        if not group or not isinstance(config, DictConfig) or "defaults" in config:
            return read
        kind = str(config._get_node("kind"))  # as it is written: an interpolation names no file
        files = (folder / group / f"{kind}.yaml" for folder in FurtherFolders.folders)
        base = None if kind == name else next((file for file in files if file.is_file()), None)
        if base is not None:
            keys = load_yaml(base.read_text(encoding="utf-8"))
            if isinstance(keys, dict) and "kind" not in keys:  # arms have none: it only says whose values these are
                config.pop("kind")
            config["defaults"] = [kind, "_self_"]
        return read


@contextlib.contextmanager
def searched(folders: Sequence[Path]) -> Iterator[None]:
    """Make Hydra search ``folders``, in this order, when it is initialised meanwhile."""
    Plugins.instance().register(FurtherFolders)
    Plugins.instance().register(KindDefaults)
    FurtherFolders.folders = tuple(folders)
    try:
        yield
    finally:
        FurtherFolders.folders = ()


def parse_overrides(overrides: Sequence[str]) -> list[Any]:
    """Parse ``overrides`` by Hydra's grammar; raises ConfigError for one that does not fit it."""
    parsed = []
    for text in overrides:
        try:
            parsed += OverridesParser.create().parse_overrides([text])
        except OverrideParseException as error:
            raise unreadable(text, text.partition("=")[0]) from error
    return parsed


def compose_with_hydra(site: Site, overrides: list[str]) -> tuple[dict[str, Any], Environment]:
    """Return the configuration for ``overrides`` and the variables its interpolations read; raises ConfigError.

    The result of the chosen files is cached for the next composition in this process while they are unchanged, as most
    of the time goes into reading and merging them; other values are then set in it as Hydra sets them.
    """
    names = groups(site)
    overrides = as_meant(site, overrides)
    _check_overrides(site, overrides, names)
    parsed = parse_overrides(overrides)
    values = [override for override in parsed if override.key_or_group not in names]
    if any(override.type is not OverrideType.CHANGE or override.package is not None for override in values):
        chosen, values = overrides, []  # Hydra's own rules for keys that are added or taken away
    else:
        chosen = [text for text, override in zip(overrides, parsed, strict=True) if override.key_or_group in names]
    try:
        config, read = _composed_files(site, chosen)
        with recorded() as environment:
            for override in values:
                OmegaConf.update(config, override.key_or_group, override.value(), merge=True)
            made = OmegaConf.to_container(config, resolve=True)
        check_plain(made)
    except ConfigError:
        raise
    except RecursionError as error:
        raise ConfigError("conf", "configuration: values are nested too deep, or refer to themselves") from error
    except Exception as error:  # for odd files Hydra and OmegaConf also raise what any line of theirs may raise
        raise _plain_error(site, overrides, error) from error
    assert isinstance(made, dict)
    return {str(key): value for key, value in made.items()}, {**read, **environment}


def _composed_files(site: Site, chosen: list[str]) -> tuple[DictConfig, Environment]:
    """Compose the files that ``chosen`` selects; return a new object and the variables that the selection read."""
    now_s = time.time()
    states = stamps(configuration_files(site))
    compose_files = _compose_files if settled(states, now_s) else _compose_files.__wrapped__
    asked = (site.conf_folders, tuple((path, *state) for path, state in states.items()), tuple(chosen))
    config, read = compose_files(*asked)
    if environment_now(read) != read:
        config, read = _compose_files.__wrapped__(*asked)
    return copy.deepcopy(config), read


@functools.lru_cache(maxsize=64)
def _compose_files(
    folders: tuple[Path, ...], states: tuple[tuple[str | int, ...], ...], chosen: tuple[str, ...]
) -> tuple[DictConfig, Environment]:
    _check_files(folders, [Path(str(path)) for path, *_ in states])
    with (
        searched(folders),
        initialize_config_dir(str(folders[0]), job_name="kendama", version_base="1.3"),
        recorded() as environment,
    ):
        config = compose("config", overrides=list(chosen))
    if not isinstance(config, DictConfig):
        raise ValueError(f"config.yaml must be a group of keys, not {type(config).__name__}")
    return config, dict(environment)


def _check_overrides(site: Site, overrides: list[str], names: list[str]) -> None:
    for text, override in zip(overrides, parse_overrides(overrides), strict=True):
        key = override.key_or_group
        if not key:
            raise ConfigError("", f"'{text}' has no key; type KEY=VALUE, as in {EXAMPLE}")
        if override.is_sweep_override():
            raise several_values(text, key)
        if key.partition(".")[0].partition("/")[0].partition("@")[0] == "hydra":
            raise ConfigError(key, f"'{text}' would change Hydra itself, which kendama does not offer")
        if "." in key and key.replace(".", "/") in names and isinstance(override.value(), str):
            raise ConfigError(key, f"'{key}' is a group; type {key.replace('.', '/')}={override.value()}")
        if key in names and not override.is_delete() and not isinstance(override.value(), str):
            options = ", ".join(group_options(site, key))
            raise ConfigError(key, f"'{text}' must name one choice of the group '{key}'; allowed: {options}")


def _check_files(folders: Sequence[Path], files: Sequence[Path]) -> None:
    """Refuse files that would take Hydra all memory, and a first file that would have it import modules."""
    for file in files:
        with contextlib.suppress(OSError):  # a link to nothing, or a file that may not be read: Hydra says so if asked
            try:
                check_yaml(file.read_text(encoding="utf-8", errors="replace"))
            except TooMuchError as error:
                raise ConfigError("conf", f"{file}: {error}") from None
            except ValueError:
                continue  # not YAML: Hydra says so where it is chosen
    first = next((folder / "config.yaml" for folder in folders if (folder / "config.yaml").is_file()), None)
    with contextlib.suppress(OSError, ValueError):  # Hydra says what is wrong with it
        document = None if first is None else load_yaml(first.read_text(encoding="utf-8"))
        if not isinstance(document, dict) or "hydra" not in document:
            return
        raise ConfigError("hydra", f"{first}: 'hydra' would change Hydra itself, which kendama does not offer")


def _plain_error(site: Site, overrides: list[str], error: Exception) -> ConfigError:
    """Return a one-line error for what Hydra could not compose: the first override that does not fit, or Hydra's
    message.
    """
    names = groups(site)
    choices = [
        item for item in parse_overrides(overrides) if item.key_or_group in names and isinstance(item.value(), str)
    ]
    for override in choices:
        options = group_options(site, override.key_or_group)
        if override.value() not in options:
            key = override.key_or_group
            hint = value_hint(key.replace("/", "."), override.value(), options, key)
            if key == "capture" and Path(override.value()).suffix:
                hint = f"; for a file type {for_shell(f'capture.path={override.value()}')}"
            return ConfigError(key, listed(f"'{key}' is '{override.value()}'", hint, options))
    valid = [item.input_line for item in choices]
    if len(valid) < len(overrides):
        config, _ = compose_with_hydra(site, [text for text in valid if text is not None])
        for override in parse_overrides(overrides):
            problem = _nested_group(site, override, names) or _missing(config, override.key_or_group, names)
            if problem is not None and not override.is_add() and not override.is_force_add():
                return problem
    remedy = f"; save {_not_utf8(site)} as UTF-8" if isinstance(error, UnicodeDecodeError) else ""
    return ConfigError("conf", "configuration: " + " ".join(str(error).split()) + remedy)


def _not_utf8(site: Site) -> str:
    """Return the files of configuration that are no UTF-8."""
    found = []
    for file in configuration_files(site):
        try:
            file.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            found.append(str(file))
        except OSError:
            continue
    return " and ".join(found)


def _nested_group(site: Site, override: Any, names: list[str]) -> ConfigError | None:
    """Return the error for a choice of a nested group by its last name: ``learner=sarsa`` is of ``learn/learner``."""
    name, value = override.key_or_group, override.value()
    having = [one for one in names if "/" in one and one.rpartition("/")[2] == name]
    if name in names or not having:
        return None
    known = [(one, str(new_value(one.replace("/", "."), str(value)))) for one in having]
    group, meant = next(((one, new) for one, new in known if new in group_options(site, one)), (having[0], "CHOICE"))
    problem = f"unknown key '{name}'; type {group}={meant}"
    return ConfigError(name, listed(problem, "", group_options(site, group)))


def _below(node: dict[str, Any]) -> Iterator[str]:
    """Return the dotted names of all values beneath the keys of ``node``."""
    for name, value in node.items():
        if isinstance(value, dict):
            for inner in (*value, *_below(value)):
                yield f"{name}.{inner}"


def _missing(config: dict[str, Any], key: str, names: list[str]) -> ConfigError | None:
    """Return the error for the first part of ``key`` that ``config`` does not have; None if it has all parts."""
    if "/" in key and key not in names:
        return ConfigError(key, listed(f"unknown group '{key}'", nearest(key, names), names, "available"))
    node: Any = config
    walked = ""
    for part in key.split("."):
        path = f"{walked}.{part}" if walked else part
        if not isinstance(node, dict):
            return ConfigError(key, f"unknown key '{key}': '{walked}' is a value and has no keys below it")
        if part not in node and (walked or part not in names):
            return unknown_key(key if new_key(path) != path else path, node, _below(node))
        node, walked = node.get(part, {}), path
    return None


@contextlib.contextmanager
def recorded() -> Iterator[Environment]:
    """Record every environment variable that an interpolation reads meanwhile, with its value.

    OmegaConf's own resolvers alone are there meanwhile: a clock (Hydra's ``now``) or a resolver that another library
    registered would return values that no stamp could identify later.
    """
    read: Environment = {}

    def environment(name: str, *default: Any) -> str | None:
        read[name] = os.environ.get(name)
        return oc.env(name, *default)

    # OmegaConf has no public way of putting back the resolvers of the program that this one may be a library of
    before = BaseContainer._resolvers
    try:
        OmegaConf.clear_resolvers()
        OmegaConf.register_new_resolver("oc.env", environment, replace=True)
        yield read
    finally:
        BaseContainer._resolvers = before
