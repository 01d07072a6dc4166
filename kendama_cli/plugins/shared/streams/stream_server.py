"""A server of poses across the network: its protocol, address and unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting
from kendama_cli.schema.units import LengthUnit

USUAL_PORT: Mapping[str, int] = {"openigtlink": 18944, "vrpn": 3883}
USUAL_UNIT: Mapping[str, LengthUnit] = {"openigtlink": "mm", "vrpn": "m"}
"""Defaults of a protocol's servers."""


@dataclass(frozen=True)
class StreamServer:
    """A server that streams poses, by OpenIGTLink or VRPN."""

    protocol: Literal["openigtlink", "vrpn"] = setting("Protocol of the server.")
    host: str = setting("Address of the server.")
    port: int | None = setting(
        "TCP port of the server; null takes the usual one, 18944 (OpenIGTLink) or 3883 (VRPN).",
        at_least=1,
        at_most=65535,
    )
    unit: LengthUnit | None = setting(
        "Unit of the positions that the server sends; null takes the usual one, mm (OpenIGTLink) or m (VRPN)."
    )

    @property
    def spoken_port(self) -> int:
        """``port``, or the protocol's usual one."""
        return self.port or USUAL_PORT[self.protocol]

    @property
    def spoken_unit(self) -> LengthUnit:
        """``unit``, or the protocol's usual one."""
        return self.unit or USUAL_UNIT[self.protocol]
