"""Whether an arm can bring its cup to a ball that comes down elsewhere, while it flies."""

from __future__ import annotations

import numpy as np

from kendama_cli.errors import StageError
from kendama_cli.game.steered_motion import CupPlan
from kendama_cli.robot_model.inverse_kinematics import OutOfReachError, solve_cup, weighted_step
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.catch.settings import AdaptSettings

ONSET_S = 0.05
"""Free flight is detected so late in 95 % of all flights, at 120 images/s."""
OTHERWISE = "or choose adapt/uncertainty=identified"


def require_reach(cup: CupPlan, flight_s: tuple[float, float], settings: AdaptSettings) -> None:
    """Raise StageError where the cup cannot go ``settings.uncertainty.least_reach_m`` to either side in a flight.

    ``flight_s`` is when the ball flies in the motion of ``cup``. Of that time onset, the eyes' latency and the largest
    lag are lost; in what is left, T, the acceleration a carries the cup a T^2 / 2.
    """
    arm, wanted_m = cup.arm, settings.uncertainty.least_reach_m
    name, wanted = arm.settings.name, f"{settings.uncertainty.name} asks for {1e3 * wanted_m:.0f} mm"
    if wanted_m == 0.0:
        return
    latency_s, lag_s = settings.eyes.latency_s, settings.uncertainty.lag_s[1]
    flies_s = flight_s[1] - flight_s[0]
    left_s = flies_s - ONSET_S - latency_s - lag_s
    lost = f"{ONSET_S:g} s of onset, {latency_s:g} s of latency and {lag_s:g} s of lag"
    if left_s <= 0:
        raise StageError(
            f"the ball flies {flies_s:.2f} s, and {lost} leave {name} no time to go to it ({wanted}): lower "
            f"adapt.eyes.latency_s, {OTHERWISE}"
        )
    posture = cup.motion.position_rad[min(round(flight_s[1] / cup.period_s), len(cup.motion.t_s) - 1)]
    own_m_s2, joint = _acceleration_m_s2(arm, posture)
    used_m_s2 = min(own_m_s2, settings.steering.acceleration_m_s2)
    way_m = 0.5 * used_m_s2 * left_s**2
    if way_m < wanted_m:
        by = "adapt.steering.acceleration_m_s2" if used_m_s2 < own_m_s2 else f"joint '{joint}'"
        raise StageError(
            f"{name} moves the cup {1e3 * way_m:.0f} mm while the ball flies ({wanted}): {used_m_s2:.1f} m/s^2 ({by}) "
            f"in the {left_s:.2f} s that {lost} leave: raise that acceleration, {OTHERWISE}"
        )
    for side_m in (wanted_m, -wanted_m):
        _require_place(arm, posture, side_m, wanted)


def _acceleration_m_s2(arm: RobotModel, posture: Array) -> tuple[float, str]:
    """What the joints' accelerations give the cup along x, and the joint that gives least."""
    _, task = arm.cup_task(posture)
    needed = np.abs(weighted_step(task, np.array([1.0, 0.0, 0.0, 0.0, 0.0]), arm.redundancy_weights))
    given = arm.limits.acceleration_rad_s2 / np.maximum(needed, 1e-9)
    least = int(given.argmin())
    return float(given[least]), arm.joint_names[least]


def _require_place(arm: RobotModel, posture: Array, side_m: float, wanted: str) -> None:
    place = arm.tool_place_m(posture) + np.array([side_m, 0.0, 0.0])
    try:
        angles = solve_cup(arm, place, posture)
        inside = bool(((angles >= arm.limits.lower_rad) & (angles <= arm.limits.upper_rad)).all())
    except OutOfReachError:
        inside = False
    if not inside:
        raise StageError(
            f"{arm.settings.name} cannot hold the cup {1e3 * side_m:+.0f} mm along x beside the catch ({wanted}): "
            f"place the arm otherwise (adapt.placement=search), {OTHERWISE}"
        )
