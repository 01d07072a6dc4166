"""A delay of the arm stays unseen by the policy: it acts on the state in which its action will be carried out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, find_site, group_options
from kendama_cli.control import cup_cart
from kendama_cli.control.cup_cart import predict_state, scaled_to_model_rope
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.learning.decision import GreedyPolicy
from kendama_cli.learning.state import SwingState
from tests.control.cart_robot import CartRobot
from tests.control.test_games import GAME, LEARN, learned, make_runner
from tests.physics.bare_rope import bare_rope

PENDULUM = {"rope": bare_rope(0.4), "gravity_m_s2": 9.81}


def pendulum(angle: float, rate: float, a_m_s2: float, duration_s: float) -> tuple[float, float]:
    """The same equation by ten thousand midpoint steps."""
    h = duration_s / 10_000
    for _ in range(10_000):
        middle = angle + 0.5 * h * rate
        rate -= h * (9.81 * math.sin(middle) + a_m_s2 * math.cos(middle)) / 0.4
        angle = middle + 0.5 * h * rate
    return angle, rate


def test_without_a_delay_the_ball_is_where_it_is_seen_and_the_cup_where_it_is_wanted() -> None:
    state = predict_state(SwingState(0.1, 0.2, 1.5, -2.0), (0.3, 0.4), (), period_s=0.004, **PENDULUM)
    assert state == (0.3, 0.4, 1.5, -2.0)


@pytest.mark.parametrize(("angle", "rate", "a"), [(0.3, 2.0, 8.0), (-1.6, -4.0, -8.0), (2.2, 5.0, 4.0)])
def test_halving_the_period_halves_the_error_of_the_predicted_swing(angle: float, rate: float, a: float) -> None:
    """Semi-implicit Euler is of first order: the ratio of errors tends to 2."""
    exact = pendulum(angle, rate, a, 0.048)
    errors = []
    for n in (12, 24):
        state = predict_state(SwingState(0, 0, angle, rate), (0, 0), [a] * n, period_s=0.048 / n, **PENDULUM)
        errors.append(math.hypot(state.angle_rad - exact[0], 0.1 * (state.rate_rad_s - exact[1])))
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.25)
    assert errors[0] < 0.02


def test_the_angle_stays_within_half_a_turn() -> None:
    state = predict_state(SwingState(0, 0, 3.1, 10.0), (0, 0), [0.0] * 10, period_s=0.004, **PENDULUM)
    assert -math.pi <= state.angle_rad < -2.5


@pytest.mark.parametrize("scale", [0.9, 1.1, 2.0])
def test_the_same_accelerations_swing_alike_on_a_rope_of_any_length(scale: float) -> None:
    """Dynamic similarity: with times multiplied by sqrt(s) the angle is the same and the rate is divided by it."""
    root = math.sqrt(scale)
    start = SwingState(0.1, 0.3, 1.2, 2.0)
    gravity = PENDULUM["gravity_m_s2"]
    model = predict_state(start, (0.2, 0.5), [6.0] * 50, period_s=0.001, rope=bare_rope(0.4), gravity_m_s2=gravity)
    real = predict_state(
        SwingState(0.1 * scale, 0.3 * root, 1.2, 2.0 / root),
        (0.2 * scale, 0.5 * root),
        [6.0] * 50,
        period_s=0.001 * root,
        rope=bare_rope(0.4 * scale),
        gravity_m_s2=gravity,
    )
    assert scaled_to_model_rope(real, scale) == pytest.approx(model, rel=1e-9)
    assert scaled_to_model_rope(real, 1.0) == real


class Witness:
    """Passes on what a frozen policy does and keeps every state it was given."""

    def __init__(self, policy: GreedyPolicy) -> None:
        self.policy = policy
        self.readings: list[SwingState] = []

    def act(self, state: SwingState, t_s: float) -> float:
        self.readings.append(state)
        return self.policy.act(state, t_s)


def test_what_was_predicted_is_seen_one_delay_later() -> None:
    delay_n = 8
    table = learned(make_runner(), 1).policy
    witness = Witness(GreedyPolicy(table, LEARN))
    swing = make_runner(delay_n=delay_n).swing_up(witness, seed=2)
    late = slice(100, len(witness.readings) - delay_n - 1)
    given = np.array(witness.readings[late])
    seen = np.array([step.state for step in swing.steps[late.start + delay_n : late.stop + delay_n]])
    now = np.array([step.state for step in swing.steps[late]])
    apart = np.sqrt(np.mean((given - seen) ** 2, axis=0))
    unpredicted = np.sqrt(np.mean((now - seen) ** 2, axis=0))
    assert apart[0] < 0.003
    assert (apart[1:] < 0.35 * unpredicted[1:]).all(), (apart, unpredicted)


def _succeeded(table: Any, delay_n: int) -> float:
    place = make_runner(noise_m=0.0005, delay_n=delay_n)
    return float(np.mean([place.swing_up(GreedyPolicy(table, LEARN), seed=k).outcome == "goal" for k in range(15)]))


@pytest.mark.slow
def test_a_table_learned_without_delay_swings_up_with_fifty_milliseconds_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables, 36 (seeds 0..3, 10000..10007, 12000..12023): 0.95 with the prediction, 0.72 blind to the delay.

    The sixteen here: 0.90 and 0.67; those of seeds 0, 2 and 3 are the worst of all: 0.13, 0.73 and 0.47.
    """
    tables = [learned(make_runner(noise_m=0.0005), seed).policy for seed in (*range(4), *range(12000, 12012))]
    predicting = np.mean([_succeeded(table, 12) for table in tables])
    assert predicting >= 0.85
    monkeypatch.setattr(cup_cart, "predict_state", lambda state, *_, **__: state)
    assert np.mean([_succeeded(table, 12) for table in tables]) < predicting - 0.1, "without the prediction fewer do"


@pytest.mark.parametrize("delay_n", [0, 5, 10])
def test_whatever_the_delay_the_cup_stays_inside(delay_n: int) -> None:
    """The limiter keeps the reference inside; the cup runs through where the reference was."""

    class Outward:
        def act(self, state: SwingState, t_s: float) -> float:
            return 8.0 if t_s < 1.0 else -8.0

    robot = CartRobot(GAME, delay_n=delay_n)
    place = make_runner()
    place._cart._robot = cast(UdpRobot, robot)
    swing = place.swing_up(Outward(), seed=0)
    assert 0.35 < swing.peak_displacement_m <= LEARN.workspace.half_width_m + 1e-3


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    """The shipped choices of hardware, with a first file that asks for nothing else."""
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf/config.yaml").write_text("defaults: [_self_, {hardware: twin}]\n")
    monkeypatch.chdir(tmp_path)
    return find_site()


def test_nine_twins_differ_from_the_twin_in_what_their_names_say(site: Site) -> None:
    names = [name for name in group_options(site, "hardware") if name.startswith("twin_")]
    plain = composed(site, [])["hardware"]
    changed = {}
    for name in names:
        twin = composed(site, [f"hardware={name}"])["hardware"]
        assert {**twin, "imperfection": None} == {**plain, "imperfection": None}
        body = twin["imperfection"].items()
        changed[name] = {key: value for key, value in body if value != plain["imperfection"][key]}
    noise = {"ball_start_m", "joint_noise_rad", "ball_noise_m"}
    assert changed["twin_rope_short"] == {"rope_scale": 0.9}
    assert changed["twin_rope_long"] == {"rope_scale": 1.1}
    assert changed["twin_lag_20"] == {"lag_s": 0.02}
    assert changed["twin_lag_40"] == {"lag_s": 0.04}
    assert changed["twin_latency_20"] == {"latency_s": 0.02}
    assert changed["twin_long_slow"] == {"rope_scale": 1.1, "lag_s": 0.04}
    assert set(changed["twin_short_noisy"]) == {"rope_scale", "latency_s", *noise}
    for name, factor in (("twin_noise_2", 2.0), ("twin_noise_3", 3.0)):
        assert set(changed[name]) == noise
        for key in noise:
            assert changed[name][key] == pytest.approx(factor * plain["imperfection"][key])
    assert len(names) == 9


def test_twelve_hard_twins_differ_from_the_twin_in_what_their_names_say(site: Site) -> None:
    plain = composed(site, [])["hardware"]
    changed = {}
    for name in (name for name in group_options(site, "hardware") if name.startswith("hard_")):
        twin = composed(site, [f"hardware={name}"])["hardware"]
        assert {**twin, "imperfection": None} == {**plain, "imperfection": None}
        changed[name] = {key for key, value in twin["imperfection"].items() if value != plain["imperfection"][key]}
    late = {"tracking_delay_s", "tracking_lost_fraction"}
    assert changed == {
        "hard_drag_half": {"drag_scale"},
        "hard_drag_triple": {"drag_scale"},
        "hard_tie_friction": {"tie_friction_m"},
        "hard_ball_light": {"mass_scale"},
        "hard_ball_heavy": {"mass_scale"},
        "hard_tracking_late": late,
        "hard_tracking_drift": {"drift_m"},
        "hard_bandwidth_3hz": {"lag_s"},
        "hard_tilt": {"gravity_tilt_rad"},
        "hard_backlash": {"backlash_rad"},
        "hard_drag_backlash": {"drag_scale", "backlash_rad"},
        "hard_tilt_late_heavy": {"gravity_tilt_rad", "mass_scale", *late},
    }
