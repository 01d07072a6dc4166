"""The bundled demonstrations: what they say of themselves, and that they hold what they promise."""

from __future__ import annotations

import dataclasses
import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from tests.motion.swings import settings
from tests.shipped_conf import plain

DATA = Path(__file__).parents[2] / "data"
FILES = sorted((DATA / "demonstrations").glob("*.csv"))


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DATA / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def design():
    return script("design")


@pytest.fixture(scope="module")
def demonstrations():
    made = []
    for file in FILES:
        rows = np.loadtxt(file, delimiter=",", skiprows=3)
        made.append(Demonstration(file.stem, rows[:, 0], rows[:, 1:]))
    return made


def falls(design, plan, taus):
    """Where the ball falls through the rim's plane when an ideally moved cup plays ``plan`` at each of ``taus``."""
    t_s = np.arange(0, max(taus) * plan.duration_s + 0.2, design.STEP_S)
    path = np.stack([play(dataclasses.replace(plan, tau_scale=tau), t_s).position_m for tau in taus], axis=1)
    return design.crossing(*design.fly(path))


def test_there_are_at_least_ten():
    assert len(FILES) >= 10


def test_the_generator_writes_the_same_bytes_again(tmp_path):
    subprocess.run([sys.executable, DATA / "generate.py", tmp_path], check=True)
    again = sorted(tmp_path.iterdir())
    assert [file.name for file in again] == [file.name for file in FILES]
    assert [file.read_bytes() for file in again] == [file.read_bytes() for file in FILES]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_file_says_that_it_is_synthetic(file):
    assert file.read_text().startswith("# origin: synthetic. ")


def test_the_readme_says_that_they_are_synthetic():
    assert "all of them synthetic" in (DATA / "README.md").read_text()


def test_no_two_are_alike_and_all_stay_within_what_an_arm_can_do(demonstrations):
    assert len({swing.duration_s for swing in demonstrations}) > 5
    for swing in demonstrations:
        moved = swing.position_m - swing.position_m[0]
        assert np.abs(moved).max() < 0.4
        assert swing.peak_speed_m_s < 1.5
        plan = encode_demonstrations([swing], settings())
        motion = play(plan, np.linspace(0, plan.duration_s, 500))
        assert np.linalg.norm(motion.acceleration_m_s2, axis=1).max() < 10  # the average's own is below 8


def test_the_designs_rope_and_cup_are_those_of_the_game(design):
    game = build(GameSettings, plain("game", "kendama"), "game")
    assert game.rope.length_m == design.ROPE_M
    assert game.rope.stiffness_n_m == design.STIFFNESS_N_M
    assert game.rope.damping_n_s_m == design.DAMPING_N_S_M
    assert game.ball.mass_kg == design.MASS_KG
    assert pytest.approx(game.cup.depth_m + game.ball.radius_m) == design.PLANE_M


@pytest.mark.parametrize("regression", ["dmp", "paper"])
def test_the_average_primitive_catches_over_more_than_five_percent_of_tau(design, demonstrations, regression):
    plan = encode_demonstrations(demonstrations, settings(regression))
    fall = falls(design, plan, np.arange(1.035, 1.096, 0.01))
    assert fall.crossed.all()
    assert not fall.blocked.any()
    # the ball (20 mm) clears the rim (45 mm) within 25 mm; measured 12 mm at most
    assert np.hypot(*fall.offset_m[:, :2].T).max() < 0.018


def test_at_the_demonstrated_tempo_the_ball_misses(design, demonstrations):
    fall = falls(design, encode_demonstrations(demonstrations, settings()), [1.0])
    assert 0.03 < np.hypot(*fall.offset_m[0, :2]) < 0.1


def test_the_search_improves_on_its_first_guess(design):
    first = design.cost(design.FIRST[None])[0]
    found = design.search(np.random.default_rng(0), 3)
    assert design.cost(found[None])[0] < first


@pytest.mark.recording
def test_the_recorded_swing_has_both_known_windows(design, recordings):
    """A person's swing, ideally moved: it crosses the middle near tau 0.90 and again near 1.03."""
    rows = np.loadtxt(recordings / "li-kendama" / "kendama1-20.txt")[:350]
    cup = np.column_stack((-rows[:, 1], 0 * rows[:, 1], rows[:, 3])) / 1e3
    plan = encode_demonstrations([Demonstration("iiwa", np.arange(350) / 100, cup)], settings())
    offsets = falls(design, plan, [0.88, 0.92, 1.01, 1.05]).offset_m[:, 0]
    assert offsets[0] > 0.03
    assert offsets[1] < -0.03
    assert offsets[2] < -0.03
    assert offsets[3] > 0.03
