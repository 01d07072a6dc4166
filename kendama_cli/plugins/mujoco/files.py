"""Files of a MuJoCo model: the arm's in a folder as MuJoCo Menagerie has it, and what a file brings along.

Of the standard library only: a pipeline is planned with it.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from pathlib import Path

from kendama_cli.plugins.mujoco.settings import MujocoHardware
from kendama_cli.schema.units import count_of

FEWEST_JOINTS = 4
"""A model with fewer joints is a hand."""
BARE = "nohand"
"""Part of the name of an arm's file without its hand, in whose place the cup is held."""
OTHERS = ("mjx", "scene")
"""Beginnings of names of files for another engine, or with a room about the arm."""
FILES = ("include", "mesh", "texture", "hfield", "skin", "model")
FOLDERS = ("meshdir", "texturedir", "assetdir")
"""Elements of an MJCF that name files, and the attributes of its compiler that name their folders."""


def arm_files(folder: Path) -> list[Path]:
    """Return the models of arms in ``folder``: the one that is meant, or all among which somebody must choose.

    An arm has actuators and joints of its own. Where one of several is named as the arm without its hand, that is it.
    """
    found = [one for one in sorted(folder.glob("*.xml")) if not one.stem.startswith(OTHERS) and _is_arm(one)]
    bare = [one for one in found if BARE in one.stem]
    return bare if len(bare) == 1 else found


def read_lines(hardware: MujocoHardware) -> list[str]:
    """Return what a run says of the model in the closing lines."""
    path = Path(hardware.model)
    servos = "; its motors take torques, so position servos of ours turn them" if has_motors(path) else ""
    read = count_of(len(brought_files(path)), "file")
    return [f"hardware: {path.name} of {path.parent.name}, with {read} that it reads{servos}"]


def brought_files(path: Path) -> list[Path]:
    """Return the files that there are of those that the model at ``path`` names, and that those name: parts, meshes."""
    found: set[Path] = set()
    waiting, folders = [path], {path.parent}
    while waiting:
        current = waiting.pop()
        folders.add(current.parent)  # an included file's "../meshes" begins there
        root = _read(current)
        elements = [] if root is None else list(root.iter())
        named = (one.get(key) for one in elements if one.tag == "compiler" for key in FOLDERS)
        folders |= {path.parent / name for name in named if name}
        names = {name for one in elements if one.tag in FILES and (name := one.get("file"))}
        paths = {Path(os.path.normpath(folder / name)) for folder in folders for name in names}
        there = {one for one in paths if one.is_file()} - found - {path}
        found |= there
        waiting += [one for one in there if one.suffix == ".xml"]
    return sorted(found)


def has_motors(path: Path) -> bool:
    """Return True if all actuators of joints in the model at ``path`` are motors that take torques, <motor>."""
    roots = [_read(one) for one in (path, *brought_files(path)) if one.suffix == ".xml"]
    lists = [made for root in roots if root is not None for made in root.iter("actuator")]
    kinds = {one.tag for made in lists for one in made if one.get("joint")}
    return kinds == {"motor"}


def _is_arm(path: Path) -> bool:
    root = _read(path)
    if root is None or root.find("actuator") is None:
        return False
    body = root.find("worldbody")
    return body is not None and sum(1 for _ in body.iter("joint")) >= FEWEST_JOINTS


def _read(path: Path) -> ET.Element | None:
    """Return the root of an MJCF; None for any other file, of which MuJoCo says what is wrong."""
    try:
        root = ET.parse(path).getroot()
    except (OSError, ET.ParseError, ValueError):
        return None
    return root if root.tag in ("mujoco", "mujocoinclude") else None
