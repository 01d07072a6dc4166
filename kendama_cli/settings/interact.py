"""Settings of an arm in a scene: its tool, the script that it plays, and the controller in task space that plays it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import ChosenSettings, Registry
from kendama_cli.schema.settings import setting
from kendama_cli.settings.scene import SceneSettings


@dataclass(frozen=True)
class ProbeSettings:
    """A rod with a ball at its end, held where the robot holds its tool; its centre is the controlled point."""

    radius_m: float = setting("Radius of the probe's ball [m].", above=0)
    mass_kg: float = setting("Mass of the probe, at the ball's centre [kg].", above=0)
    friction: float = setting(
        "Coefficient of Coulomb friction; a contact has the smaller one of its two bodies.", at_least=0
    )
    restitution: float = setting(
        "Coefficient of restitution; a contact has the product of those of its two bodies.", at_least=0, at_most=1
    )


CONTROLLERS = Registry("kendama.controllers", "controller")


ControllerSettings = Annotated[ChosenSettings, CONTROLLERS]
"""The node ``interact.controller``: settings of any registered controller."""


@dataclass(frozen=True)
class StepSettings:
    """One step of the script: desired pose and force at its end, reached smoothly from those of the previous step."""

    name: str = setting("Name of the step in messages, logs and the report.")
    duration_s: float = setting("Duration of the step [s].", above=0)
    position_m: tuple[float, float, float] = setting(
        "Desired position of the tool in the world at the end of the step [m]."
    )
    rotation_rad: tuple[float, float, float] = setting(
        "Desired rotation of the tool at the end of the step, as a rotation vector in the world from its orientation "
        "at home [rad]."
    )
    force_n: tuple[float, float, float] = setting(
        "Desired force of the tool on the scene at the end of the step, in the world [N]."
    )


@dataclass(frozen=True)
class InteractSettings:
    """A script of poses and forces that the tool plays in a scene."""

    controller: ControllerSettings
    probe: ProbeSettings
    script: tuple[StepSettings, ...] = setting("Steps that run one after the other, starting from rest at home.")
    max_error_m: float = setting(
        "The run stops when the tool is farther than this from its reference, perpendicular to a desired force [m].",
        above=0,
    )
    sensor_hz: float = setting("Bandwidth of the first-order filter on the force measured at the wrist [Hz].", above=0)
    gravity_m_s2: float = setting("Gravitational acceleration, along -z of the world [m/s^2].", at_least=0)
    log_rate_hz: float = setting("Rate at which states are logged [Hz].", above=0, at_most=1000)

    def __post_init__(self) -> None:
        if not self.script:
            raise ConfigError("script", "'script' is empty; allowed: one step or more")


@dataclass(frozen=True)
class InteractionTask:
    """A script and the scene that it is played in: what a simulated robot must know to hold the probe there."""

    interact: InteractSettings
    scene: SceneSettings
