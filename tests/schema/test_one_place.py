"""Laws that stand in one place, through every part that uses them."""

from __future__ import annotations

import dataclasses
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import kendama_cli
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.control.scene_history import SceneHistory
from kendama_cli.devices.camera.calibration import camera_model
from kendama_cli.devices.demonstrator.recording import unit_rotations
from kendama_cli.devices.robot.interface import SceneState
from kendama_cli.errors import ConfigError, InputError
from kendama_cli.log.writer import canonical_json as logged_json
from kendama_cli.motion.rotation import between
from kendama_cli.report.replay.performance import poses_between
from kendama_cli.schema.json_text import json_text
from kendama_cli.schema.random_stream import random_stream
from kendama_cli.store.durable import canonical_json as stored_json
from tests.vision.scenes import virtual

ROUNDED = np.array([0.71, 0.0, 0.7, 0.0])
"""A quarter turn about y as it is written with two digits: 0.997 long."""


def _takers() -> dict[str, Any]:
    camera = virtual().cameras[0]
    return {
        "capture": lambda q: unit_rotations("a.csv", np.tile(q, (3, 1)), str, from_start=False)[0],
        "camera": lambda q: camera_model(dataclasses.replace(camera, look_at_m=None, rotation_wxyz=tuple(q))),
    }


@pytest.mark.parametrize("part", ["capture", "camera"])
def test_a_quaternion_of_two_digits_is_taken_everywhere_and_one_of_another_length_nowhere(part: str) -> None:
    taker = _takers()[part]
    made = taker(ROUNDED)
    if isinstance(made, np.ndarray):
        assert np.linalg.norm(made) == pytest.approx(1.0, abs=1e-12)
        assert made == pytest.approx(ROUNDED / np.linalg.norm(ROUNDED))
    with pytest.raises((InputError, ConfigError, ValueError), match="1"):
        taker(1.02 * ROUNDED)


def test_rotations_between_two_samples_are_those_of_a_turn_at_a_constant_rate() -> None:
    """To a^3 / 240 for an angle a: scipy's spherical interpolation is the reference; signs of samples do not matter."""
    rng = np.random.default_rng(10000)
    turns = Rotation.from_rotvec(np.cumsum(rng.uniform(-0.2, 0.2, (20, 3)), axis=0))
    t, at = np.arange(20.0), np.linspace(0, 19, 400)
    flipped = turns.as_quat(scalar_first=True) * rng.choice([-1.0, 1.0], (20, 1))
    wanted = Slerp(t, turns)(at)
    largest = (turns[1:] * turns[:-1].inv()).magnitude().max()
    poses = np.hstack([np.zeros((20, 3)), flipped])
    for found in (between(t, flipped, at), poses_between(t, poses, at)[:, 3:]):
        apart = (Rotation.from_quat(found, scalar_first=True) * wanted.inv()).magnitude()
        assert apart.max() < largest**3 / 240


def test_the_cup_that_cameras_are_shown_between_two_periods_is_no_smaller() -> None:
    """Ten radians a second: entries of matrices, blended one by one, shrank it by a thousandth and bent its axes."""
    history = SceneHistory(lambda _: np.empty((0, 3)), 0.4, np.zeros(3))
    turns = [Rotation.from_rotvec([0.0, 0.1 * k, 0.0]).as_matrix() for k in range(2)]
    for k, turn in enumerate(turns):
        history.add(0.01 * k, SceneState(np.zeros(1), np.zeros(3), turn, np.zeros(3)))
    seen = history(0.005).cup_rotation
    assert seen == pytest.approx(Rotation.from_rotvec([0.0, 0.05, 0.0]).as_matrix(), abs=1e-12)


def test_one_text_stands_for_a_value_in_logs_stores_and_policies() -> None:
    value = {"b": [1.5, None], "a": "Fänger"}
    text = '{"a":"Fänger","b":[1.5,null]}'
    sealed = PolicyArtifact.seal("sarsa", value, {})
    assert {json_text(value), logged_json(value), stored_json(value).decode(), sealed.meaning} == {text}
    assert json.loads(text) == value
    for of in (json_text, stored_json, lambda one: PolicyArtifact.seal("sarsa", one, {})):
        with pytest.raises(ValueError, match="not JSON compliant"):
            of({"a": float("nan")})


def test_a_stream_belongs_to_its_name_and_number() -> None:
    seen = [random_stream(7, *which).random() for which in (("rope", 0), ("rope", 1), ("game", 0))]
    assert len(set(seen)) == 3
    assert seen[1] == np.random.default_rng([7, zlib.crc32(b"rope"), 1]).random()
    package = Path(kendama_cli.__file__).parent
    derived = [
        one.name for one in package.rglob("*.py") if "crc32(" in one.read_text() and "default_rng" in one.read_text()
    ]
    assert derived == ["random_stream.py"]
