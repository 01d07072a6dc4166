"""Reach of an arm's cup for a ball that comes down elsewhere, while it flies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings, CorrectionSettings
from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.corrected_motion import UNREACHED_M, CorrectedMotion, CupPlan
from kendama_cli.robot_model.inverse_kinematics import weighted_step
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array

ONSET_S = 0.05
"""Free flight is detected so late in 95 % of all flights, at 120 images/s."""
OTHERWISE = "choose adapt/uncertainty=identified"
FRACTIONS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)
"""Fractions of the required reach, tried where all of it is not available."""
FALL_M_S = -2.0
"""Velocity at which the ball comes down that is reached for: a fall of 0.2 m."""


@dataclass(frozen=True)
class _Flight:
    """Flight in the motion of ``cup``: when the ball is known first, and when the cup has to meet it."""

    cup: CupPlan
    known_s: float
    catch_s: float
    rim_m: float
    mouth_m: float


def lacking_reach(
    cup: CupPlan, flight_s: tuple[float, float], settings: AdaptSettings, *, rim_m: float, mouth_m: float
) -> str | None:
    """Return why the cup cannot go ``uncertainty.min_reach_m`` to either side in a flight; None if it can.

    ``flight_s`` is when the ball flies in the motion of ``cup``. Of that time onset, the sensor's latency and the
    largest lag are lost; in the remaining time T the acceleration a carries the cup a T^2 / 2 along x. The path there
    and the rest of the motion are played as a visual catch commands them: the ball has to come down within ``mouth_m``
    of the centre of the cup, whose rim is at ``rim_m``, and the cup to be where it is sent. The text ends with the
    settings that would let it pass.
    """
    arm, asked_m = cup.arm, settings.uncertainty.min_reach_m
    name, asked = arm.settings.name, f"{settings.uncertainty.name} asks for {1e3 * asked_m:.0f} mm"
    if asked_m == 0.0:
        return None
    latency_s, lag_s = settings.sensor_model.latency_s, settings.uncertainty.lag_s[1]
    flies_s = flight_s[1] - flight_s[0]
    left_s = flies_s - ONSET_S - latency_s - lag_s
    lost = f"{ONSET_S:g} s of onset, {latency_s:g} s of latency and {lag_s:g} s of lag"
    if left_s <= 0:
        return (
            f"the ball flies {flies_s:.2f} s, and {lost} leave {name} no time to go to it ({asked}): lower "
            f"adapt.sensor_model.latency_s, or {OTHERWISE}"
        )
    if asked_m > settings.correction.max_shift_m:
        most_m = settings.correction.max_shift_m
        return f"adapt.correction.max_shift_m is {most_m:g} m ({asked}): raise it, or {OTHERWISE}"
    posture = cup.motion.position_rad[min(round(flight_s[1] / cup.period_s), len(cup.motion.t_s) - 1)]
    own_m_s2, joint = _acceleration_m_s2(arm, posture)
    used_m_s2 = min(own_m_s2, settings.correction.acceleration_m_s2)
    reach_m = 0.5 * used_m_s2 * left_s**2
    flight = _Flight(cup, flight_s[1] - lag_s - left_s, flight_s[1] - lag_s, rim_m, mouth_m)
    if reach_m < asked_m:
        by = "adapt.correction.acceleration_m_s2" if used_m_s2 < own_m_s2 else f"joint '{joint}'"
        return (
            f"{name} moves the cup {1e3 * reach_m:.0f} mm while the ball flies ({asked}): {used_m_s2:.1f} m/s^2 ({by}) "
            f"in the {left_s:.2f} s that {lost} leave: raise that acceleration, {_passing(flight, reach_m, settings)}"
        )
    for side in (1.0, -1.0):
        if not _goes(flight, side * asked_m, settings.correction):
            return (
                f"{name} cannot move the cup {1e3 * side * asked_m:+.0f} mm along x from the catch and follow on "
                f"({asked}): place the arm otherwise (adapt.placement=search), {_passing(flight, asked_m, settings)}"
            )
    return None


def _passing(flight: _Flight, most_m: float, settings: AdaptSettings) -> str:
    """Return the settings with which the flight passes, of a reach of at most ``most_m``."""
    tried = (math.floor(1e3 * fraction * most_m) for fraction in FRACTIONS)
    both = (mm for mm in tried if all(_goes(flight, side * 1e-3 * mm, settings.correction) for side in (1.0, -1.0)))
    millimetres = next(both, 0)
    return (f"set adapt.uncertainty.min_reach_m={1e-3 * millimetres:g}, " if millimetres else "") + f"or {OTHERWISE}"


def _acceleration_m_s2(arm: RobotModel, posture: Array) -> tuple[float, str]:
    """Return the cup's acceleration along x that the joints' limits allow, and the joint that allows least."""
    _, task = arm.cup_task(posture)
    needed = np.abs(weighted_step(task, np.array([1.0, 0.0, 0.0, 0.0, 0.0]), arm.redundancy_weights))
    given = arm.limits.acceleration_rad_s2 / np.maximum(needed, 1e-9)
    least = int(given.argmin())
    return float(given[least]), arm.joint_names[least]


def _goes(flight: _Flight, beside_m: float, correction: CorrectionSettings) -> bool:
    """Return True if a ball ``beside_m`` along x is met and the cup is where it is sent until the motion's end."""
    cup, period_s = flight.cup, flight.cup.period_s
    motion = CorrectedMotion(cup, correction, flight.rim_m, flight.known_s)
    center_m, speed_m_s = cup.at(flight.catch_s, flight.rim_m - correction.below_rim_m)
    pose = CatchPose(
        t_s=flight.catch_s,
        position_m=center_m + np.array([beside_m, 0.0, 0.0]),
        velocity_m_s=np.array([speed_m_s[0], speed_m_s[1], FALL_M_S]),
        covariance_m2=np.zeros((3, 3)),
        time_sigma_s=0.0,
        rotation_wxyz=np.array([1.0, 0.0, 0.0, 0.0]),
        n_observations=0,
    )
    first, last = math.ceil(flight.known_s / period_s), len(cup.motion.t_s)
    met = math.floor(flight.catch_s / period_s)
    for k in range(1, last):
        if not motion.over:
            motion.follow(pose)
        command = motion.next()
        if k < first:
            continue
        at = cup.arm.tool_pose(command.position_rad)
        off_m = at.position_m - cup.sample(k).position_m
        off_m[:2] -= motion.shift_m
        if float(np.abs(off_m).max()) > UNREACHED_M:
            return False
        if k == met and abs(beside_m - motion.shift_m[0]) > flight.mouth_m:
            return False
    return True
