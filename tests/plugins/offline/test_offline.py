"""Models from a recording, and policies that were learned in one of them alone."""

from __future__ import annotations

import csv
import dataclasses
import functools
from typing import Any

import numpy as np
import pytest

from kendama_cli.api import configuration
from kendama_cli.errors import ConfigError
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.offline.engine import NetworkSwing, believed, engine_of, environment_of
from kendama_cli.plugins.offline.fit import Fit
from kendama_cli.plugins.offline.network import _slopes, trained
from kendama_cli.plugins.offline.recording import driven, free, smoothed, transitions, world
from kendama_cli.plugins.offline.stage import Offline
from kendama_cli.stages.interface import StageResult
from tests.benchmarks.learning import DATA, SilentContext
from tests.plugins.offline import rows

BRIEF = ["fit.driven_s=20", "fit.free_s=35", "fit.updates=300", "learn.count.evaluation_rollouts=20"]


@functools.cache
def fitted() -> tuple[Any, StageResult]:
    """The settings, and a fit of a short recording."""
    own = configuration(BRIEF)
    return own, Fit(fit=own["fit"], learn=own["learn"], game=own["game"]).run({}, SilentContext(0))


def test_rope_and_drag_of_the_world_are_identified_and_no_policy_seed_changes_them():
    own, result = fitted()
    linear, quadratic = world(own["fit"], own["game"]).drag
    assert result.artifact.rope_m == pytest.approx(0.4, abs=0.003)  # the softer string, longer by 1 mm at rest
    found = result.artifact.linear_n_s_m + 3.0 * result.artifact.quadratic_n_s2_m2
    assert found == pytest.approx(linear + 3.0 * quadratic, rel=0.05)
    assert result.metrics["identified_error_mm"] < 0.2 * result.metrics["wrong_error_mm"]
    again = Fit(fit=own["fit"], learn=own["learn"], game=own["game"]).run({}, SilentContext(1))
    assert np.array_equal(again.artifact.first, result.artifact.first)
    assert again.metrics == result.metrics


def test_the_networks_gradients_are_those_of_differences():
    rng = np.random.default_rng(0)
    layers = [rng.standard_normal(shape) for shape in ((7, 5), (6, 5), (6, 4))]
    x, y = rng.standard_normal((11, 6)), rng.standard_normal((11, 4))

    def loss() -> float:
        hidden = x
        for layer in layers[:-1]:
            hidden = np.tanh(hidden @ layer[:-1] + layer[-1])
        return float(0.5 * ((hidden @ layers[-1][:-1] + layers[-1][-1] - y) ** 2).sum() / len(x))

    for layer, slope in zip(layers, _slopes(layers, x, y), strict=True):
        for place in ((0, 0), (-1, 3)):
            kept = layer[place]
            layer[place] = kept + 1e-6
            above = loss()
            layer[place] = kept - 1e-6
            below = loss()
            layer[place] = kept
            assert slope[place] == pytest.approx((above - below) / 2e-6, rel=1e-5, abs=1e-9)


def test_a_network_learns_a_known_map():
    own = dataclasses.replace(fitted()[0]["fit"], updates=3000)
    rng = np.random.default_rng(1)
    x = rng.uniform(-1.0, 1.0, (4000, 6))
    y = np.column_stack([np.sin(2.0 * x[:, 0]), x[:, 1] * x[:, 2], x[:, 3] - x[:, 4], x[:, 5] ** 2])
    network = trained(x[:3000], y[:3000], own, rng)
    left = network.changes(x[3000:]) - y[3000:]
    assert np.sqrt((left**2).mean()) < 0.1 * y.std()


def test_transitions_hold_mean_acceleration_and_change_of_state():
    recording = np.arange(70.0).reshape(10, 7) ** 1.5
    inputs, changes = transitions([recording], 3)
    assert len(inputs) == len(changes) == 7
    assert inputs[2].tolist() == pytest.approx([*recording[2, :4], recording[3:6, 6].mean(), recording[2, 5]])
    assert changes[2].tolist() == pytest.approx((recording[5, :4] - recording[2, :4]).tolist())


def test_smoothed_states_are_near_the_true_ones_but_not_exact():
    own, _ = fitted()
    recording = free(own["fit"], world(own["fit"], own["game"]), 0.002)[:4000]
    seen = smoothed(recording, own["fit"], 0.002, np.random.default_rng(0))
    error = (seen - recording)[50:-50, :4].std(axis=0)
    assert (error[:2] < own["fit"].track_sigma_m).all()
    assert ((error[2:] > 0.01) & (error[2:] < 0.2)).all()
    assert np.array_equal(seen[:, 4:], recording[:, 4:])


def test_a_networks_ball_moves_by_its_transitions_and_stays_within_bounds():
    own, result = fitted()
    swing = engine_of("network", result.artifact, own["fit"], own["learn"], own["game"])
    assert isinstance(swing, NetworkSwing)
    swing.start(SwingState(0.05, 0.2, 0.6, -1.0))
    assert np.hypot(swing.across_m, swing.above_m) == pytest.approx(result.artifact.hanging_m, abs=0.002)
    for _ in range(5000):
        swing.step(3.0)
    places = np.array([swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s])
    low, high = result.artifact.bounds
    assert ((places >= low - 0.51 * (high - low)) & (places <= high + 0.51 * (high - low))).all()
    assert swing.velocity_m_s == pytest.approx(0.2 + 3.0 * 10.0)
    with pytest.raises(ConfigError, match=r"'learn.randomisation' asks for a rope of 1.1"):
        swing.take_on(1.1, 1.0)


def test_each_model_believes_what_it_is_and_the_world_alone_is_soft_and_late():
    own, result = fitted()
    games = {
        name: believed(name, result.artifact, own["fit"], own["game"]) for name in ("identified", "wrong", "world")
    }
    assert games["identified"].rope.length_m == result.artifact.rope_m
    assert games["wrong"].rope.length_m == pytest.approx(0.4 * own["fit"].wrong_rope)
    assert games["wrong"].drag == (0.0, 0.0)
    stiff = own["game"].rope.stiffness_n_m
    assert [one.rope.stiffness_n_m for one in games.values()] == [stiff, stiff, own["fit"].stiffness_n_m]


def test_a_policy_of_the_identified_model_catches_in_the_world_and_the_world_is_not_asked(monkeypatch):
    own, result = fitted()
    stage = Offline(offline=own["offline"], fit=own["fit"], learn=own["learn"], game=own["game"])
    metrics = stage.run({"fit": result.artifact}, SilentContext(10000)).metrics
    assert metrics["world_caught_rate"] > 0.8
    assert metrics["random_success_rate"] < 0.05
    elsewhere = dataclasses.replace(own["fit"], drag_scale=9.0, stiffness_n_m=200.0)
    stage = Offline(offline=own["offline"], fit=elsewhere, learn=own["learn"], game=own["game"])
    other = stage.run({"fit": result.artifact}, SilentContext(10000)).metrics
    assert other["rollouts_to_solved"] == metrics["rollouts_to_solved"]
    assert other["model_caught_rate"] == metrics["model_caught_rate"]
    assert other["world_caught_rate"] < metrics["world_caught_rate"]


def test_a_policy_is_learned_in_the_network_too():
    own, result = fitted()
    environment = environment_of("network", result.artifact, own["fit"], own["learn"], own["game"])
    assert not environment.compiled
    few = dataclasses.replace(own["learn"].count, max_rollouts=10, solved_streak=10, evaluation_rollouts=2)
    offline = dataclasses.replace(own["offline"], model="network")
    learn = dataclasses.replace(own["learn"], count=few)
    done = Offline(offline=offline, fit=own["fit"], learn=learn, game=own["game"])
    metrics = done.run({"fit": result.artifact}, SilentContext(0)).metrics
    assert metrics["rollouts_to_solved"] == 10
    assert not metrics["solved"]


def test_a_recording_is_as_long_as_asked_and_drives_the_ball():
    own, _ = fitted()
    game = world(own["fit"], own["game"])
    swings = driven(own["fit"], own["learn"], game, 10.0, np.random.default_rng(0))
    assert 10.0 <= 0.002 * sum(map(len, swings)) < 14.5
    assert max(np.abs(one[:, 0]).max() for one in swings) > 0.2


def test_the_table_of_docs_is_made_of_the_measured_seeds():
    with (DATA / "offline.csv").open(newline="") as file:
        assert list(csv.reader(file)) == rows.table(rows.read())


@pytest.mark.slow  # the whole fit
def test_a_seed_measured_anew_gives_the_same():
    known = min(rows.read(), key=lambda line: (line["rollouts_to_solved"], line["seed"]))
    (found,) = rows.measured(known["row"], known["string_m"], [int(known["seed"])])
    for name in rows.METRICS:
        assert found[name] == pytest.approx(known[name], rel=1e-6), name
