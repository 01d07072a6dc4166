"""``kendama robot urdf``: a URDF of the arm in a MuJoCo model."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.errors import InputError, UsageError
from kendama_cli.schema.units import count_of


def robot_urdf(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="An MJCF file, or a folder of MuJoCo Menagerie.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The URDF to write.")],
    speed: Annotated[
        str, typer.Option(metavar="RAD_S", help="Speed limits, which an MJCF lacks: one, or one a joint with commas.")
    ] = "",
) -> None:
    """Write a URDF of the arm in a MuJoCo model, and show how to place it (extra 'mujoco').

    Example: kendama robot urdf mujoco_menagerie/universal_robots_ur5e --speed 3.14 -o ur5e.urdf
    """
    from kendama_cli.plugins.mujoco.files import arm_files
    from kendama_cli.plugins.mujoco.urdf import arm_urdf  # numpy, scipy and MuJoCo
    from kendama_cli.robot_model.arm_choice import choose_arm, is_free
    from kendama_cli.robot_model.urdf_tree import read_tree
    from kendama_cli.store.durable import write_file

    try:
        speeds = tuple(float(one) for one in speed.split(",") if one)
    except ValueError:
        raise UsageError(f"--speed {speed}: type numbers in rad/s with commas between, as in 3.14,3.14,2") from None
    if model.is_dir():
        files = arm_files(model)
        if len(files) != 1:
            told = f"name one: {', '.join(map(str, files))}" if files else "it has no model of an arm; name a file"
            raise InputError(str(model), f"has {len(files)} models of arms", remedy=told)
        (model,) = files
    made = arm_urdf(str(model), output.stem)
    write_file(output.absolute(), made.text.encode())
    tree = read_tree(str(output))
    tip, _, doubt = choose_arm(tree, ())
    chain = [one for one in tree.chain(tip) if is_free(one, ())]
    joints = [one.get("name", "") for one in chain]
    render.text(f"{model}: {count_of(len(joints), 'joint')} to '{tip}': {', '.join(joints)}")
    if len(speeds) not in (0, 1, len(joints)):
        raise UsageError(f"--speed {speed}: {len(speeds)} values for {len(joints)} joints; give one, or one a joint")
    tops = speeds * (len(joints) if len(speeds) == 1 else 1) or ("?",) * len(joints)
    words = [
        "kendama",
        "robot",
        "place",
        "-p",
        "perform",
        "robot=urdf",
        f"robot.path={output}",
        *([f"robot.tip_link={tip}"] if doubt else []),
        _row("velocity_rad_s", tops),
    ]
    if any((limit := one.find("limit")) is None or limit.get("effort") is None for one in chain):
        words.append(_row("effort_nm", ("?",) * len(joints)))
    rotors = tuple(made.rotor_inertia_kg_m2[one] for one in joints)
    words += [_row("rotor_inertia_kg_m2", rotors)] if any(rotors) else []
    words += ["-o", f"conf/robot/{output.stem}.yaml"]
    if doubt:
        render.note(f"{output}: {doubt}")
    render.note(f"written to {output}; next: {shlex.join(words)}")


def _row(key: str, values: tuple[float | str, ...]) -> str:
    return f"robot.{key}=[{','.join(one if isinstance(one, str) else f'{one:g}' for one in values)}]"
