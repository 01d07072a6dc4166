"""Movement primitives of position and orientation.

The orientation q(t) is encoded by its rotation vector from the start, r = log(q q0^-1), whose three components are
coordinates of a primitive like x, y and z; played, q = exp(r) q0. So orientation is linear in its weights too, and
everything holds for it that holds for positions: end velocities, smoothing, averaging, the hold. Turning the world
(q -> a q) turns r; turning the tool (q -> q b) leaves r as it is; q and -q are the same. (The tangent space at the
start instead of the one at the goal of A. Ude, B. Nemec, T. Petric, J. Morimoto, "Orientation in Cartesian space
dynamic movement primitives", ICRA 2014.)
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import PosePlan
from kendama_cli.motion.averaging import Encoding
from kendama_cli.motion.dmp import play
from kendama_cli.motion.encoding import fit_demonstrations
from kendama_cli.motion.onset import moving_part
from kendama_cli.motion.resampling import between, cut
from kendama_cli.motion.rotation import angular_velocity, continuous_logarithm, exponential, inverse, multiply
from kendama_cli.motion.settings import EncodeSettings
from kendama_cli.schema.arrays import Array, NotUnitError, unit_quaternions

POSE = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class PoseMotion:
    """A motion of position and orientation at n instants."""

    position_m: Array
    velocity_m_s: Array
    rotation_wxyz: Array
    """(n, 4)"""
    angular_velocity_rad_s: Array
    """(n, 3) in the world"""


def encode_pose(t_s: Array, position_m: Array, rotation_wxyz: Array, settings: EncodeSettings) -> PosePlan:
    """The primitive of one demonstration, samples (n,), (n, 3), (n, 4); onset and end are those of the position.

    Raises ValueError where nothing moves, or naming the sample where a quaternion is not of unit length.
    """
    try:
        unit = unit_quaternions(rotation_wxyz)
    except NotUnitError as wrong:
        raise ValueError(f"sample {wrong.index + 1}: {wrong}") from None
    part = moving_part(t_s, position_m, rest_speed_m_s=settings.rest_speed_m_s, rest_share=settings.rest_share)
    margin = settings.margin_share if settings.trim == "rest" else None
    begin_s = np.array([cut(t_s, position_m, part, margin, margin).onset_s])
    from_first = continuous_logarithm(multiply(unit, inverse(unit[0])))
    start = multiply(exponential(between(t_s, from_first, begin_s)[0]), unit[0])
    turned = continuous_logarithm(multiply(unit, inverse(start)))
    trimmed = [cut(t_s, values, part, margin, margin) for values in (position_m, turned)]
    parameters, basis = fit_demonstrations(trimmed, settings)
    encoding = Encoding(tuple(trimmed), parameters, basis)
    place, turn = encoding.plan(0), encoding.plan(1)
    # rotation vectors do not add up, so the smoothed start stays where the fit saw it: a little off the first sample
    origin = np.concatenate((np.zeros(3), parameters.origin_m[1]))
    motion = dataclasses.replace(
        place,
        coordinates=POSE,
        start_m=origin,
        start_velocity_m_s=np.concatenate((place.start_velocity_m_s, turn.start_velocity_m_s)),
        goal_m=np.concatenate((place.goal_m, turn.goal_m)) + origin,
        goal_velocity_m_s=np.concatenate((place.goal_velocity_m_s, turn.goal_velocity_m_s)),
        weights=np.vstack((place.weights, turn.weights)),
        variation=np.zeros((0, 1 + 6 * (3 + basis.functions))),
    )
    return PosePlan(motion, start)


def play_pose(plan: PosePlan, t_s: Array) -> PoseMotion:
    """The motion at the instants ``t_s`` (n,), as ``play``."""
    made = play(plan.motion, t_s)
    vector, rate = made.position_m[:, 3:], made.velocity_m_s[:, 3:]
    return PoseMotion(
        made.position_m[:, :3],
        made.velocity_m_s[:, :3],
        multiply(exponential(vector), plan.start_wxyz),
        angular_velocity(vector, rate),
    )
