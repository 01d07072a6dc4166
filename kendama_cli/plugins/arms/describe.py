"""``kendama robot describe``: what is read of a robot's description, where each figure comes from, what is missing."""

from __future__ import annotations

import shlex
from typing import Any

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.cli import render
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.errors import InputError, KendamaError
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.arms.limit_table import document_of, show_motion
from kendama_cli.plugins.arms.pipeline_result import run_for
from kendama_cli.robot_model.composed import link_poses
from kendama_cli.robot_model.description import Description, describe_arm
from kendama_cli.robot_model.model import TOP_SPEED_WITHIN_S, RobotModel
from kendama_cli.robot_model.placement.find_placement import PlacedMotion, measured
from kendama_cli.settings.robot import RobotSettings

PIPELINE = "imitation"
COLUMNS = {
    "type": "type",
    "lower_rad": "lower",
    "upper_rad": "upper",
    "velocity_rad_s": "speed",
    "acceleration_rad_s2": "accel.",
    "effort_nm": "effort",
    "rotor_inertia_kg_m2": "rotor",
    "coulomb_nm": "dry",
    "viscous_nm_s": "viscous",
}


def describe(site: Site, overrides: list[str], *, as_json: bool) -> int:
    """Read the configured robot, show all that was read of it; the exit code is 2 where it cannot be simulated.

    Of an arm that stands somewhere (robot.home_rad) the demand of the configured swing is shown too.
    """
    settings = build_settings(composed(site, overrides))
    robot, game = resolve_files(settings["robot"], "robot", site.data_roots), settings["game"]
    document: dict[str, Any] = {"robot": robot.called, "path": robot.path, "root_link": None, "joints": []}
    document |= {"tip_link": None, "tip_at_zero_m": None, "refused": None}
    try:
        found = describe_arm(robot)
        document |= _figures(found, robot)
        RobotModel(robot, game.cup, game.gravity_m_s2)
    except InputError as error:
        document["refused"] = str(error)
    swing: PlacedMotion | str | None = None
    if document["refused"] is None and robot.home_rad is not None:
        swing = _swing(site, robot, overrides, as_json=as_json)
    if as_json:
        render.document(document | {"swing": document_of(swing) if isinstance(swing, PlacedMotion) else swing})
    else:
        _show(document)
        if isinstance(swing, PlacedMotion):
            render.text("the swing at this placement, in fractions of the limits:")
            show_motion(swing, settings["adapt"])
        elif swing is not None:
            render.prose(f"the swing at this placement: {swing}")
        if document["refused"] is None:
            fits = isinstance(swing, PlacedMotion) and swing.workable
            run = shlex.join(["kendama", "run", "-p", PIPELINE, *overrides])
            render.text(f"next: {run if fits else place_command(robot, overrides)}")
    return 0 if document["refused"] is None else InputError.exit_code


def _swing(site: Site, robot: RobotSettings, overrides: list[str], *, as_json: bool) -> PlacedMotion | str:
    """Return the demand of the swing that PIPELINE makes, or the reason why there is none."""
    try:
        made = run_for(MotionPlan, site, PIPELINE, overrides, as_json=as_json)
        adapt = made.settings["adapt"]
        plan = scaled_plan(made.artifact, adapt.swing_scale, adapt.tau_start)
        return measured(robot, made.settings["game"], plan, adapt.lead_in_m_s2, adapt.tau_range[1])
    except KendamaError as error:
        return str(error)


def place_command(robot: RobotSettings, overrides: list[str]) -> str:
    """Return the command that finds where ``robot`` should stand, and writes it under a name that is free."""
    name = robot.called if robot.called != robot.name else f"my_{robot.called}"
    return shlex.join(["kendama", "robot", "place", *overrides, "-o", f"conf/robot/{name}.yaml"])


def _figures(found: Description, robot: RobotSettings) -> dict[str, Any]:
    n, names = len(found.joints), found.joint_names
    try:
        _, places = link_poses(found.tree, names, np.zeros((1, n)))[found.tip_link]
        tip_m = places[0].tolist()
    except ValueError:  # not made of numbers, which is among what is missing
        tip_m = None
    columns: dict[str, Any] = {"type": [joint.get("type") for joint in found.joints], **found.limits, **found.friction}
    speeds = found.limits["velocity_rad_s"]
    columns["acceleration_rad_s2"] = robot.acceleration_rad_s2 or tuple(top / TOP_SPEED_WITHIN_S for top in speeds)
    columns["rotor_inertia_kg_m2"] = robot.rotor_inertia_kg_m2 or (0.0,) * n
    thumb = "robot.acceleration_rad_s2" if robot.acceleration_rad_s2 else f"a rule of thumb, {TOP_SPEED_WITHIN_S} s"
    sources = {**found.sources, "acceleration_rad_s2": thumb}
    sources["rotor_inertia_kg_m2"] = "robot.rotor_inertia_kg_m2" if robot.rotor_inertia_kg_m2 else "none given"
    others = [joint for joint in found.tree.joints if joint.get("type") != "fixed" and joint not in found.joints]
    return {
        "root_link": found.tree.root,
        "joints": list(names),
        "tip_link": found.tip_link,
        "tip_at_zero_m": tip_m,
        "figures": {key: [None if one != one else one for one in columns[key]] for key in COLUMNS},  # noqa: PLR0124
        "sources": sources,
        "held_at_zero": [joint.get("name") for joint in others],
        "assumed": list(found.assumed),
        "doubtful": list(found.doubtful),
        "missing": list(found.missing),
    }


def _show(document: dict[str, Any]) -> None:
    render.prose(f"{document['robot']}: {document['path']}")
    if document["joints"]:
        columns = [[_cell(one) for one in document["figures"][key]] for key in COLUMNS]
        rows = [tuple(map(str, row)) for row in zip(document["joints"], *columns, strict=True)]
        render.table(rows, head=("joint", *COLUMNS.values()))
        render.prose("in rad, rad/s, rad/s^2, Nm, kg m^2 (on the diagonal of H), Nm of dry friction, Nm s/rad; from:")
        for key, source in document["sources"].items():
            render.prose(f"  {COLUMNS[key]}: {source}")
    if (tip_m := document["tip_at_zero_m"]) is not None:
        x, y, z = (f"{one + 0.0:.4f}" for one in tip_m)
        root = document["root_link"]
        render.prose(f"tip: '{document['tip_link']}', with all joints at 0 at ({x}, {y}, {z}) m from '{root}'")
    for key in ("held_at_zero", "assumed", "doubtful"):
        if told := document.get(key):
            render.prose(f"{key.replace('_', ' ')}: {', '.join(told) if key == 'held_at_zero' else '; '.join(told)}")
    render.prose(f"refused: {document['refused']}" if document["refused"] else "can be simulated")


def _cell(value: Any) -> str:
    return "-" if value is None else value if isinstance(value, str) else f"{value:.4g}"
