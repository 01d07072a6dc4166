"""``setup=FILE``: measured values of a laboratory replace those of the configuration.

So it enters the key of every stage that reads such a value, and of no other.
"""

from __future__ import annotations

import copy
import dataclasses
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.config.hydra_compose import Environment
from kendama_cli.config.site import Site
from kendama_cli.errors import ConfigError
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.settings import build
from kendama_cli.settings.setup import SIGMAS_95, LaboratorySetup

KEY = "setup"
MEASURE = "'kendama setup', 'kendama camera latency', 'kendama camera place' and 'kendama capture pivot' write one"


def parted(overrides: Sequence[str]) -> tuple[str | None, list[str]]:
    """Split ``setup=FILE`` from the other overrides; the file is None if it is not named or null."""
    named = [text.partition("=")[2] for text in overrides if text.partition("=")[0] == KEY]
    others = [text for text in overrides if text.partition("=")[0] != KEY]
    name = named[-1].strip("'\"") if named else "null"
    if not name:
        raise ConfigError(KEY, f"'{KEY}' names no file; write {KEY}=setup.yaml ({MEASURE})")
    return (None if name == "null" else name), others


def find_setup(site: Site, name: str) -> Path:
    """Return the file ``name``, below the data folders if it is relative; raises ConfigError if there is none."""
    path = Path(os.path.expanduser(name))
    found = next((one for root in site.data_roots if (one := root / path).is_file()), None)
    if found is None:
        looked = "" if path.is_absolute() else f" (looked in {', '.join(map(str, site.data_roots))})"
        raise ConfigError(KEY, f"{KEY}: no such file '{name}'{looked}; {MEASURE}")
    return found


def read_setup(path: Path) -> LaboratorySetup:
    """Read the setup in a file, in which unmeasured values may be absent; raises ConfigError if it is none."""
    try:
        content = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ConfigError(KEY, f"{path}: it cannot be read ({reason}); {MEASURE}") from None
    if not isinstance(content, dict):
        raise ConfigError(KEY, f"{path}: it holds no group of measured values; {MEASURE}")
    empty = dict.fromkeys((field.name for field in dataclasses.fields(LaboratorySetup)), None)
    try:
        return build(LaboratorySetup, {**empty, **content})
    except ConfigError as error:
        raise ConfigError(KEY, f"{path}: {error}") from None


def with_setup(
    site: Site, overrides: list[str], compose: Callable[[Site, list[str]], tuple[dict[str, Any], Environment]]
) -> tuple[dict[str, Any], Environment]:
    """Return the result of ``compose`` for all ``overrides`` but ``setup=FILE``, with the measured values of that
    file.
    """
    name, others = parted(overrides)
    if name is None:
        return compose(site, others)
    setup = read_setup(find_setup(site, name))
    config, environment = compose(site, others)
    return applied(config, setup, others), environment


def applied(config: Mapping[str, Any], setup: LaboratorySetup, overrides: Sequence[str]) -> dict[str, Any]:
    """Return ``config`` with the measured values; values that ``overrides`` set, and keys that it does not have,
    stay.
    """
    made: dict[str, Any] = copy.deepcopy(dict(config))
    said = [text.partition("=")[0].lstrip("+~").partition("@")[0].replace("/", ".") for text in overrides]
    for key, value in measured_values(setup, config).items():
        if not any(_about(key, one) for one in said):
            _put(made, key, value)
    return made


def measured_values(setup: LaboratorySetup, config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of ``setup`` by the dotted key of the configuration that each is for.

    A +- in the configuration, from which perturbed simulations are sampled, is the measurement's interval of
    95 %. Measured positions are those of real cameras; rendered ones are where their rig has them.
    """
    values: dict[str, Any] = {}
    if setup.rope_m is not None:
        values["game.rope.length_m"] = setup.rope_m.value
        values["adapt.uncertainty.rope_m"] = SIGMAS_95 * setup.rope_m.sigma
    if (drag := setup.drag) is not None:
        coefficients = {"linear_n_s_m": drag.linear_n_s_m, "quadratic_n_s2_m2": drag.quadratic_n_s2_m2}
        values["game.air"] = {"kind": "measured", **coefficients}
        spread = math.exp(SIGMAS_95 * drag.sigma_at_3_m_s / drag.at_3_m_s)
        values["adapt.uncertainty.drag_scale"] = [1 / spread, spread]
    if (delay := setup.camera_delay_s) is not None:
        values["camera.latency_s"] = delay.value
        finding_s = _get(config, "transfer.observation.processing_s") or 0.0
        values["adapt.sensor_model.latency_s"] = delay.value + finding_s
    for name in ("marker_to_cup_m", "body_to_cup_m"):
        if (offset := getattr(setup, name)) is not None:
            values[f"capture.{name}"] = list(offset.value)
    if setup.cameras is not None and _get(config, "camera.sensor") is None:  # a rendered one has a sensor
        values["camera.cameras"] = [dataclasses.asdict(one.camera) for one in setup.cameras]
        values["camera.calibration"] = None
        values["transfer.observation.camera_origin"] = "world"
    return values


def _about(key: str, said: str) -> bool:
    """Return True if an override of ``said`` names ``key``, a part of it, or a group that contains it.

    A choice of a whole node (``camera=device``) does not.
    """
    return said == key or said.startswith(f"{key}.") or ("." in said and key.startswith(f"{said}."))


def _get(config: Mapping[str, Any], key: str) -> Any:
    node: Any = config
    for part in key.split("."):
        node = node.get(part) if isinstance(node, Mapping) else None
    return node


def _put(config: dict[str, Any], key: str, value: Any) -> None:
    """Set ``key`` where the configuration has it."""
    parent, _, name = key.rpartition(".")
    node = _get(config, parent)
    if isinstance(node, dict) and name in node:
        node[name] = value
