"""Configuration from ``conf/`` and overrides, by Hydra's compose API. The only place that imports Hydra.

What was composed is remembered by the state of every file on the search path, so that a run with nothing to do
never loads Hydra; validation by the settings' schema follows in any case.
"""

from __future__ import annotations

import contextlib
import copy
import hashlib
import json
import re
from collections.abc import Collection, Iterator, Sequence
from typing import Any

from kendama_cli.config.site import Site
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.unchanged import stamps
from kendama_cli.schema.settings import nearest, unknown_key
from kendama_cli.store import durable

PLAIN_KEY = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
RESOLVER = re.compile(r"\$\{.*:")
"""May find too much (a colon after a plain interpolation): that composes once more, and never gives an old value."""
REFERENCE = re.compile(r"\$\{([^{}]*)\}")
PLAIN_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?")


def composed(site: Site, overrides: Sequence[str]) -> dict[str, Any]:
    """The plain configuration for ``overrides``; raises ConfigError for what does not compose."""
    for text in overrides:
        if not durable.is_text(text):
            key = text.partition("=")[0]
            raise ConfigError(key, f"{text!a} is not UTF-8 text; rename the file or folder that it names")
    states = stamps(file for folder in site.conf_folders for file in sorted(folder.rglob("*.yaml")))
    question = {"overrides": list(overrides), "folders": [str(folder) for folder in site.conf_folders]}
    name = hashlib.sha256(durable.canonical_json(question)).hexdigest()[:32]
    path = site.home / "index" / "compose" / f"{name}.json"
    known = durable.read_index(path)
    if known is not None and known["question"] == question and known["stamps"] == states:
        return dict(known["answer"])
    answer = _compose(site, list(overrides))
    if not depends_on_surroundings(site, overrides):
        durable.write_index(path, {"question": question, "stamps": states, "answer": answer})
    return answer


def composed_each(site: Site, combinations: Sequence[Sequence[str]]) -> Iterator[dict[str, Any]]:
    """``composed`` for each of many override lists that differ in few values, as a sweep's do.

    Composing costs a tenth of a second; so what remains of a list without its plain ``KEY=NUMBER`` overrides is
    composed once, and these are set in the result. Values that others refer to (``${...}``) are composed in full.
    """
    bases: dict[tuple[str, ...], tuple[dict[str, Any], frozenset[str]]] = {}
    for overrides in combinations:
        plain = {}
        for text in overrides:
            key, _, value = text.partition("=")
            if PLAIN_KEY.fullmatch(key) and PLAIN_NUMBER.fullmatch(value):
                plain[key] = (text, json.loads(value))
        rest = tuple(text for text in overrides if text.partition("=")[0] not in plain)
        if rest not in bases:
            bases[rest] = (composed(site, rest), _refers(site))
        base, refers = bases[rest]
        config = copy.deepcopy(base)
        if _may_mean(refers, plain) or not all(_set_number(config, key, value) for key, (_, value) in plain.items()):
            config = composed(site, overrides)
        yield config


def expand_sweep(site: Site, overrides: Sequence[str]) -> list[list[str]]:
    """Every combination of sweep overrides (lists, ``range()``, ``choice()``, ``glob()``), in the order given."""
    from hydra.core.override_parser.types import Glob, Override

    choices: list[list[str]] = []
    for text, override in zip(overrides, _parse(list(overrides)), strict=True):
        assert isinstance(override, Override)
        if not override.is_sweep_override():
            choices.append([text])
            continue
        options = group_options(site, override.key_or_group)
        names = _sweep_values(override, options)
        head = text.partition("=")[0]
        values = [f"{head}={value}" for value in names]
        if not values and not options and isinstance(override.value(), Glob):
            key = override.key_or_group
            raise ConfigError(key, f"'{text}': glob() picks options of a group, and '{key}' is none; list the values")
        if not values:
            raise ConfigError(
                override.key_or_group, f"'{text}' names no value; available: {', '.join(options) or 'none'}"
            )
        choices.append(list(dict.fromkeys(values)))
    combinations: list[list[str]] = [[]]
    for values in choices:
        combinations = [[*before, value] for before in combinations for value in values]
    return combinations


def group_options(site: Site, group: str) -> list[str]:
    """The names that a configuration group offers on the search path."""
    return sorted({file.stem for folder in site.conf_folders for file in (folder / group).glob("*.yaml")})


def groups(site: Site) -> list[str]:
    """The configuration groups on the search path, nested ones by their path (``learn/workspace``)."""
    found = ((folder, file.parent) for folder in site.conf_folders for file in folder.rglob("*.yaml"))
    return sorted({place.relative_to(folder).as_posix() for folder, place in found if place != folder})


def _set_number(config: dict[str, Any], key: str, value: float) -> bool:
    """Set an existing number; False where ``key`` is anything else, so that composing tells what is wrong."""
    *parents, last = key.split(".")
    node: Any = config
    for part in parents:
        node = node.get(part) if isinstance(node, dict) else None
    if not isinstance(node, dict) or isinstance(node.get(last), bool) or not isinstance(node.get(last), int | float):
        return False
    node[last] = value
    return True


def depends_on_surroundings(site: Site, overrides: Sequence[str]) -> bool:
    """Whether a resolver such as ``${oc.env:NAME}`` may give another value next time although no file changed."""
    return any(RESOLVER.search(text) for text in (*overrides, *_texts(site)))


def _refers(site: Site) -> frozenset[str]:
    """What the interpolations of the configuration files on the search path name; "" where that is not plain."""
    found: set[str] = set()
    for text in _texts(site):
        names = REFERENCE.findall(text)
        found.update(name if PLAIN_KEY.fullmatch(name) else "" for name in names)
        if text.count("${") != len(names):  # nested
            found.add("")
    return frozenset(found)


def _may_mean(names: Collection[str], keys: Collection[str]) -> bool:
    """Whether an interpolation of one of ``names`` may read one of ``keys``."""
    return any(not name or key == name or key.startswith(f"{name}.") for name in names for key in keys)


def _texts(site: Site) -> Iterator[str]:
    for folder in site.conf_folders:
        for file in folder.rglob("*.yaml"):
            with contextlib.suppress(OSError):  # a dangling link
                yield file.read_text(encoding="utf-8", errors="replace")


def _sweep_values(override: Any, options: list[str]) -> list[str]:
    from hydra.core.override_parser.types import Glob

    if isinstance(override.value(), Glob):
        return list(override.value().filter(options))
    return list(override.sweep_string_iterator())


def _parse(overrides: list[str]) -> list[Any]:
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import OverrideParseException

    parsed = []
    for text in overrides:
        try:
            parsed += OverridesParser.create().parse_overrides([text])
        except OverrideParseException as error:
            if "=" not in text:
                raise ConfigError(
                    text, f"'{text}' is not an override; write KEY=VALUE, as in seed=1 or capture=file"
                ) from error
            key = text.partition("=")[0]
            raise ConfigError(
                key, f"'{text}' cannot be read as KEY=VALUE; quote a value with special characters: {key}='\"...\"'"
            ) from error
    return parsed


def _compose(site: Site, overrides: list[str]) -> dict[str, Any]:
    from hydra import compose, initialize_config_dir
    from hydra.errors import HydraException
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException
    from yaml import YAMLError

    from kendama_cli.config.search_path import further_folders

    names = groups(site)
    for text, override in zip(overrides, _parse(overrides), strict=True):
        if not override.key_or_group:
            raise ConfigError("", f"'{text}' has no key; write KEY=VALUE, as in seed=1 or capture=file")
        if override.is_sweep_override():
            raise ConfigError(
                override.key_or_group,
                f"'{text}' gives several values; use 'kendama sweep' for one run each, or [a,b] for a list",
            )
        if override.key_or_group.partition(".")[0].partition("/")[0] == "hydra":
            raise ConfigError(
                override.key_or_group, f"'{text}' would change Hydra itself, which kendama does not offer"
            )
        if override.key_or_group in names and not override.is_delete() and not isinstance(override.value(), str):
            key, options = override.key_or_group, ", ".join(group_options(site, override.key_or_group))
            raise ConfigError(key, f"'{text}' must name one choice of the group '{key}'; allowed: {options}")
    first, *others = site.conf_folders
    try:
        with further_folders(others), initialize_config_dir(str(first), job_name="kendama", version_base="1.3"):
            config = OmegaConf.to_container(compose("config", overrides=overrides), resolve=True)
    except (HydraException, OmegaConfBaseException, YAMLError, OSError, ValueError) as error:
        # ValueError: Hydra's own, for a defaults list of a wrong kind, and Python's, for a file that is not UTF-8
        raise _plain_error(site, overrides, error) from error
    assert isinstance(config, dict)
    return {str(key): value for key, value in config.items()}


def _plain_error(site: Site, overrides: list[str], error: Exception) -> ConfigError:
    """One line for whatever Hydra could not compose: the first override that does not fit, or Hydra's own words."""
    names = groups(site)
    choices = [item for item in _parse(overrides) if item.key_or_group in names and isinstance(item.value(), str)]
    for override in choices:
        options = group_options(site, override.key_or_group)
        if override.value() not in options:
            key = override.key_or_group
            return ConfigError(
                key,
                f"'{key}' is '{override.value()}'; allowed: {', '.join(options)}{nearest(override.value(), options)}",
            )
    valid = [item.input_line for item in choices]
    if len(valid) < len(overrides):
        config = _compose(site, [text for text in valid if text is not None])
        for override in _parse(overrides):
            problem = _missing(config, override.key_or_group, names)
            if problem is not None and not override.is_add() and not override.is_force_add():
                return problem
    return ConfigError("conf", "configuration: " + " ".join(str(error).split()))


def _missing(config: dict[str, Any], key: str, names: list[str]) -> ConfigError | None:
    """The error for the first part of ``key`` that ``config`` does not have; None where it has them all."""
    if "/" in key and key not in names:
        return ConfigError(key, f"unknown group '{key}'; available: {', '.join(names)}{nearest(key, names)}")
    node: Any = config
    walked = ""
    for part in key.split("."):
        path = f"{walked}.{part}" if walked else part
        if not isinstance(node, dict):
            return ConfigError(key, f"unknown key '{key}': '{walked}' is a value and has no keys below it")
        if part not in node and (walked or part not in names):
            return unknown_key(path, node)
        node, walked = node.get(part, {}), path
    return None


def _leaves(config: dict[str, Any], prefix: str = "") -> list[str]:
    found = []
    for name, value in config.items():
        path = f"{prefix}{name}"
        found += [path, *_leaves(value, f"{path}.")] if isinstance(value, dict) else [path]
    return found


def keys(site: Site) -> list[str]:
    """Every dotted key of the default configuration, for completion."""
    return _leaves(composed(site, []))
