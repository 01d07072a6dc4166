"""Many configurations at once: the combinations that a sweep's overrides span, and each of them composed."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, configuration_files, group_options
from kendama_cli.errors import ConfigError
from kendama_cli.schema.hints import listed
from kendama_cli.schema.plain_yaml import scalars

PLAIN_KEY = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
PLAIN_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?")
REFERENCE = re.compile(r"\$\{([^{}]*)\}")


def composed_each(site: Site, combinations: Sequence[Sequence[str]]) -> Iterator[dict[str, Any]]:
    """Return ``composed`` for each of many override lists that differ in few values, as a sweep's do.

    Composing costs a tenth of a second; so what remains of a list without its plain ``KEY=NUMBER`` overrides is
    composed once, and these are set in the result; what does not differ is one object in all. Values that others refer
    to (``${...}``) are composed in full.
    """
    bases: dict[tuple[str, ...], dict[str, Any]] = {}
    references: dict[tuple[str, ...], frozenset[str]] = {}
    in_files: frozenset[str] | None = None
    for overrides in combinations:
        if in_files is None:
            in_files = _references(text for file in configuration_files(site) for text in scalars(file))
        plain = {}
        for text in overrides:
            key, _, value = text.partition("=")
            if PLAIN_KEY.fullmatch(key) and PLAIN_NUMBER.fullmatch(value):
                plain[key] = (text, json.loads(value))
        rest = tuple(text for text in overrides if text.partition("=")[0] not in plain)
        if rest not in bases:
            bases[rest] = composed(site, rest)
        config: dict[str, Any] | None = bases[rest]
        refers = in_files | references.setdefault(rest, _references(rest))
        if _may_mean(refers, plain):
            config = None
        for key, (_, value) in plain.items():
            config = None if config is None else _with_number(config, key.split("."), value)
        yield composed(site, overrides) if config is None else config


def expand_sweep(site: Site, overrides: Sequence[str]) -> list[list[str]]:
    """Return every combination of sweep overrides (lists, ``range()``, ``choice()``, ``glob()``), in the order
    given.
    """
    from hydra.core.override_parser.types import Glob, Override  # noqa: PLC0415 - as in compose

    from kendama_cli.config.hydra_compose import parse_overrides  # noqa: PLC0415
    from kendama_cli.config.typed import as_meant  # noqa: PLC0415

    choices: list[list[str]] = []
    overrides = as_meant(site, overrides)
    for text, override in zip(overrides, parse_overrides(overrides), strict=True):
        assert isinstance(override, Override)
        if not override.is_sweep_override():
            choices.append([text])
            continue
        options = group_options(site, override.key_or_group)
        chosen = override.value()
        by_glob = isinstance(chosen, Glob)
        names = chosen.filter(options) if isinstance(chosen, Glob) else override.sweep_string_iterator()
        values = [f"{text.partition('=')[0]}={value}" for value in names]
        key = override.key_or_group
        if not values and not options and by_glob:
            raise ConfigError(key, f"'{text}': glob() picks options of a group, and '{key}' is none; list the values")
        if not values:
            raise ConfigError(key, listed(f"'{text}' names no value", "", options, "available"))
        choices.append(list(dict.fromkeys(values)))
    combinations: list[list[str]] = [[]]
    for values in choices:
        combinations = [[*before, value] for before in combinations for value in values]
    return combinations


def _with_number(node: Any, path: Sequence[str], value: float) -> dict[str, Any] | None:
    """Return ``node`` with another number at ``path``, and all else the same objects.

    None where there is anything else than a number, so that composing reports what is wrong.
    """
    inner = node.get(path[0]) if isinstance(node, dict) else None
    if len(path) > 1:
        changed = _with_number(inner, path[1:], value)
        return None if changed is None else {**node, path[0]: changed}
    if isinstance(inner, bool) or not isinstance(inner, int | float):
        return None
    return {**node, path[0]: value}


def _references(texts: Iterable[str]) -> frozenset[str]:
    """Return the keys that the interpolations in ``texts`` name; "" for a name that is not plain."""
    found: set[str] = set()
    for text in texts:
        names = REFERENCE.findall(text)
        found.update(name if PLAIN_KEY.fullmatch(name) else "" for name in names)
        if text.count("${") != len(names):  # nested
            found.add("")
    return frozenset(found)


def _may_mean(names: Collection[str], keys: Collection[str]) -> bool:
    """Return True if an interpolation of one of ``names`` may read one of ``keys``."""
    return any(not name or key == name or key.startswith(f"{name}.") for name in names for key in keys)
