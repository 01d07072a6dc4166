"""``kendama robot recover``: out of a latched stop, without moving."""

from __future__ import annotations

from kendama_cli.cli import render
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.devices.robot.interface import RecoverableRobot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings


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
