"""Settings of a haptic device across the network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.devices.demonstrator.axes import Axes, to_ours
from kendama_cli.devices.streams.stream_server import StreamServer
from kendama_cli.schema.settings import setting
from kendama_cli.settings.game import GameSettings

USUAL_AXES: Mapping[str, Axes] = {"openigtlink": ("x", "y", "z"), "vrpn": ("x", "-z", "y")}


@dataclass(frozen=True)
class CouplingSettings:
    """A spring and damper between device and cup, and what the hand may feel at most."""

    stiffness_n_m: float = setting("spring between device and cup [N/m]", above=0)
    damping_n_s_m: float = setting("damper beside it [N s/m]; above stiffness times half a period", at_least=0)
    max_force_n: float = setting("largest force [N]", above=0)
    max_force_rate_n_s: float = setting("fastest rise of the force [N/s]", above=0)


@dataclass(frozen=True)
class HapticCapture(StreamServer):
    """A haptic device behind a server: the stylus moves the cup, the hand feels rope and ball."""

    live: ClassVar[bool] = True
    """A person swings for it: what was recorded is kept until someone asks for another recording."""

    kind: Literal["haptic"] = setting("a haptic device")
    game: GameSettings = setting("the game that is felt")
    coupling: CouplingSettings = setting("coupling of the stylus to the cup")
    device: str = setting(
        "name of the stylus' TRANSFORM there (its STRING is NAME-grip, our force goes to NAME-force), or of the "
        "VRPN device"
    )
    button: int = setting("VRPN: number of the button that is the dead-man's switch", at_least=0)
    axes: Axes | None = setting(
        "axes of the device that are our x, y and z (up); null: the usual ones, [x, y, z] or [x, -z, y] (VRPN)"
    )
    scale: float = setting("metres of the virtual hand per metre of the stylus", above=0)
    felt_fraction: float = setting("share of the force, scaled as the way is, that the stylus gives the hand", above=0)
    watchdog_s: float = setting("a longer silence of the device stops the force for good [s]", above=0.002)
    max_speed_m_s: float = setting("a virtual hand that moves faster is a fault of the device [m/s]", above=0)
    caught_s: float = setting("a ball that lies in the cup for this long is caught [s]", above=0)
    wait_s: float = setting("time to wait for a hand to grip the stylus [s]", above=0)
    swings: int = setting("number of demonstrations to record", at_least=1)
    record: str = setting("folder in which every swing is kept as it was made; nothing there is overwritten")

    def __post_init__(self) -> None:
        if self.axes is not None:
            to_ours(self.axes)

    @property
    def spoken_axes(self) -> Axes:
        """``axes``, or what the protocol's devices usually have: a Phantom's y points up, its z to the person."""
        return self.axes or USUAL_AXES[self.protocol]
