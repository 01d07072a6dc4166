"""Messages that adapt logs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import ReplayMessage
from kendama_cli.schema.foxglove import FrameTransform, FrameTransforms, JointStates, SceneUpdate


@dataclass(frozen=True)
class AdaptRolloutMessage:
    """One rollout of a variation of the motion; ``signed_miss_m`` is nan where the ball never came down.

    ``caught_later`` is a ball that came into the cup off the rim, or on a descent after the planned catch.
    """

    index: int
    tau_scale: float
    signed_miss_m: float
    caught: bool
    amplitude: float
    shift_x_m: float
    shift_y_m: float
    caught_later: bool = False


@dataclass(frozen=True)
class AdaptExploredMessage:
    """One rollout of a policy search: ``cost_m`` is its cost, ``miss_m`` nan if the ball never came down.

    The goal was moved by ``shift_x_m`` and ``shift_y_m``; ``bumps_m`` are the bumps' heights, those along x first; the
    rope hung slack for ``swing_slack_s`` in the swing.
    """

    index: int
    generation: int
    tau_scale: float
    cost_m: float
    miss_m: float
    caught: bool
    shift_x_m: float
    shift_y_m: float
    bumps_m: Collection[float]
    swing_slack_s: float = 0.0


@dataclass(frozen=True)
class AdaptEvaluationMessage:
    """Repeat that evaluates what a policy search knows after ``rollouts``."""

    rollouts: int
    index: int
    caught: bool
    miss_m: float


@dataclass(frozen=True)
class AdaptWindowMessage:
    """Range of tau scales that catch, the one that is taken, and the time for which the rope is slack in its swing."""

    index: int
    low: float
    high: float
    middle: float
    swing_slack_s: float


@dataclass(frozen=True)
class AdaptRepeatMessage:
    """One perturbed repeat of the chosen motion.

    The cup was ``shift_m`` beside its plan at the catch, and at most ``max_shift_m``.
    """

    index: int
    caught: bool
    miss_m: float
    shift_m: float = 0.0
    max_shift_m: float = 0.0


@dataclass(frozen=True)
class AdaptPerturbationMessage:
    """Kendama, air and arm that were sampled for one repeat."""

    index: int
    rope_scale: float
    ball_start_m: float
    mass_scale: float
    drag_scale: float
    restitution: float
    joint_friction_nm: float
    joint_friction_fraction: float
    lag_s: float
    cup_error_m: float
    cup_error_hz: float
    cup_error_phase_rad: float
    ball_start_y_m: float = 0.0
    gravity_tilt_y_rad: float = 0.0
    wrist_rotor_scale: float = 1.0
    cup_error_y_m: float = 0.0
    cup_error_y_hz: float = 0.0
    cup_error_y_phase_rad: float = 0.0
    resonance_hz: float = 0.0
    resonance_damping: float = 0.0
    lost_commands: float = 0.0
    lost_burst: float = 1.0
    image_latency_s: float = 0.0


TOPICS: Mapping[str, type] = {
    "/adapt/rollout": AdaptRolloutMessage,
    "/adapt/candidate": AdaptRolloutMessage,
    "/adapt/explored": AdaptExploredMessage,
    "/adapt/evaluation": AdaptEvaluationMessage,
    "/adapt/window": AdaptWindowMessage,
    "/adapt/repeat": AdaptRepeatMessage,
    "/adapt/replay": ReplayMessage,
    "/adapt/perturbation": AdaptPerturbationMessage,
    "/adapt/scene": SceneUpdate,
    "/adapt/links": FrameTransforms,
    "/adapt/joints": JointStates,
    "/adapt/cup": FrameTransform,
    "/adapt/ball": FrameTransform,
    "/adapt/reference": FrameTransform,
}
"""``candidate``: candidates in the perturbed simulations that evaluate them; ``explored`` and ``evaluation``: those of
a policy search and the repeats that evaluate it; ``replay``: the repeats' bodies and ways, turned about the vertical
until the swing goes along x, as all misses and shifts are; the last: what the arm looks like, and the chosen motion,
undisturbed, where the arm stands."""
