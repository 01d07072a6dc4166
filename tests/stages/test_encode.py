import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration, DemonstrationSet
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp import play
from kendama_cli.stages.encode import Encode
from tests.memory_context import MemoryContext
from tests.motion.swings import demonstration, settings


def encode(demonstrations, ctx=None, **changes):
    given = {"capture": DemonstrationSet(tuple(demonstrations))}
    return Encode(encode=settings(**changes)).run(given, ctx or MemoryContext())


def test_one_demonstration_is_enough():
    made = encode([demonstration()])
    assert isinstance(made.artifact, MotionPlan)
    assert made.artifact.tau_scale == 1.0
    assert made.metrics["n_parameters"] == 22
    assert made.metrics["spread_rmse_mm"] == made.metrics["rmse_mm"]
    assert made.metrics["duration_spread_s"] == 0


def test_many_of_other_durations_and_rates_give_one_primitive():
    swings = [
        demonstration(1.7, 120, name="a"),
        demonstration(2.2, 60, name="b"),
        demonstration(2.0, 250, name="c", head_s=0.5),
    ]
    metrics = encode(swings).metrics
    assert metrics["rmse_mm"] < 0.5
    assert metrics["rmse_mm"] <= metrics["max_error_mm"]
    assert metrics["spread_rmse_mm"] > metrics["rmse_mm"]


def test_metrics_are_of_each_demonstration_by_its_own_primitive():
    """Two very different swings: the error stays that of one, the spread does not."""
    swing = demonstration()
    mirrored = dataclasses.replace(swing, name="mirror", position_m=-swing.position_m)
    alone, both = encode([swing]).metrics, encode([swing, mirrored]).metrics
    assert both["rmse_mm"] == pytest.approx(alone["rmse_mm"])
    assert both["max_error_mm"] == pytest.approx(alone["max_error_mm"])
    assert both["spread_max_mm"] > 100


def test_the_log_holds_what_was_demonstrated_and_what_is_reproduced():
    ctx = MemoryContext()
    plan = encode([demonstration(name="a"), demonstration(2.2, name="b")], ctx).artifact
    children = {}
    for topic, t_s, message in ctx.log.messages:
        children.setdefault(topic, {}).setdefault(message["child"], []).append((t_s, message["position_m"]))
    assert set(children["/encode/demonstrated"]) == {"a", "b"}
    assert set(children["/encode/reproduced"]) == {"reproduced"}
    t_s, position_m = (np.array(column) for column in zip(*children["/encode/reproduced"]["reproduced"], strict=True))
    assert np.allclose(position_m, play(plan, t_s).position_m)
    for samples in children["/encode/demonstrated"].values():
        assert samples[0][0] == 0
        assert np.linalg.norm(samples[0][1]) < 1e-3  # relative to its start


@pytest.mark.parametrize("regression", ["lwr", "ridge", "position"])
def test_every_regression_can_be_chosen(regression):
    assert encode([demonstration()], regression=regression).metrics["n_parameters"] == 22


def test_the_papers_setting_is_locally_weighted_with_20_functions():
    paper = settings("paper")
    assert paper.regression == "lwr"
    assert paper.functions == 20


def test_the_same_demonstrations_give_the_same_bytes():
    first, second = (encode([demonstration(), demonstration(2.1)]).artifact for _ in range(2))
    assert first.weights.tobytes() == second.weights.tobytes()


def test_a_demonstration_that_does_not_move_is_named():
    still = Demonstration("nap", np.arange(50) / 100, np.zeros((50, 3)))
    with pytest.raises(StageError, match=r"encode: demonstration 'nap': the hand never moves"):
        encode([demonstration(), still])
