"""Configuration from ``conf/`` and overrides, remembered so that a run with little to do never loads Hydra.

The result is stored under the overrides, with the state of every file on the search path and the value of every
environment variable that an interpolation read; where any of these differs, it is composed again. Validation by the
settings' schema follows in any case. ``setup=FILE`` is not Hydra's: see ``laboratory``.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from kendama_cli.config.site import Site, configuration_files
from kendama_cli.errors import ConfigError, StoreError
from kendama_cli.pipeline.command_cache import Stamps, environment_now, settled, stamps
from kendama_cli.store import durable
from kendama_cli.store.home import claim


@dataclass(frozen=True)
class Composition:
    """A plain configuration, and the environment variables that its interpolations read (None: not set)."""

    config: dict[str, Any]
    environment: dict[str, str | None]
    looked: Stamps = field(default_factory=dict)
    """The state of ``setup=FILE``, and of where it was looked for."""


def composed(site: Site, overrides: Sequence[str]) -> dict[str, Any]:
    """Return the plain configuration for ``overrides``; raises ConfigError if it does not compose."""
    return composition(site, overrides).config


def composition(site: Site, overrides: Sequence[str]) -> Composition:
    """Return the configuration for ``overrides`` with the files and variables read; raises ConfigError if it does
    not compose.
    """
    for text in overrides:
        if not durable.is_text(text):
            key = text.partition("=")[0]
            raise ConfigError(key, f"{text!a} is not UTF-8 text; rename the file or folder that it names")
    began_s = time.time()
    looked = _looked(site, overrides)
    states = {**stamps(configuration_files(site)), **looked}
    question = {"overrides": list(overrides), "folders": [str(folder) for folder in site.conf_folders]}
    path = site.home / "index" / "composed" / f"{durable.sha256(durable.canonical_json(question))[:32]}.json"
    known = durable.read_index(path)
    if known is not None and (known["question"], known["stamps"]) == (question, states):
        config = {node: known["config"][node] for node in known["nodes"]}  # checked in this order
        found = Composition(config, known["environment"], looked)
        if environment_now(found.environment) == found.environment:
            return found
    from kendama_cli.config.hydra_compose import compose_with_hydra  # noqa: PLC0415 - a quarter of a second
    from kendama_cli.config.laboratory import with_setup  # noqa: PLC0415 - reads YAML

    made = Composition(*with_setup(site, list(overrides), compose_with_hydra), looked)
    with contextlib.suppress(StoreError):  # a home that cannot be written does without
        claim(site.home)
    if settled(states, began_s):
        kept = {"config": made.config, "nodes": list(made.config), "environment": made.environment}
        durable.write_index(path, {"question": question, "stamps": states, **kept})
    return made


def _looked(site: Site, overrides: Sequence[str]) -> Stamps:
    """Return the state of the file that ``setup=FILE`` names, and of the locations that are searched for it."""
    named = [text.partition("=")[2] for text in overrides if text.startswith("setup=")]
    if not named:
        return {}
    from kendama_cli.pipeline.watched import looked_at  # noqa: PLC0415 - imports the planner

    return stamps(looked_at(named[-1].strip("'\""), site.data_roots))


def keys(site: Site) -> list[str]:
    """Return every dotted key of the default configuration, for completion."""
    return _leaves(composed(site, []))


def _leaves(config: dict[str, Any], prefix: str = "") -> list[str]:
    found = []
    for name, value in config.items():
        path = f"{prefix}{name}"
        found += [path, *_leaves(value, f"{path}.")] if isinstance(value, dict) else [path]
    return found
