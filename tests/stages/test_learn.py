"""The stage learn: from nothing to a frozen policy, resumable bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.policy import policy_digest
from kendama_cli.log.channels import schema_of
from kendama_cli.log.schemas import encode
from kendama_cli.stages.interface import Made
from kendama_cli.stages.learn import Learn
from tests.learning.settings_files import game_settings, learn_settings
from tests.memory_context import MemoryContext

QUICK = {"count__evaluation": 20}


def learn(ctx: MemoryContext, name: str = "sarsa", **replaced: object) -> Made:
    return Learn(learn=learn_settings(name, **{**QUICK, **replaced}), game=game_settings()).run({}, ctx)


@pytest.fixture(scope="module")
def whole() -> tuple[Made, MemoryContext]:
    """One uninterrupted run."""
    ctx = MemoryContext(seed=3)
    return learn(ctx), ctx


def test_it_learns_the_swing_up_from_nothing(whole):
    made, ctx = whole
    metrics = made.metrics
    assert metrics["learned"] is True
    assert 1 <= metrics["rollouts_to_learn"] <= metrics["rollouts"] < 1000
    assert metrics["frozen_success_rate"] > 0.8
    assert metrics["peak_displacement_m"] <= 0.4 + 1e-4
    assert 2 <= metrics["swings"] <= 8
    assert 0.8 < metrics["time_to_goal_s"] < 4.0
    rollouts = [message for topic, _, message in ctx.log.messages if topic == "/learn/rollout"]
    assert [message["index"] for message in rollouts] == list(range(1, metrics["rollouts"] + 1))


def test_the_ten_rollouts_that_count_as_learned_are_greedy_successes(whole):
    made, ctx = whole
    rollouts = [message for topic, _, message in ctx.log.messages if topic == "/learn/rollout"]
    row = [message for message in rollouts[made.metrics["rollouts_to_learn"] - 1 :] if not message["explored"]][:10]
    assert len(row) == 10
    assert all(message["success"] for message in row)


def test_the_policy_is_sealed_and_of_the_papers_size(whole):
    policy = whole[0].artifact
    assert policy.q.shape == (324, 5)
    assert policy.digest == policy_digest(policy.q, policy.learning)


def test_the_log_fits_the_declared_channels_and_shows_the_flight(whole):
    _, ctx = whole
    for topic, t_s, message in ctx.log.messages:
        assert encode(schema_of(topic), message, round(t_s * 1e9))
    ball = [(t_s, message["position_m"]) for topic, t_s, message in ctx.log.messages if topic == "/learn/ball"]
    assert len(ball) > 100
    assert (np.diff([t_s for t_s, _ in ball]) > 0).all()
    assert max(place[2] for _, place in ball) > 0.2  # it rises over the cup
    assert ball[-1][1][2] == pytest.approx(0.07, abs=0.03)  # and comes down to the rim


@pytest.mark.parametrize("stop_after", [1, 7, 25, 45])
def test_killed_and_resumed_equals_uninterrupted_bit_for_bit(whole, stop_after):
    made, ctx = whole
    killed = MemoryContext(seed=3, stop_after=stop_after)
    with pytest.raises(KeyboardInterrupt):
        learn(killed)
    again = MemoryContext(seed=3, resume_from=killed)
    resumed = learn(again)
    assert resumed.artifact.digest == made.artifact.digest
    assert dict(resumed.metrics) == dict(made.metrics)
    assert again.log.messages == ctx.log.messages


def test_another_seed_learns_another_table(whole):
    assert learn(MemoryContext(seed=4), count__evaluation=1).artifact.digest != whole[0].artifact.digest


def test_reaching_the_cap_without_learning_ends_normally():
    metrics = learn(MemoryContext(seed=0), count__cap=12, goal__angle_deg=179.0, goal__tolerance_deg=0.01).metrics
    assert metrics["learned"] is False
    assert metrics["rollouts_to_learn"] == 12
    assert metrics["frozen_success_rate"] == 0.0
    assert metrics["swings"] is None
    assert metrics["time_to_goal_s"] is None


def test_rollouts_to_learn_stay_within_the_measured_distribution():
    # over 200 runs, seeds apart from these: mean 10.2, median 4, p90 26, none failed
    counts = [learn(MemoryContext(seed=seed), count__evaluation=1).metrics["rollouts_to_learn"] for seed in range(12)]
    assert np.mean(counts) < 40
    assert np.median(counts) < 20
    assert max(counts) < 200


@pytest.mark.parametrize("name", ["terminate", "paper"])
def test_it_also_learns_where_leaving_the_workspace_ends_the_rollout(name):
    # over 15 seeds: terminate mean 158, p90 254; paper mean 96, p90 185; none failed within 1000
    metrics = learn(MemoryContext(seed=1), name).metrics
    assert metrics["learned"] is True
    assert metrics["rollouts_to_learn"] < 700
    assert metrics["frozen_success_rate"] > 0.5
