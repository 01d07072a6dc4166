"""``kendama robot check``: whether the imitated swing keeps to what the arm and its room allow."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.cli import render
from kendama_cli.cli.progress import PlainLines, observer
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.errors import StageError
from kendama_cli.game.imitation import stretched
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import begin
from kendama_cli.pipeline.runner import Runner
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.placement import placed
from kendama_cli.simulation.placement.motion_check import CheckedLimit, check_motion
from kendama_cli.store.codecs import load_artifact
from kendama_cli.store.store import Store

PIPELINE = "imitation"
SPEEDS = (0.1, 0.3, 1.0)
PERIOD_S = 0.004


def check(site: Site, overrides: list[str], *, as_json: bool) -> int:
    """Adapt the configured demonstrations to the arm, check at every speed of the first tries, show; the exit code.

    Raises what the stages raise.
    """
    declared = load_pipeline(PIPELINE, site.pipeline_folders)
    settings = build_settings(composed(site, [*declared.overrides, *overrides]))
    planner = Planner(Store(site.home), declared, settings, site.data_roots)
    record = begin(site.home, PIPELINE, overrides)
    with PlainLines() if as_json else observer() as view:
        Runner(planner, record, view).run()
    last = record.stages[-1]
    if record.outcome != "done" or last.artifact is None:
        raise StageError(last.error or f"{last.name} gave nothing")
    motion = load_artifact(CatchMotion, Path(last.artifact))
    robot = placed(resolve_files(settings["robot"], "robot", site.data_roots), motion.placement)
    game, safety = settings["game"], settings["safety"]
    arm = RobotModel(robot, game.cup, game.gravity_m_s2)
    checked = {
        speed: check_motion(arm, game, stretched(motion.joints, 1.0 / speed, PERIOD_S), safety) for speed in SPEEDS
    }
    wrong = {speed: [one for one in found if not one.holds] for speed, found in checked.items()}
    if as_json:
        render.document({str(speed): [dataclasses.asdict(one) for one in found] for speed, found in checked.items()})
    else:
        _show(checked)
    if any(wrong.values()):
        return 1
    if not as_json:
        render.note(f"{robot.name} may play it; first without the ball: docs/first-time-on-an-arm.md")
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
