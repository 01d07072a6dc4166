"""The page says of swings and robots what the data says of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from kendama_cli.devices.demonstrator.file import recordings_of
from kendama_cli.devices.demonstrator.settings import FileCapture
from kendama_cli.report.origin import robot_of, swings_of
from kendama_cli.schema.settings import build
from kendama_cli.stages.transfer import STAGE
from tests.shipped_conf import CONF, plain

SWING = CONF.parent / "data" / "demonstrations" / "swing-04.csv"


@pytest.mark.parametrize(
    ("head", "origin"),
    [
        (None, "synthetic"),
        (
            "# Synthetic demonstration of a swing, made by a program; no person was recorded.",
            "synthetic",
        ),
        ("# origin: person, in our laboratory", "person"),
        ("#Origin = Simulation", "simulation"),
        ("# a swing", ""),
        ("# not origin: synthetic", ""),
    ],
)
def test_a_recording_is_of_what_its_head_says(head: str | None, origin: str, tmp_path: Path) -> None:
    lines = SWING.read_text().splitlines()
    file = tmp_path / "swing.csv"
    file.write_text("\n".join([head or lines[0], *lines[1:]]) + "\n")
    settings = build(FileCapture, plain("capture", "file") | {"path": str(file)})
    (read,) = recordings_of(settings)
    assert read.origin == origin
    assert dataclasses.replace(read, origin="").t_s[0] == 0.0


def test_nobody_is_called_a_person_who_is_not_said_to_be_one() -> None:
    assert "no person was recorded" in swings_of({"origin": "synthetic"})
    assert swings_of({"origin": "person"}) == "A person's swings."
    for unknown in ({}, {"origin": ""}, {"origin": "simulation"}, {"origin": "mixed"}):
        assert "person" not in swings_of(unknown)


def test_the_twin_is_called_the_twin_and_no_simulation_is_hardware() -> None:
    words = [one.of(robot_of({"hardware": {"kind": "twin"}})) for one in STAGE.headline]
    assert words == ["of swing-ups succeed on the twin", "of full games caught on the twin"]
    assert robot_of({"hardware": {"kind": "simulated"}}) == "the simulated arm"
    assert robot_of({"hardware": {"kind": "rsi"}}) == "the robot of hardware=rsi"
    assert robot_of({}) == "the robot"
