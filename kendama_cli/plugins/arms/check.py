"""The check of an imitated swing before an arm plays it, and recovery from a latched stop, which moves nothing."""

from __future__ import annotations

import dataclasses

from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.cli import render
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.control.imitation import stretched
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.devices.robot.interface import RecoverableRobot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.arms.pipeline_result import run_for
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import CheckedLimit, check_motion
from kendama_cli.settings.placement import placed

SPEEDS = (0.1, 0.3, 1.0)
PERIOD_S = 0.004


def check(site: Site, pipeline: str, overrides: list[str], *, as_json: bool) -> int:
    """Make the pipeline's motion of the arm, check at every speed of the first tries, show; the exit code.

    Raises what the stages raise.
    """
    made = run_for(CatchMotion, site, pipeline, overrides, as_json=as_json)
    motion, settings = made.artifact, made.settings
    robot = placed(resolve_files(settings["robot"], "robot", site.data_roots), motion.placement)
    game, safety = settings["game"], settings["safety"]
    arm = RobotModel(robot, game.cup, game.gravity_m_s2)
    checked = {
        speed: check_motion(arm, game, stretched(motion.joints, 1.0 / speed, PERIOD_S), safety) for speed in SPEEDS
    }
    seen: tuple[str, ...] = ()
    if all(one.holds for one in checked[1.0]):
        around = Surroundings(arm, game, settings["adapt"], safety)
        _, seen = around.correction(motion.joints, follow_from_s(motion))
    wrong = {speed: [one for one in found if not one.holds] for speed, found in checked.items()}
    if as_json:
        render.document({str(speed): [dataclasses.asdict(one) for one in found] for speed, found in checked.items()})
    else:
        _show(checked)
    if any(wrong.values()):
        return 1
    if not as_json:
        for line in seen:
            render.note(line)
        render.note(f"{robot.called} may play it; first without the ball: docs/howto/first-time-on-an-arm.md")
    return 0


def _show(checked: dict[float, list[CheckedLimit]]) -> None:
    fastest = max(checked)
    shown = [(fastest, one) for one in checked[fastest]]
    shown += [(speed, one) for speed, found in checked.items() if speed != fastest for one in found if not one.holds]
    rows = [
        ("" if one.holds else "NOT ALLOWED", f"{100 * speed:g} %", one.what, one.allowed, one.found)
        for speed, one in shown
    ]
    render.table(rows, head=("", "speed", "limit", "allowed", "found"))


def recover(site: Site, overrides: list[str], *, armed: bool) -> None:
    """Open the configured robot, which begins a session, and have it recover where it can.

    Raises UsageError where it may be real and is not armed, HardwareError where it still stops.
    """
    settings = build_settings(composed(site, overrides))
    hardware = settings["hardware"]
    if getattr(type(hardware), "moves", True) and not armed:
        raise UsageError(f"robot '{hardware.kind}' may be real; look whether its surroundings are clear, and add --arm")
    robot = resolve_files(settings["robot"], "robot", site.data_roots)
    with open_robot(hardware, robot, settings["game"]) as opened:
        if isinstance(opened, RecoverableRobot):
            opened.recover()
        joints = len(opened.joint_names)
        render.text(f"{hardware.kind}: takes commands again, {joints} joints every {1e3 * opened.period_s:g} ms")
