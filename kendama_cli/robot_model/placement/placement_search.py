"""The search for a placement: base, heading, posture, handle and redundancy for the motions that an arm shall make."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kendama_cli.motion.braking import BRAKING_SHARE, stoppable_m_s
from kendama_cli.motion.dmp.heading import heading_turn
from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.chain_kernel import Curve, IkSettings, ToolGeometry, clearance, follow, frames, peaks
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.clearance import collision_geometry_about
from kendama_cli.robot_model.placement.evolution import Minimum, minimise
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import LineSettings, Placement

TIE_HEIGHT_M = 1.2
"""Where the tie point is at home, over the world's origin: the ball hangs and swings well over the floor."""
TALLEST_PEDESTAL_M = 1.1
SHORTEST_HANDLE_M, LONGEST_HANDLE_M = 0.1, 0.3
OUT_OF_PLANE = 0.5
"""Least sine of the angle between handle and swing plane, so that the rope swings past the handle."""
LOWEST_RISE, HIGHEST_RISE = -0.05, 0.6
"""Sine of the handle's rise toward the cup: it comes from the side or from below, never through the opening."""
RANGE_MARGIN_RAD = 0.05
WIDEST_RAD = np.pi
"""Postures are searched within a turn, however far a joint turns."""
WEIGHT_DECADES = 1.5
"""Redundancy weights are searched within these powers of ten about the inverse squares of the speed limits."""
REST_SHARE = 0.6
"""What accelerations and efforts of a motion count beside speeds: an effort is mostly the arm's own weight, which grows
with no time scale, and an acceleration limit is met for an instant only."""
CLEARANCE_EVERY = 8
MARGIN_M = 0.01
"""Clearance that is kept beside every part for what the capsules do not show."""
LINE_STEP_M = 0.02
SAMPLES = 4000
BLOCKED = 5.0
UNREACHED = 10.0
IMPOSSIBLE = 30.0


@dataclass(frozen=True)
class Demand:
    """A curve that the cup shall run: ``path_m`` (k, 3) from home, sampled every ``step`` of its parameter s.

    ``velocity`` (k,) and ``acceleration`` are the rate of s and its change; a motion in time has 1 and 0. ``weight``
    is what its peaks count beside those of other demands, ``rest_fraction`` what its accelerations and efforts count
    beside its speeds. The ball swings in the vertical plane turned by ``swing_rad`` from x.
    """

    path_m: Array
    step: float
    velocity: Array
    acceleration: float
    weight: float
    rest_fraction: float
    swing_rad: float = 0.0


def motion_demand(path_m: Array, step_s: float, weight: float = 1.0, swing_rad: float = 0.0) -> Demand:
    """Return the demand of a motion sampled every ``step_s``."""
    path = np.asarray(path_m, dtype=np.float64)
    return Demand(path, step_s, np.ones(len(path)), 0.0, weight, REST_SHARE, swing_rad)


def line_demands(line: LineSettings, weight: float = 1.0, *, braking_m_s2: float | None = None) -> tuple[Demand, ...]:
    """Return the demands of ``line`` in both directions from home: anywhere at its acceleration and at its velocity.

    Toward the ends the speed falls to what can still be braked within the line with ``braking_m_s2``, by default
    ``BRAKING_SHARE`` of the line's acceleration.
    """
    braking = BRAKING_SHARE * line.acceleration_m_s2 if braking_m_s2 is None else braking_m_s2
    count = round(line.half_width_m / LINE_STEP_M) + 2
    out = LINE_STEP_M * np.arange(count)
    left = np.maximum(line.half_width_m + LINE_STEP_M - out, 0.0)
    velocity = np.minimum(line.max_speed_m_s, stoppable_m_s(braking, left))
    return tuple(
        Demand(out[:, None] * [sign, 0.0, 0.0], LINE_STEP_M, velocity, line.acceleration_m_s2, weight, 1.0)
        for sign in (1.0, -1.0)
    )


class Round(NamedTuple):
    """Round of evolution: its number of starts, the cloud's standard deviation in the unit cube, and its duration."""

    starts: int
    spread: float
    generations: int


ROUNDS = (Round(10, 0.12, 80), Round(4, 0.05, 120), Round(1, 0.02, 300))


class _Try(NamedTuple):
    """A candidate in the terms of the chain."""

    heading_rad: float
    ik: IkSettings
    handle_m: Array
    tool: ToolGeometry
    tie_m: Array
    """(3,) tie point at home in the root's frame"""
    rise: Array
    """(3,) direction from the tip link to the tie point, in the root's frame at home"""


class PlacementProblem:
    """Cost of a placement of ``robot`` for ``demands``; candidates are points of the unit cube.

    The cost is the maximum fraction of a speed limit (or ``rest_fraction`` of the maximum fraction of an acceleration
    or effort limit), and far more where the arm does not reach, meets a stop, itself, its pedestal, the floor or the
    ball's swing.
    """

    def __init__(self, arm: RobotModel, game: GameSettings, demands: Sequence[Demand]) -> None:
        self._chain = compiled_chain(arm)
        self.demands = tuple(demands)
        self._limits = (arm.limits.velocity_rad_s, arm.limits.acceleration_rad_s2, arm.limits.effort_nm)
        self._held_kg = game.cup.mass_kg + game.ball.mass_kg
        self._geometry = collision_geometry_about(arm, game, 0.0, 0.0)
        n = len(arm.joint_names)
        low, high = np.maximum(arm.limits.lower_rad, -WIDEST_RAD), np.minimum(arm.limits.upper_rad, WIDEST_RAD)
        self._joint_limits = arm.limits
        # about a vertical first axis the posture's first angle and the heading are one and the same
        self._first = 1 if abs(self._chain.axes[0, 2]) > 0.999 else 0
        self._middle_rad = (low + high) / 2
        handle = np.array(arm.settings.tool.handle_m)
        long = float(np.linalg.norm(handle))
        self._along = handle / long if long > 1e-6 else np.array([0.0, 0.0, 1.0])
        self._low = np.concatenate([[-np.pi], low[self._first :], [SHORTEST_HANDLE_M], np.full(n, -WEIGHT_DECADES)])
        self._high = np.concatenate(
            [[np.pi], high[self._first :], [max(long, LONGEST_HANDLE_M)], np.full(n, WEIGHT_DECADES)]
        )
        self.dimensions = len(self._low)
        self._joints = n

    def place_of(self, placement: Placement) -> Array:
        """Return the candidate (d,) nearest to ``placement``."""
        home = np.array(placement.home_rad)
        heading = placement.base_heading_rad
        if self._first:
            heading += (home[0] - self._middle_rad[0]) * self._chain.axes[0, 2]
        weights = np.log10(np.array(placement.redundancy_weights) * self._limits[0] ** 2)
        values = np.concatenate(
            [
                [np.mod(heading + np.pi, 2 * np.pi) - np.pi],
                home[self._first :],
                [np.linalg.norm(placement.handle_m)],
                weights - weights.mean(),
            ]
        )
        unit: Array = (values - self._low) / (self._high - self._low)
        return np.clip(unit, 0.0, 1.0)

    def placement(self, place: Array) -> Placement:
        """Return the candidate ``place`` (d,) as a placement in the world."""
        one = self._try(place)
        base = np.array([0.0, 0.0, TIE_HEIGHT_M]) - heading_turn(one.heading_rad) @ one.tie_m
        return Placement(
            base_position_m=_rounded(base),
            base_heading_rad=round(one.heading_rad, 6),
            home_rad=tuple(round(float(angle), 6) for angle in one.ik.home),
            handle_m=_rounded(one.handle_m),
            cup_axis=_rounded(self._chain.tip_turn.T @ one.tool.axis),
            redundancy_weights=tuple(float(f"{weight:.4g}") for weight in one.ik.weights),
        )

    def unreached(self, place: Array) -> tuple[Demand, int, float] | None:
        """Return the worst miss of a demand by the candidate: the demand, the sample and the distance [m]; None
        without a miss.
        """
        one = self._try(place)
        worst: tuple[Demand, int, float] | None = None
        for demand in self.demands:
            path = demand.path_m @ heading_turn(one.heading_rad)
            _, missed = follow(self._chain, one.tool, one.ik, path, True)
            k = int(missed.argmax())
            if missed[k] > 1e-6 and (worst is None or missed[k] > worst[2]):
                worst = (demand, k, float(missed[k]))
        return worst

    def cost(self, place: Array) -> float:
        """Return the cost of the candidate ``place`` (d,)."""
        one = self._try(place)
        rotation = heading_turn(one.heading_rad)
        y = np.array([0.0, 1.0, 0.0])
        sides = [heading_turn(demand.swing_rad - one.heading_rad) @ y for demand in self.demands]
        pedestal_m = TIE_HEIGHT_M - float(one.tie_m[2])
        blocked = max(0.0, -pedestal_m) + max(0.0, pedestal_m - TALLEST_PEDESTAL_M)
        blocked += max(0.0, *(OUT_OF_PLANE - abs(float(one.rise @ side)) for side in sides))
        rise = float(one.rise[2])
        blocked += max(0.0, LOWEST_RISE - rise) + max(0.0, rise - HIGHEST_RISE)
        if blocked > 0.5:
            return IMPOSSIBLE + blocked
        peak = 0.0
        for number, demand in enumerate(self.demands):
            angles, missed = follow(self._chain, one.tool, one.ik, demand.path_m @ rotation, False)
            if not np.isfinite(missed[-1]):
                left = float(np.isinf(missed).mean()) + len(self.demands) - 1 - number
                return UNREACHED + UNREACHED * left / len(self.demands) + blocked
            stop = -float(self._joint_limits.to_stop_rad(angles).min())
            geometry = self._geometry._replace(floor_m=-pedestal_m, side=sides[number])
            gap = clearance(self._chain, one.tool, geometry, angles, CLEARANCE_EVERY)[0]
            blocked += max(0.0, stop + RANGE_MARGIN_RAD) + 5.0 * max(0.0, MARGIN_M - gap)
            curve = Curve(angles, demand.step, demand.velocity, demand.acceleration)
            found = peaks(self._chain, one.tool, curve)
            speed, change, effort = (float((one / of).max()) for one, of in zip(found, self._limits, strict=True))
            peak = max(peak, demand.weight * max(speed, demand.rest_fraction * max(change, effort)))
        return peak + BLOCKED * blocked

    def _try(self, place: Array) -> _Try:
        values = self._low + place * (self._high - self._low)
        n = self._joints
        home = self._middle_rad.copy()
        home[self._first :] = values[1 : 1 + n - self._first]
        weights = 10.0 ** values[-n:] / self._limits[0] ** 2
        handle = float(values[-n - 1]) * self._along
        rotations, shifts = np.empty((n + 1, 3, 3)), np.empty((n + 1, 3))
        frames(self._chain, home, rotations, shifts)
        out = self._chain.tip_turn @ handle
        tie = self._chain.tip_m + out
        tool = ToolGeometry(tie, rotations[n].T @ np.array([0.0, 0.0, 1.0]), self._held_kg)
        rise = rotations[n] @ out / np.linalg.norm(out)
        return _Try(float(values[0]), IkSettings(home, weights), handle, tool, rotations[n] @ tie + shifts[n], rise)


def search(
    problem: PlacementProblem,
    given: Placement,
    *,
    rng: np.random.Generator,
    effort: float,
    progress: Callable[[int, int, float], None] = lambda done, total, cost: None,
) -> Minimum:
    """Return the best candidate found: evolution starts from ``given`` and the best of many even samples, in ever fewer
    rounds.

    ``effort`` scales the number of candidates looked at. ``progress`` is called with starts done, starts in all, and
    the least cost so far.
    """
    sampled = rng.uniform(size=(round(effort * SAMPLES), problem.dimensions))
    costs = np.array([problem.cost(position) for position in sampled])
    order = np.argsort(costs, kind="stable")[: ROUNDS[0].starts - 1]
    first = problem.place_of(given)
    best = [Minimum(first, problem.cost(first)), *(Minimum(sampled[k], float(costs[k])) for k in order)]
    done, total = 1, 1 + sum(one.starts for one in ROUNDS)
    progress(done, total, min(one.value for one in best))
    for one in ROUNDS:
        for k, start in enumerate(best[: one.starts]):
            generations = round(effort * one.generations)
            best[k] = minimise(problem.cost, start.place, spread=one.spread, generations=generations, rng=rng)
            done += 1
            progress(done, total, min(found.value for found in best))
        best.sort(key=lambda found: found.value)
    return best[0]


def _rounded(values: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 6) + 0.0 for value in values)
    return x, y, z
