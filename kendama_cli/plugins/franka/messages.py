"""Messages of the pipe to the process that moves an arm: one dataclass of these as JSON, never a pickle."""

from __future__ import annotations

import dataclasses
import json
import typing
from dataclasses import dataclass

import numpy as np

from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.plugins.franka.rate_limit import RateLimits
from kendama_cli.plugins.franka.settings import FrankaHardware
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build


@dataclass(frozen=True)
class Begin:
    """The first that is said to the process: which arm, and within which limits."""

    hardware: FrankaHardware
    limits: RateLimits


@dataclass(frozen=True)
class Recover:
    """Have the controller leave its reflex."""


@dataclass(frozen=True)
class Wanted:
    """Desired joint positions at the end of a control period, and velocities (n,)."""

    position_rad: Array
    velocity_rad_s: Array


@dataclass(frozen=True)
class Stands:
    """Joint positions (n,) of an arm that is opened, or has recovered."""

    position_rad: Array


@dataclass(frozen=True)
class Done:
    """One control period: what was sent last (n,), what was measured after it, how many periods there were so far."""

    sent_rad: Array
    sent_rad_s: Array
    sent_rad_s2: Array
    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array
    external_nm: Array
    wrench: Array
    periods: int


@dataclass(frozen=True)
class Failure:
    """One line, the last that is said from there."""

    problem: str


Message = Begin | Recover | Wanted | Stands | Done | Failure
_KINDS: dict[str, type] = {kind.__name__: kind for kind in typing.get_args(Message)}


def encode(message: Message) -> bytes:
    """Encode one message: the name of its class and its fields; numbers survive to the last bit."""
    fields = {field.name: _plain(getattr(message, field.name)) for field in dataclasses.fields(message)}
    return json.dumps([type(message).__name__, fields]).encode()


def decode(data: bytes) -> Message:
    """Decode the message in ``data``; raises HardwareError for other bytes."""
    try:
        name, fields = json.loads(data)
        message: Message = _built(_KINDS[name], fields)
    except (ValueError, TypeError, LookupError, ConfigError) as error:
        problem = " ".join(f"{type(error).__name__}: {error}".split())
        raise HardwareError(f"the pipe to the process that moves the arm said what is no message ({problem})") from None
    return message


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return value


def _built(kind: type, fields: dict[str, object]) -> typing.Any:
    if kind is Begin:
        return Begin(build(FrankaHardware, fields["hardware"], "hardware"), _built(RateLimits, fields["limits"]))  # type: ignore[arg-type]
    values = {name: np.array(value, float) if isinstance(value, list) else value for name, value in fields.items()}
    return kind(**values)
