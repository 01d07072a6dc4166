"""Motions: the movement primitive, and the joint motion that carries it out."""

from __future__ import annotations

import math
import typing
from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, rising, set_arrays
from kendama_cli.settings.placement import Placement


@dataclass(frozen=True)
class TurnPlan:
    """Rotation of the cup during a motion: rotation vectors from upright, on the motion's own basis and duration.

    Arrays are (3,) in rad and rad/s as those of ``MotionPlan`` in m, ``weights`` (3, m).
    """

    start_rad: Array
    start_velocity_rad_s: Array
    goal_rad: Array
    goal_velocity_rad_s: Array
    weights: Array

    def __post_init__(self) -> None:
        set_arrays(self, start_rad=(3,), start_velocity_rad_s=(3,), goal_rad=(3,), goal_velocity_rad_s=(3,))
        set_arrays(self, weights=(3, None))


@dataclass(frozen=True)
class MotionPlan:
    """A dynamic movement primitive of c coordinates with m basis functions (equations.md eq. 3-5).

    K = ``stiffness``, D = 2 sqrt K, alpha = ``phase_decay``; ``duration_s`` (T) is the demonstration's length, and
    the motion played lasts tau = ``tau_scale`` T. Positions are relative to the start of the swing; where a coordinate
    is a rotation, read rad for m.
    """

    coordinates: tuple[str, ...]
    duration_s: float
    tau_scale: float
    stiffness: float
    phase_decay: float
    start_m: Array
    """(c,)"""
    start_velocity_m_s: Array
    """(c,) at tau_scale 1"""
    goal_m: Array
    """(c,) where the motion is at tau"""
    goal_velocity_m_s: Array
    """(c,) how fast it passes its goal, at tau_scale 1; zero for a motion that ends at rest"""
    weights: Array
    """(c, m)"""
    centers: Array
    """(m,) in phase x, falling from 1"""
    widths: Array
    """(m,) s_j of eq. 5"""
    variation: Array
    """(r, 1 + c (3 + m)) V, so that V^T V is the covariance of the parameters over the demonstrations; no rows where
    there was one. Columns: log T, then start rate, goal - start and goal rate (a rate is velocity x T), then the
    weights of the first coordinate, of the second, ..."""
    turn: TurnPlan | None = None
    """None where the demonstrations have no orientation: the cup stays upright."""

    def __post_init__(self) -> None:
        set_arrays(self, centers=(None,))
        c, m = len(self.coordinates), len(self.centers)
        set_arrays(self, start_m=(c,), start_velocity_m_s=(c,), goal_m=(c,), goal_velocity_m_s=(c,))
        set_arrays(self, weights=(c, m), widths=(m,), variation=(None, 1 + c * (3 + m)))
        for name in ("duration_s", "tau_scale", "stiffness", "phase_decay"):
            if not 0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, not {getattr(self, name)!r}")
        if self.turn is not None and self.turn.weights.shape[1] != m:
            raise ValueError(f"the rotation has weights of {self.turn.weights.shape[1]} functions, the motion has {m}")
        if not (self.widths > 0).all():
            raise ValueError(f"widths must be positive; the smallest is {self.widths.min():g}")

    @property
    def n_parameters(self) -> int:
        """Goal, duration and weights of one coordinate: the paper's 22 for 20 basis functions."""
        return len(self.centers) + 2


def holds_primitive(artifact: type) -> bool:
    """Return True if artifacts of this type are a primitive, or carry one as ``plan``."""
    return artifact is MotionPlan or typing.get_type_hints(artifact).get("plan") is MotionPlan


def primitive_of(artifact: typing.Any) -> MotionPlan:
    """Return the primitive that an artifact of which ``holds_primitive`` is true is or carries."""
    plan: MotionPlan = artifact if isinstance(artifact, MotionPlan) else artifact.plan
    return plan


@dataclass(frozen=True)
class JointTrajectory:
    """A sampled joint motion: ``t_s`` (n,), and positions, velocities, accelerations (n, joints) in rad and seconds."""

    joint_names: tuple[str, ...]
    t_s: Array
    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "t_s", rising("t_s", self.t_s))
        shape = (len(self.t_s), len(self.joint_names))
        set_arrays(self, position_rad=shape, velocity_rad_s=shape, acceleration_rad_s2=shape)


@dataclass(frozen=True)
class CatchMotion:
    """The adapted primitive and the arm's motion for it: the input of the hardware.

    ``placement`` is where the arm stands and how it holds the cup for it. ``success_rate`` is that of the perturbed
    repeats in simulation, None where nothing was repeated; ``caught`` is the nominal outcome. ``flight_start_s`` is
    when the rope slackens for the catch in the simulated motion, None where it never did.
    """

    plan: MotionPlan
    joints: JointTrajectory
    placement: Placement
    caught: bool
    success_rate: float | None
    flight_start_s: float | None = None
