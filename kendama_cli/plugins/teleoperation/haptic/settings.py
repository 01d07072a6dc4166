"""Settings of a haptic device across the network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.devices.demonstrator.axes import Axes, to_ours
from kendama_cli.plugins.shared.streams.stream_server import StreamServer
from kendama_cli.schema.settings import setting
from kendama_cli.settings.game import GameSettings

USUAL_AXES: Mapping[str, Axes] = {"openigtlink": ("x", "y", "z"), "vrpn": ("x", "-z", "y")}


@dataclass(frozen=True)
class CouplingSettings:
    """A spring and damper between device and cup, and what the hand may feel at most."""

    stiffness_n_m: float = setting("Stiffness of the spring between device and cup [N/m].", above=0)
    damping_n_s_m: float = setting(
        "Damping between device and cup; it must exceed the stiffness times half a control period [N s/m].", at_least=0
    )
    max_force_n: float = setting("Maximum force on the hand [N].", above=0)
    max_force_rate_n_s: float = setting("Maximum rate at which the force rises [N/s].", above=0)


@dataclass(frozen=True)
class HapticCapture(StreamServer):
    """A haptic device behind a server: the stylus moves the cup, the hand feels rope and ball."""

    live: ClassVar[bool] = True
    """A person swings for it: what was recorded is kept until someone asks for another recording."""

    kind: Literal["haptic"] = setting("A haptic device moves the cup.")
    game: GameSettings = setting("Game that the hand feels.")
    coupling: CouplingSettings = setting("Coupling of the stylus to the cup.")
    device: str = setting(
        "Name of the stylus' TRANSFORM on the server, or of the VRPN device. Its STRING is NAME-grip; kendama's force "
        "goes to NAME-force."
    )
    button: int = setting("VRPN number of the button that is the dead-man's switch.", at_least=0)
    axes: Axes | None = setting(
        "Axes of the device that are kendama's x, y and z (up); null takes the usual ones, [x, y, z], or [x, -z, y] "
        "for VRPN."
    )
    scale: float = setting("The cup moves this many metres per metre of the stylus.", above=0)
    felt_fraction: float = setting(
        "Fraction of the game's force, scaled like the displacement, that the stylus exerts on the hand.", above=0
    )
    watchdog_s: float = setting(
        "The force stops for good when the device has been silent for longer than this [s].", above=0.002
    )
    max_speed_m_s: float = setting("A faster cup counts as a fault of the device [m/s].", above=0)
    caught_s: float = setting("The ball counts as caught when it has been in the cup for this long [s].", above=0)
    wait_s: float = setting("Time to wait for a hand to grip the stylus [s].", above=0)
    swings: int = setting("Number of demonstrations to record.", at_least=1)
    record: str = setting("Folder in which every swing is stored as recorded; nothing there is overwritten.")

    def __post_init__(self) -> None:
        if self.axes is not None:
            to_ours(self.axes)

    @property
    def spoken_axes(self) -> Axes:
        """``axes``, or what the protocol's devices usually have: a Phantom's y points up, its z to the person."""
        return self.axes or USUAL_AXES[self.protocol]
