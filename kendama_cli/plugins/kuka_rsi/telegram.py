"""The XML telegrams of KUKA RSI: what the controller sends every cycle, and what it is answered."""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from kendama_cli.errors import HardwareError
from kendama_cli.schema.arrays import Array

LARGEST_BYTES = 8192
_HALF = 1 << 31
AXES = ("A1", "A2", "A3", "A4", "A5", "A6")


class TelegramError(HardwareError):
    """A telegram of the controller that is none, or tells what cannot be."""


@dataclass(frozen=True)
class Telegram:
    """One cycle: its time stamp ``ipoc`` [ms], the axes' angles (6,) [deg], how many answers came too late so far."""

    ipoc: int
    position_deg: Array
    late: int


def ahead_ms(later: int, earlier: int) -> int:
    """Return how far one time stamp is after another [ms]; they have 32 bits and begin anew at 0 after 50 days."""
    return (later - earlier + _HALF) % (2 * _HALF) - _HALF


def read_telegram(data: bytes) -> Telegram:
    """Read the controller's telegram in ``data``; raises TelegramError that names what is missing or wrong."""
    if len(data) > LARGEST_BYTES or b"<!" in data:  # no document type, so no entities
        raise TelegramError(f"a telegram of {len(data)} bytes came that is none of RSI's")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise TelegramError(f"a telegram came that is no XML: {error}") from None
    place = root.find("AIPos")
    if root.tag != "Rob" or place is None:
        raise TelegramError(
            "the controller's telegrams have no <AIPos>: load examples/rsi/kendama_rsi.xml on it (DEF_AIPos)"
        )
    try:
        ipoc = int(root.findtext("IPOC", ""))
        position = [float(place.attrib[axis]) for axis in AXES]
        delay = root.find("Delay")
        late = 0 if delay is None else int(float(delay.attrib.get("D", "0")))
    except (KeyError, ValueError, OverflowError) as error:
        raise TelegramError(f"the controller's telegram has a value that is none: {error}") from None
    if not all(map(math.isfinite, position)):
        raise TelegramError(f"the controller says that its axes are at {position} degrees")
    return Telegram(ipoc, np.array(position), late)


def write_answer(sentype: str, correction_deg: Array, ipoc: int) -> bytes:
    """Write the answer to the telegram of time stamp ``ipoc``: each axis's displacement since RSI began (6,) [deg]."""
    values = " ".join(f'{axis}="{value:.7f}"' for axis, value in zip(AXES, correction_deg.tolist(), strict=True))
    return f'<Sen Type="{sentype}"><AKorr {values}/><IPOC>{ipoc}</IPOC></Sen>'.encode()
