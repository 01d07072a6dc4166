"""The rule of the aim in made-up worlds whose miss is plain arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.adaptation.aim import (
    MAX_POOR,
    Aim,
    AimedRollout,
    AimPath,
    next_aim,
    observed_miss,
    path_of_motions,
    predicted,
)
from kendama_cli.schema.arrays import Array

PATH = AimPath((-0.25, 0.0, 0.25), ((-1.0, 0.5), (0.0, 0.0), (1.0, -0.5)), 0.0, (-0.9, -0.8))
MOUTH_M = 0.03


def played(residuals: list[tuple[float, float]], path: AimPath = PATH, slope: float = 1.0) -> list[AimedRollout]:
    """Play one rollout for each residual, in a world where the aim along the path acts ``slope`` times as modelled."""
    rollouts: list[AimedRollout] = []
    for x, y in residuals:
        aim = next_aim(path, rollouts, MOUTH_M)
        assert aim is not None
        (aimed_x, aimed_y), away = predicted(path, aim), (slope - 1.0) * (aim.along_m - path.first_m)
        miss_m = (aimed_x + away + x, aimed_y + y)
        rollouts.append(AimedRollout(aim, float(np.hypot(*miss_m)) < MOUTH_M, miss_m))
    return rollouts


@pytest.mark.parametrize("residual", [(-0.3, 0.0), (-0.2, 0.05), (-0.05, 0.04), (0.08, -0.06), (0.24, 0.0), (0.4, 0.1)])
def test_a_constant_residual_is_gone_at_the_second_rollout(residual: tuple[float, float]) -> None:
    first, second = played([residual, residual])
    assert first.miss_m == pytest.approx(residual)
    assert second.miss_m == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_large_residual_is_met_by_another_motion_and_a_small_one_by_the_goal_alone() -> None:
    far = played([(0.2, 0.0)] * 2)[1].aim
    near = played([(0.1, 0.02)] * 2)[1].aim
    assert far.along_m == pytest.approx(-0.2)
    assert far.shift_m == pytest.approx((0.0, 0.0))
    assert near.along_m == 0.0
    assert near.shift_m == pytest.approx((0.1 / 0.9, 0.02 / 0.8))


def test_beyond_the_end_of_the_path_the_goal_does_the_rest() -> None:
    aim = played([(0.4, 0.0)] * 2)[1].aim
    assert aim.along_m == -0.25
    assert aim.shift_m[0] == pytest.approx((-0.4 + 0.25) / -0.9)


def test_from_the_first_catch_on_residuals_are_averaged_but_for_those_of_far_misses() -> None:
    scatter = [(0.2, 0.0), (0.21, 0.0), (0.19, 0.01), (0.2, -0.01)]
    rollouts = played(scatter)
    aim = next_aim(PATH, rollouts, MOUTH_M)
    assert aim is not None
    assert [one.caught for one in rollouts] == [False, True, True, True]
    assert aim.along_m == pytest.approx(-np.mean([0.21, 0.19, 0.2]))
    assert predicted(PATH, aim)[1] == pytest.approx(0.0, abs=1e-12)


def test_near_misses_alone_are_averaged_and_far_ones_alone_count_by_the_last() -> None:
    near = next_aim(PATH, played([(0.05, 0.0), (0.06, 0.02), (0.04, 0.01)]), MOUTH_M)
    far = next_aim(PATH, [AimedRollout(Aim(0.0), True, (0.3, 0.0)), AimedRollout(Aim(0.1), True, (0.2, 0.0))], MOUTH_M)
    assert near is not None
    assert far is not None
    assert predicted(PATH, near) == pytest.approx((-0.05, -0.01))
    assert predicted(PATH, far) == pytest.approx((-0.1, 0.0))


def test_where_the_path_acts_otherwise_than_modelled_the_secant_leads_to_the_catch() -> None:
    """A step of full size overshoots to as large a miss on the other side, for ever; the secant does not."""
    wide = AimPath((-2.0, 0.0, 2.0), ((-1.0,), (0.0,), (1.0,)), 0.0, (-0.9, -0.8))
    missed = [abs(one.miss_m[0]) for one in played([(0.2, 0.0)] * 8, wide, slope=2.0)]
    assert missed[:3] == pytest.approx([0.2] * 3)
    assert min(missed) < MOUTH_M


def test_aiming_gives_up_where_nothing_helps() -> None:
    stuck = [AimedRollout(Aim(0.01 * k), False, (-0.35, 0.0)) for k in range(MAX_POOR + 1)]
    assert next_aim(PATH, stuck[:-1], MOUTH_M) is not None
    assert next_aim(PATH, stuck, MOUTH_M) is None


def test_a_ball_that_never_came_down_counts_as_short_by_what_it_lacked() -> None:
    assert observed_miss(None, 0.2) == (-0.35, 0.0)
    assert observed_miss(None, -0.02) == pytest.approx((-0.45, 0.0))
    assert observed_miss((0.1, 0.2), -0.02) == (0.1, 0.2)
    assert observed_miss(None, 0.2, -1.0) == (0.35, 0.0), "short of a cup that the ball approaches against x"


def bent(parameters: Array) -> float:
    """A miss that is a curved function of two parameters, of which only one combination matters."""
    along = float(parameters @ [3.0, 4.0]) / 5.0
    return -0.1 + 0.2 * along + 0.02 * along**2


def test_motions_of_the_path_miss_as_predicted_with_the_smallest_change() -> None:
    misses, parameters, first_m = path_of_motions(bent, 2)
    assert first_m == pytest.approx(-0.1)
    assert misses == sorted(misses)
    assert misses[0] < -0.24
    assert misses[-1] > 0.24
    for miss_m, motion in zip(misses, parameters, strict=True):
        assert bent(motion) == pytest.approx(miss_m)
        assert abs(motion @ [4.0, -3.0]) < 0.1 * abs(motion @ [3.0, 4.0]) + 1e-12


def test_the_path_ends_before_a_jump_and_before_what_cannot_be_played() -> None:
    def simulate(parameters: Array) -> float | None:
        along = bent(parameters)
        return None if along > 0.1 else along - 0.3 if along < -0.2 else along

    misses, _, _ = path_of_motions(simulate, 2)
    assert min(misses) > -0.2
    assert max(misses) <= 0.1
    with pytest.raises(ValueError, match="cannot be played"):
        path_of_motions(lambda parameters: None, 2)
