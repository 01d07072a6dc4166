"""Settings of an arm in a scene: its tool, the script that it plays, and the controller in task space that plays it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import ChosenSettings, Registry
from kendama_cli.schema.settings import setting

if TYPE_CHECKING:  # numpy
    from kendama_cli.plugins.interact.interface import TaskController


@dataclass(frozen=True)
class TaskSpaceGains:
    """Springs and dampers of the tool, and of the posture that it leaves free."""

    stiffness_n_m: tuple[float, float, float] = setting(
        "Stiffness of the tool against displacement along x, y and z of the world [N/m].", above=0
    )
    stiffness_nm_rad: float = setting("Stiffness of the tool against rotation about every axis [Nm/rad].", above=0)
    spin: Literal["held", "free"] = setting(
        "Rotation about the tool's own axis: 'held' by a spring, or 'free', as a round tool allows."
    )
    damping_ratio: float = setting("Damping ratio of every mode of the tool; 1 is critical.", above=0)
    posture_1_s2: float = setting(
        "Stiffness, per inertia, that holds the arm's posture where the tool leaves it free [1/s^2].", at_least=0
    )


@dataclass(frozen=True)
class ImpedanceControl(TaskSpaceGains):
    """The tool behaves as a mass on springs; a desired force is fed forward and adds to the springs' force."""

    kind: Literal["impedance"] = setting("Springs act in every direction.")


@dataclass(frozen=True)
class ForceControl(TaskSpaceGains):
    """Impedance control, but along a desired force no spring acts: the measured force is controlled to it."""

    kind: Literal["force"] = setting("The force is controlled where one is desired; springs act elsewhere.")
    integral_1_s: float = setting("Integral gain on the force error [1/s].", at_least=0)
    reach_m: float = setting(
        "Along a desired force no spring acts until the tool is this far from its reference [m].", above=0
    )


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


def make_controller(settings: ControllerSettings) -> TaskController:
    """Return the controller of the kind that ``settings`` choose."""
    made: TaskController = CONTROLLERS.maker(settings.kind)(settings)
    return made
