"""The cup's turn: encoded with the motion, averaged, exported, and told apart into tilt and spin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import encode, prepare
from kendama_cli.motion.dmp.plan_text import plan_from_text, plan_text
from kendama_cli.motion.dmp.turning import cup_axes, encode_rotations, rotations_of, tilt_only, with_turn_fraction
from kendama_cli.motion.rotation import exponential
from tests.motion.swings import path, settings

T = np.arange(0, 2.001, 0.01)


def tilting(t, size=0.4):
    u = np.clip(t / 2, 0, 1)
    return size * (np.sin(2 * np.pi * u) * np.sin(np.pi * u))[:, None] * np.array([0.1, 1.0, 0.0])


def turned_plan(*sizes):
    swings = [Demonstration(f"d{i}", T, path(T), exponential(tilting(T, size))) for i, size in enumerate(sizes)]
    encoding = encode(prepare(swings, settings()), settings())
    made = encode_rotations(swings, encoding, settings())
    assert made is not None
    return dataclasses.replace(encoding.average(), turn=made[0]), made[1], encoding.trimmed[0].onset_s


def test_a_turn_is_reproduced_with_the_motion():
    plan, lost, onset_s = turned_plan(0.4)
    t_s = np.linspace(0, plan.duration_s, 100)
    assert np.abs(rotations_of(plan, t_s) - tilting(t_s + onset_s)).max() < np.radians(1)
    assert lost < np.radians(0.5)


def test_turns_about_one_axis_are_averaged():
    plan, _, _ = turned_plan(0.2, 0.6)
    assert np.abs(rotations_of(plan, T) - rotations_of(turned_plan(0.4)[0], T)).max() < 1e-6


def test_where_one_demonstration_has_no_orientation_there_is_none():
    swings = [Demonstration("a", T, path(T), exponential(tilting(T))), Demonstration("b", T, path(T))]
    assert encode_rotations(swings, encode(prepare(swings, settings()), settings()), settings()) is None


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_a_turn_returns_from_text_to_the_bit(form):
    plan, _, _ = turned_plan(0.4)
    again = plan_from_text(plan_text(plan, form), form)
    for field in dataclasses.fields(plan.turn):
        assert np.array_equal(getattr(again.turn, field.name), getattr(plan.turn, field.name))


def test_tilt_and_spin_are_told_apart():
    rng = np.random.default_rng(0)
    vectors = rng.normal(0, 0.5, (200, 3))
    tilt, spin = tilt_only(vectors)
    assert cup_axes(vectors)[:, 2] == pytest.approx(np.cos(tilt), abs=1e-12)
    assert tilt_only(np.array([[0.0, 0.0, 0.7]])) == (pytest.approx([0.0], abs=1e-9), pytest.approx([0.7]))
    flat, none = tilt_only(vectors * [1, 1, 0])
    assert flat == pytest.approx(np.linalg.norm(vectors[:, :2], axis=1))
    assert none == pytest.approx(0, abs=1e-9)
    w, z = exponential(vectors)[:, [0, 3]].T
    assert spin == pytest.approx(np.abs(2 * np.arctan2(np.abs(z), np.abs(w)))), "swing and twist"


def test_a_share_of_a_turn_is_that_share_throughout():
    plan, _, _ = turned_plan(0.4)
    assert rotations_of(with_turn_fraction(plan, 0.5), T) == pytest.approx(0.5 * rotations_of(plan, T), abs=1e-12)
    assert with_turn_fraction(plan, 0.0).turn is None
