"""A movement primitive as JSON or YAML text, and back: every number returns to the last bit."""

from __future__ import annotations

import dataclasses
import json
from typing import Any, Literal

import numpy as np
import yaml

from kendama_cli.artifacts.motion_plan import MotionPlan, TurnPlan
from kendama_cli.schema.plain_yaml import load_yaml

FORMAT = "kendama motion 1"
TextFormat = Literal["json", "yaml"]

_HEAD = """\
# A movement primitive (equations.md eq. 3-5); kendama run -p reuse encode.plan=THIS_FILE plays it.
# Positions in m relative to the start; weights: one row per coordinate; variation: how the demonstrations differed.
"""


def plan_text(plan: MotionPlan, form: TextFormat) -> str:
    """Return ``plan`` as text in ``form``."""
    document: dict[str, Any] = {"format": FORMAT}
    document |= {field.name: _plain(getattr(plan, field.name)) for field in dataclasses.fields(plan)}
    if plan.turn is None:
        del document["turn"]
    if form == "json":
        return json.dumps(document, indent=1, allow_nan=False) + "\n"
    return _HEAD + yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=120)


def plan_from_text(text: str, form: TextFormat) -> MotionPlan:
    """Parse the plan in ``text``; raises ValueError that names the line or the key that is wrong."""
    try:
        document = json.loads(text) if form == "json" else load_yaml(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"line {error.lineno}: not JSON ({error.msg})") from None
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        found = document.get("format") if isinstance(document, dict) else type(document).__name__
        raise ValueError(f"no movement primitive: its 'format' is {found!r}, not '{FORMAT}'")
    names = [field.name for field in dataclasses.fields(MotionPlan)]
    missing = [name for name in names if name not in document and name != "turn"]
    unknown = [key for key in document if key not in names and key != "format"]
    if missing or unknown:
        raise ValueError(f"the key '{missing[0]}' is missing" if missing else f"unknown key '{unknown[0]}'")
    rotation = _turn(document["turn"], document) if "turn" in document else None
    values = {name: _value(name, document[name], document) for name in names if name != "turn"}
    return MotionPlan(**values, turn=rotation)


def _plain(value: Any) -> Any:
    if isinstance(value, TurnPlan):
        return {field.name: getattr(value, field.name).tolist() for field in dataclasses.fields(value)}
    return value.tolist() if isinstance(value, np.ndarray) else list(value) if isinstance(value, tuple) else value


def _turn(value: Any, document: dict[str, Any]) -> TurnPlan:
    names = [field.name for field in dataclasses.fields(TurnPlan)]
    if not isinstance(value, dict) or sorted(value) != sorted(names):
        raise ValueError(f"'turn' must hold {', '.join(names)}, and nothing else")
    return TurnPlan(**{name: _value(f"turn.{name}", value[name], document) for name in names})


def _value(name: str, value: Any, document: dict[str, Any]) -> Any:
    if name == "coordinates":
        if not isinstance(value, list) or not value or not all(isinstance(item, str) for item in value):
            raise ValueError(f"'{name}' must be a list of names such as [x, y, z], not {value!r}")
        return tuple(value)
    try:
        made = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"'{name}' must hold numbers in rows of equal length") from None
    if name == "variation" and not made.size:
        # text cannot tell how wide no rows are
        weights = np.shape(document["weights"])
        return np.zeros((0, 1 + len(document["coordinates"]) * (3 + (weights[1] if len(weights) == 2 else 0))))
    if name in ("duration_s", "tau_scale", "stiffness", "phase_decay"):
        if made.ndim or isinstance(value, bool):
            raise ValueError(f"'{name}' must be a number, not {value!r}")
        return float(made)
    return made
