"""``kendama robot place``: where an arm should stand for a motion, as a table and as a node of the configuration."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.cli import render
from kendama_cli.config.site import Site
from kendama_cli.errors import StageError, UsageError
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.plugins.arms.describe import place_command
from kendama_cli.plugins.arms.limit_table import document_of, show_motion, size_command, size_words
from kendama_cli.plugins.arms.pipeline_result import PipelineResult, run_for
from kendama_cli.plugins.arms.smaller_game import SmallerGame, find_smaller_game
from kendama_cli.robot_model.description import read_lines
from kendama_cli.robot_model.placement.find_placement import PlacedMotion, find_placement, measured, require_workable
from kendama_cli.settings.placement import placed
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.store.durable import write_file


@dataclass(frozen=True)
class PlaceOptions:
    """Options of ``kendama robot place``."""

    output: Path | None
    line: bool
    effort: float
    as_json: bool


def place(site: Site, pipeline: str, overrides: list[str], options: PlaceOptions) -> None:
    """Make the pipeline's primitive, search, show the table, and write the node where ``options.output`` is given.

    Raises what the stages raise, StageError where no placement is workable, UsageError where the node cannot be
    written; nothing is written then.
    """
    output = options.output
    if output is not None and output.suffix not in (".yaml", ".yml"):
        raise UsageError(f"-o {output}: a node is a YAML file; name it like conf/robot/mine.yaml")
    made = run_for(MotionPlan, site, pipeline, overrides, as_json=options.as_json)
    settings, adapt = made.settings, made.settings["adapt"]
    plan = scaled_plan(made.artifact, adapt.swing_scale, adapt.tau_start)
    robot = resolve_files(settings["robot"], "robot", site.data_roots)
    game, lead_in = settings["game"], adapt.lead_in_m_s2
    games = any(stage.name == "learn" for stage in load_pipeline(pipeline, site.pipeline_folders).stages)
    kept = adapt.line if options.line or games else None  # on which a policy swings up and catches

    def show_progress(done: int, total: int, cost: float) -> None:
        render.note(f"place: {done}/{total}, {'nothing reaches yet' if cost >= 1e1 else f'peak {cost:.3f}'}")

    try:
        found = find_placement(robot, game, plan, lead_in, line=kept, effort=options.effort, progress=show_progress)
        arm = placed(robot, found)
        motion = measured(arm, game, plan, lead_in, adapt.tau_range[1])
        smaller = None if motion.workable else _smaller(robot, plan, made, options, overrides)
    except StageError as error:  # out of reach: perhaps not in a smaller game
        told = size_words(_smaller(robot, plan, made, options, overrides), robot.called)
        raise StageError(f"{error}; {told}") from None
    except SystemError as error:  # how compiled code that was interrupted ends
        raise KeyboardInterrupt from error
    if options.as_json:
        render.document(document_of(motion) | {"smaller": smaller and document_of(smaller.motion)})
    else:
        show_motion(motion, adapt)
        for line in read_lines(arm):
            render.text(line)
    require_workable(arm, motion, size_words(smaller, robot.called))
    if output is not None:
        _write(output, made.config["robot"] | {"name": output.stem}, motion)
        words = shlex.join(["kendama", "run", "-p", pipeline, *_others(overrides), f"robot={output.stem}"])
        render.note(f"written to {output}; next: {words}")
    else:
        render.note(f"nothing is written; next: {place_command(robot, overrides)}")


def _smaller(
    robot: RobotSettings, plan: MotionPlan, made: PipelineResult, options: PlaceOptions, overrides: list[str]
) -> SmallerGame | None:
    """Return the smaller game that the arm can play, or nearly; show the command that places it for that."""
    game, adapt = made.settings["game"], made.settings["adapt"]

    def show_progress(size: float) -> None:
        render.note(f"place: it does not fit; a game {size:g} times as large")

    slowest = adapt.tau_range[1]
    found = find_smaller_game(
        robot, game, plan, adapt.lead_in_m_s2, slowest, effort=options.effort, progress=show_progress
    )
    if found is not None and found.motion.workable:
        render.note(f"next: {size_command(found, game, adapt, overrides)}")
    return found


def _others(overrides: list[str]) -> list[str]:
    """Return the overrides that are not of the arm: its file holds them now."""
    return [one for one in overrides if one.partition("=")[0].partition(".")[0] != "robot"]


def _write(output: Path, node: dict[str, Any], motion: PlacedMotion) -> None:
    one = motion.placement
    values = node | {
        "base_position_m": list(one.base_position_m),
        "base_heading_rad": one.base_heading_rad,
        "home_rad": list(one.home_rad),
        "redundancy_weights": list(one.redundancy_weights),
        "tool": {"handle_m": list(one.handle_m), "cup_axis": list(one.cup_axis)},
    }
    text = "# Placed by 'kendama robot place'.\n" + yaml.safe_dump(values, sort_keys=False, allow_unicode=True)
    write_file(output.absolute(), text.encode())
