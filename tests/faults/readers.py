"""Everything that a user's file or text goes through, by kind: what reads it, and sound examples to spoil."""

from __future__ import annotations

import contextlib
import dataclasses
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.cli.main import main
from kendama_cli.config.compose import composed
from kendama_cli.config.site import bundled_root, find_site
from kendama_cli.devices.camera.calibration import read_calibration
from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.learning.verification import load_policy
from kendama_cli.log.messages import RolloutMessage
from kendama_cli.log.writer import McapLog
from kendama_cli.motion.dmp.plan_text import plan_text
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.shared.recordings.reader import read_tracks
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.capture import STAGE as CAPTURE
from kendama_cli.store.checkpoint import DurableAppendFile
from kendama_cli.store.codecs import save_artifact
from kendama_cli.vision.detection.colour import HUES, SATURATIONS, LearnedColour
from kendama_cli.vision.detection.colour_detector import read_colour


@dataclass(frozen=True)
class Kind:
    """A kind of input: ``read`` takes the path of a spoiled file, which was called ``name``; ``examples`` are sound."""

    name: str
    examples: tuple[bytes, ...]
    read: Callable[[Path], object]


def command(*arguments: str) -> None:
    """``kendama ARGUMENTS`` in this process; whatever it raises comes here (KENDAMA_DEBUG is set)."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        main(list(arguments))


def kinds(folder: Path) -> Mapping[str, Kind]:
    """Every kind of input; ``folder``, an empty one, is the current folder from now on."""
    settings = build_settings(composed(find_site(folder / "home"), []))
    return {
        "recording": Kind("swing.csv", _some("data/demonstrations/*.csv", 2), _hand(settings)),
        "recorded log": Kind("swing.mcap", (_recorded(folder),), _hand(settings)),
        "throw": Kind("throw.csv", (_spaced(),), read_tracks),
        "log": Kind("log.mcap", (_log(folder),), lambda path: command("log", "export", str(path), "-o", "out.csv")),
        "log's facts": Kind("log.mcap", (_log(folder),), lambda path: command("log", "info", str(path))),
        "plan": Kind("plan.yaml", (plan_text(_plan(), "yaml").encode(),), _show),
        "plan in JSON": Kind("plan.json", (plan_text(_plan(), "json").encode(),), _show),
        "calibration": Kind("calibration.yaml", (_calibration(),), lambda path: read_calibration(str(path))),
        "colour": Kind("ball.json", (_colour(),), lambda path: read_colour(str(path))),
        "Q-table's structure": Kind("artifact.json", (_policy(folder, "artifact.json"),), _load(folder, "arrays.npz")),
        "Q-table's arrays": Kind("arrays.npz", (_policy(folder, "arrays.npz"),), _load(folder, "artifact.json")),
        "pipeline": Kind("mine.yaml", _some("pipelines/*.yaml", 4), lambda path: command("plan", "-p", str(path))),
        "configuration": Kind("mine.yaml", _some("conf/game/*.yaml", 1), _choice(folder, "game")),
        "first file": Kind("config.yaml", _some("conf/config.yaml", 1), _first),
        "robot": Kind("arm.urdf", _some("data/robots/pa10.urdf", 1), _robot(settings)),
        "override": Kind("override", OVERRIDES, _override),
    }


OVERRIDES = (
    *(b"learn.alpha=0.3", b"capture=file", b"capture.path=[a.csv,b.csv]", b"game.rope.length_m=0.4", b"seed=1"),
    *(
        b"+capture.note='x y'",
        b"robot=pa10",
        b"~capture",
        b"hardware/kind=twin",
        b"a.b.c=${oc.env:HOME}",
        b"seed=range(0,3)",
    ),
    *(b"capture.columns={time:1,x:2}", b"camera/rig=stereo", b"learn.alpha=${game.rope.length_m}", b"seed=glob(*)"),
)


def _some(pattern: str, count: int) -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for path in sorted(bundled_root().glob(pattern))[:count])


def _spaced() -> bytes:
    t_s = np.arange(0.0, 0.6, 0.005)
    rows = [f"{t:.3f},{0.2 * t:.4f},{0.0:.1f},{1 + 2 * t - 4.905 * t * t:.5f}" for t in t_s]
    return "\n".join(["t_s,x_m,y_m,z_m", *rows]).encode()


def _plan() -> MotionPlan:
    rng = np.random.default_rng(1)
    centers = np.exp(-2.0 * np.linspace(0.0, 1.0, 5))
    return MotionPlan(
        coordinates=("x", "y", "z"),
        duration_s=1.5,
        tau_scale=1.0,
        stiffness=1000.0,
        phase_decay=2.0,
        start_m=np.zeros(3),
        start_velocity_m_s=np.zeros(3),
        goal_m=rng.normal(size=3),
        goal_velocity_m_s=np.zeros(3),
        weights=rng.normal(size=(3, 5)),
        centers=centers,
        widths=np.abs(np.gradient(centers)),
        variation=rng.normal(size=(2, 1 + 3 * 8)),
    )


def _log(folder: Path) -> bytes:
    path = folder / "made.mcap"
    part = DurableAppendFile(folder / "made.part")
    log = McapLog({"/learn/rollout": RolloutMessage}, part)
    for number in range(30):
        log.write("/learn/rollout", 0.1 * number, RolloutMessage(number, True, 1.0, False, 2.0, 0.3, 4))
    log.finish(path, stage="learn", settings={"learn": {"alpha": 0.5}}, metrics={"n": 30})
    return path.read_bytes()


def _recorded(folder: Path) -> bytes:
    path = folder / "recorded.mcap"
    log = McapLog(CAPTURE.topics, DurableAppendFile(folder / "recorded.part"))
    rows = np.loadtxt(sorted(bundled_root().glob("data/demonstrations/*.csv"))[0], delimiter=",", skiprows=3)
    for t_s, *place in rows:
        log.write("/capture/cup", t_s, FrameTransform("world", "a", np.array(place), np.array([1.0, 0.0, 0.0, 0.0])))
    log.finish(path, stage="capture", settings={}, metrics={})
    return path.read_bytes()


def _calibration() -> bytes:
    stereo = yaml.safe_load((bundled_root() / "conf/camera/rig/stereo.yaml").read_text())
    return yaml.safe_dump({"cameras": stereo["cameras"]}, sort_keys=False).encode()


def _colour() -> bytes:
    return LearnedColour(np.zeros((HUES, SATURATIONS)), 30).to_json().encode()


def _policy(folder: Path, name: str) -> bytes:
    place = folder / "policy"
    if not place.exists():
        place.mkdir()
        policy = PolicyArtifact.seal("table", {"learn": {"bins": [1, 2]}}, {"q": np.arange(12.0).reshape(3, 4)})
        save_artifact(PolicyArtifact, policy, place)
    return (place / name).read_bytes()


def _load(folder: Path, other: str) -> Callable[[Path], object]:
    sound = folder / "policy" / other

    def read(path: Path) -> object:
        (path.parent / other).write_bytes(sound.read_bytes())
        return load_policy(str(path.parent / "artifact.json"))

    return read


def _hand(settings: Mapping[str, Any]) -> Callable[[Path], object]:
    capture = settings["capture"]

    def read(path: Path) -> object:
        hands = open_files(dataclasses.replace(capture, path=str(path)))
        return [list(hand.samples()) for hand in hands]

    return read


def _show(path: Path) -> None:
    command("motion", "show", str(path))


def _choice(folder: Path, group: str) -> Callable[[Path], object]:
    def read(path: Path) -> None:
        place = folder / "conf" / group
        place.mkdir(parents=True, exist_ok=True)
        path.replace(place / path.name)
        try:
            command("config", f"{group}={path.stem}")
        finally:
            (place / path.name).unlink()

    return read


def _first(path: Path) -> None:
    place = path.parent / "conf"
    place.mkdir(exist_ok=True)
    path.replace(place / path.name)
    try:
        command("config", "--config-dir", str(path.parent))
    finally:
        (place / path.name).unlink()


def _robot(settings: Mapping[str, Any]) -> Callable[[Path], object]:
    robot, game = settings["robot"], settings["game"]

    def read(path: Path) -> object:
        arm = RobotModel(dataclasses.replace(robot, path=str(path)), game.cup, game.gravity_m_s2)
        return arm.new_body().skeleton.getMassMatrix()

    return read


def _override(path: Path) -> None:
    text = path.read_bytes().decode(errors="surrogateescape").replace("\0", "")
    command("config", "--", text)
    command("plan", "-p", "imitation", "--", text)
