"""``kendama robot place``: where an arm should stand for a motion, as a table and as a node of the configuration."""

from __future__ import annotations

import dataclasses
import math
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.cli import render
from kendama_cli.cli.describe import place_command
from kendama_cli.cli.pipeline_result import run_for
from kendama_cli.config.site import Site
from kendama_cli.errors import UsageError
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.robot_model.description import read_lines
from kendama_cli.robot_model.placement.find_placement import PlacedMotion, find_placement, measured, require_workable
from kendama_cli.settings.placement import placed
from kendama_cli.store.durable import write_file

TURNS_DEG = 3600.0
"""More than any arm turns between its stops."""


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
    kept = adapt.line if options.line else None

    def show_progress(done: int, total: int, cost: float) -> None:
        render.note(f"place: {done}/{total}, {'nothing reaches yet' if cost >= 1e1 else f'peak {cost:.3f}'}")

    try:
        found = find_placement(robot, game, plan, lead_in, line=kept, effort=options.effort, progress=show_progress)
    except SystemError as error:  # how compiled code that was interrupted ends
        raise KeyboardInterrupt from error
    arm = placed(robot, found)
    motion = measured(arm, game, plan, lead_in, adapt.tau_range[1])
    if options.as_json:
        render.document(_document(motion))
    else:
        _show(motion)
        for line in read_lines(arm):
            render.text(line)
    require_workable(arm, motion)
    if output is not None:
        _write(output, made.config["robot"] | {"name": output.stem}, motion)
        words = shlex.join(["kendama", "run", "-p", pipeline, *_others(overrides), f"robot={output.stem}"])
        render.note(f"written to {output}; next: {words}")
    else:
        render.note(f"nothing is written; next: {place_command(robot, overrides)}")


def _others(overrides: list[str]) -> list[str]:
    """Return the overrides that are not of the arm: its file holds them now."""
    return [one for one in overrides if one.partition("=")[0].partition(".")[0] != "robot"]


def _rows(motion: PlacedMotion) -> list[dict[str, Any]]:
    shares = motion.shares
    columns = (shares.joint_names, shares.velocity, shares.acceleration, shares.effort, shares.to_stop_rad)
    return [
        {
            "joint": name,
            "speed": float(speed),
            "acceleration": float(change),
            "effort": float(effort),
            "to_stop_deg": math.degrees(float(stop)),
        }
        for name, speed, change, effort, stop in zip(*columns, strict=True)
    ]


def _document(motion: PlacedMotion) -> dict[str, Any]:
    return {
        "placement": dataclasses.asdict(motion.placement),
        "joints": _rows(motion),
        "leading": [dataclasses.asdict(one) for one in motion.shares.leading],
        "clearance": dataclasses.asdict(motion.clearance),
        "min_tau_scale": motion.min_tau_scale,
        "tau_scale": motion.tau_scale,
    }


def _show(motion: PlacedMotion) -> None:
    leading = {(one.kind, one.joint) for one in motion.shares.leading}
    rows = []
    for row in _rows(motion):
        shares = [
            f"{row[kind]:.2f}{' <' if (kind, row['joint']) in leading else ''}"
            for kind in ("speed", "acceleration", "effort")
        ]
        endless = row["to_stop_deg"] > TURNS_DEG  # a continuous joint has no stop
        rows.append((row["joint"], *shares, "none" if endless else f"{row['to_stop_deg']:.0f} deg"))
    render.table(rows, head=("joint", "speed", "acceleration", "effort", "to stop"))
    clear = motion.clearance
    render.text(f"peaks over limits at tau_scale {motion.tau_scale:.2f}; < leads")
    render.text(f"clearance {1e3 * clear.gap_m:.0f} mm between {clear.parts} at {clear.t_s:.2f} s")
    render.text(f"could be played down to tau_scale {motion.min_tau_scale:.2f}")


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
