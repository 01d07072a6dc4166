"""hardware=franka against a program of others: ``franka-sim``, with the limits that a real arm enforces."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.plugins.franka.robot import open_franka
from kendama_cli.plugins.suites.robot import CHECKS
from tests.plugins.franka.arm import FR3, FRANKA, GAME
from tests.plugins.franka.test_control_loop import START, swing

pytestmark = [pytest.mark.slow, pytest.mark.realtime]
SERVE = """
import os, pathlib, sys, time
import xml.etree.ElementTree as ET
import franka_sim, mujoco
from franka_sim import franka_sim_server, mujoco_franka_sim, run_server
from franka_sim.server import motion_session, state_stream

tree = ET.parse(pathlib.Path(franka_sim.__file__).parent / "models" / "fr3.urdf")
root = tree.getroot()
for link in root.findall("link"):  # its meshes are not in the package
    for part in link.findall("visual") + link.findall("collision"):
        link.remove(part)
made = ET.SubElement(root, "mujoco")
ET.SubElement(made, "compiler", balanceinertia="true", discardvisual="true", fusestatic="false")
spec = mujoco.MjSpec.from_string(ET.tostring(root, "unicode"))
for joint in spec.joints:  # as MuJoCo Menagerie's fr3
    joint.damping, joint.armature, joint.frictionloss = 0.21, 0.195, 0.2
spec.compile()
file = pathlib.Path("fr3.xml").resolve()
file.write_text(spec.to_xml())
os.environ["FR3_MJCF"] = str(file)
class SlowClock:
    def __getattr__(self, name):
        return getattr(time, name)

    def sleep(self, seconds):
        time.sleep(SLOWER * seconds)

    def perf_counter(self):
        return time.perf_counter() / SLOWER

SLOWER = float(os.environ["SLOWER"])
for module in (mujoco_franka_sim, motion_session, state_stream):
    module.time = SlowClock()
server = franka_sim_server.FrankaSimServer
defaults = list(server.__init__.__defaults__)
assert defaults[0] == "0.0.0.0"
server.__init__.__defaults__ = ("127.0.0.1", *defaults[1:])
sys.argv[1:] = ["--no-gripper"]
sys.exit(run_server.main())
"""
ENFORCED = {"FRANKA_SIM_ENFORCE_COMM_CONSTRAINTS": "1", "FRANKA_SIM_ENFORCE_MOTION_LIMITS": "1"}
SLOWER = 10
"""The arm's clock runs so much slower: two threads that others use too are no controller's computer."""
PATIENT = dataclasses.replace(FRANKA, reply_s=0.004)


def install(*arguments: str) -> None:
    """pip, or a skipped test where nothing can be installed."""
    done = subprocess.run([*arguments], capture_output=True, check=False)
    if done.returncode != 0:
        pytest.skip(f"cannot be installed here: {done.stderr.decode().strip().splitlines()[-1]}")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """franka-sim on loopback in an environment of its own, and the library where this one finds it."""
    folder = tmp_path_factory.mktemp("franka")
    venv.create(folder / "sim", with_pip=True)
    python = folder / "sim" / "bin" / "python"
    install(str(python), "-m", "pip", "install", "-q", "franka-sim==1.1.7")
    library = folder / "library"
    install(
        *(str(python), "-m", "pip", "install", "-q", "--no-deps", "--target", str(library), "pylibfranka>=0.21.3,<1")
    )
    log = (folder / "log").open("w")
    process = subprocess.Popen(
        [str(python), "-c", SERVE],
        cwd=folder,
        stdout=log,
        stderr=log,
        env={**os.environ, **ENFORCED, "SLOWER": str(SLOWER)},
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(library))
        patch.setattr(sys, "path", [str(library), *sys.path])
        try:
            check = folder / "sim" / "bin" / "franka-sim-check"
            subprocess.run([str(check), "--host", "127.0.0.1", "--timeout", "60"], check=True)
            yield
        finally:
            process.kill()
            process.wait()
            log.close()


@pytest.mark.usefixtures("arm")
def test_a_motion_is_played_without_a_reflex() -> None:
    with open_franka(PATIENT, FR3, GAME) as robot:
        robot.reset(START, 0)
        for wanted in swing():
            done = robot.exchange(JointCommand(wanted.position_rad, wanted.velocity_rad_s, np.zeros(7)))
            assert np.abs(done.state.position_rad - done.sent.position_rad).max() < 0.05
        assert done.t_s == pytest.approx((len(swing()) + robot.missed) * robot.period_s, abs=1.0)
        assert done.state.external_nm is not None


@pytest.mark.usefixtures("arm")
def test_the_bundled_swing_is_imitated_whole(tmp_path: Path) -> None:
    """From the demonstrations to the arm at the motion's own speed, as docs/plugins/franka.md tells."""
    where = ["hardware.host=127.0.0.1", "hardware.realtime=ignore", f"hardware.reply_s={PATIENT.reply_s}"]
    command = [sys.executable, "-m", "kendama_cli.cli.main", "run", "-p", "rehearsal", "robot=fr3", "hardware=franka"]
    words = [*where, "hardware.silence_s=5", "hardware.wait_s=30", "rehearse.speed=1.0", "--arm", "--json"]
    done = subprocess.run([*command, *words, "--home", str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (rehearsed,) = [one["metrics"] for one in json.loads(done.stdout)["stages"] if one["name"] == "rehearse"]
    assert rehearsed["completed"]
    assert rehearsed["played_s"] > 2.0
    assert rehearsed["tracking_error_max_mrad"] < 50


@pytest.mark.usefixtures("arm")
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_franka_keeps_the_laws_of_a_robot(check) -> None:
    quick = dataclasses.replace(PATIENT, approach_rad_s=1.5)
    check(lambda: open_robot(quick, FR3, GAME))
