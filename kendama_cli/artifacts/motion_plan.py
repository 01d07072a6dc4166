"""Motions: the movement primitive, and the joint motion that carries it out."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.artifacts.checks import Array, array, rising


@dataclass(frozen=True)
class MotionPlan:
    """A dynamic movement primitive of c coordinates with m basis functions (PAPER.md eq. 3-5).

    K = ``stiffness``, D = 2 sqrt K, alpha = ``phase_decay``; ``duration_s`` (T) is the demonstration's length, and
    the motion played lasts tau = ``tau_scale`` T. Positions are relative to the start of the swing.
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
    """(c,)"""
    weights: Array
    """(c, m)"""
    centers: Array
    """(m,) in phase x, falling from 1"""
    widths: Array
    """(m,) s_j of eq. 5"""

    def __post_init__(self) -> None:
        c = len(self.coordinates)
        object.__setattr__(self, "centers", array("centers", self.centers, (None,)))
        m = len(self.centers)
        for name, shape in (
            ("start_m", (c,)),
            ("start_velocity_m_s", (c,)),
            ("goal_m", (c,)),
            ("weights", (c, m)),
            ("widths", (m,)),
        ):
            object.__setattr__(self, name, array(name, getattr(self, name), shape))
        for name in ("duration_s", "tau_scale", "stiffness", "phase_decay"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)!r}")

    @property
    def n_parameters(self) -> int:
        """Goal, duration and weights of one coordinate: the paper's 22 for 20 basis functions."""
        return len(self.centers) + 2


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
        for name in ("position_rad", "velocity_rad_s", "acceleration_rad_s2"):
            object.__setattr__(self, name, array(name, getattr(self, name), shape))


@dataclass(frozen=True)
class CatchMotion:
    """The adapted primitive and the arm's motion for it: what the hardware is handed.

    ``success_rate`` is that of the perturbed repeats in simulation; ``caught`` is the nominal outcome.
    """

    plan: MotionPlan
    joints: JointTrajectory
    caught: bool
    success_rate: float
