"""A folder as MuJoCo Menagerie has it names its arm, and all files that a model reads count for the key."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.code import FileIndex
from kendama_cli.pipeline.inputs import describe, resolve_files
from kendama_cli.plugins.mujoco.files import arm_files, brought_files
from kendama_cli.plugins.mujoco.settings import MujocoHardware
from tests.shipped_conf import plain

BODIES = "".join(f'<body><joint name="j{k}"/>' for k in range(6)) + "</body>" * 6
SERVO = '<actuator><position joint="j0"/></actuator>'
ARM = f'<mujoco><include file="parts.xml"/><worldbody>{BODIES}</worldbody>{SERVO}</mujoco>'
PARTS = '<mujocoinclude><compiler meshdir="assets"/><asset><mesh file="link.stl"/></asset></mujocoinclude>'
SCENE = '<mujoco><include file="arm.xml"/><worldbody><geom type="plane"/></worldbody></mujoco>'
HAND = '<mujoco><worldbody><joint/></worldbody><actuator><position joint="finger"/></actuator></mujoco>'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "maker_arm"
    (made / "assets").mkdir(parents=True)
    (made / "assets/link.stl").write_text("solid")
    files = {"arm": ARM, "parts": PARTS, "scene": SCENE, "hand": HAND, "mjx_arm": ARM, "broken": "<mujoco>"}
    for name, text in files.items():
        (made / f"{name}.xml").write_text(text)
    return made


def hardware(path: Path) -> MujocoHardware:
    return MujocoHardware(**{**plain("hardware", "mujoco"), "model": str(path)})


def test_the_one_arm_of_a_folder_is_taken(folder: Path) -> None:
    assert arm_files(folder) == [folder / "arm.xml"]
    assert resolve_files(hardware(folder), "hardware", []).model == str(folder / "arm.xml")
    (folder / "arm_nohand.xml").write_text(ARM)
    assert arm_files(folder) == [folder / "arm_nohand.xml"]


def test_of_two_arms_both_are_told_and_of_none_that(folder: Path) -> None:
    (folder / "other.xml").write_text(ARM)
    line = "has 2 such files; type hardware.model=.*/maker_arm/arm.xml or hardware.model=.*/maker_arm/other.xml$"
    with pytest.raises(ConfigError, match=line):
        resolve_files(hardware(folder), "hardware", [])
    with pytest.raises(ConfigError, match=r"hardware\.model: '.*assets' has 0 such files$"):
        resolve_files(hardware(folder / "assets"), "hardware", [])


@pytest.mark.parametrize("changed", ["arm.xml", "parts.xml", "assets/link.stl", "scene.xml"])
def test_what_the_model_reads_counts_for_the_key_and_nothing_else(folder: Path, tmp_path: Path, changed: str) -> None:
    assert brought_files(folder / "arm.xml") == [folder / "assets/link.stl", folder / "parts.xml"]
    settings = replace(hardware(folder), model=str(folder / "arm.xml"))
    index = FileIndex(tmp_path / "index")
    before = describe(settings, index)
    (folder / changed).write_text((folder / changed).read_text() + "\n ")
    assert (describe(settings, index) != before) == (changed != "scene.xml")
