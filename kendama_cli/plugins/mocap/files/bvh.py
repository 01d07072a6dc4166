"""Tracks of a skeleton's joints from BVH (Biovision hierarchy), whose unit the caller knows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.text_table import number
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array

CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
REMEDY = "export it again as BVH, or as CSV with the columns t_s,x_m,y_m,z_m"


@dataclass
class _Joint:
    name: str
    parent: int | None
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[str] = field(default_factory=list)


def read_bvh(path: str, text: str, scale_m: float) -> list[BodyTrack]:
    """Return a body per joint, its places times ``scale_m``; raises InputError for a file that is damaged.

    A joint's frame in its parent's is its offset (or its position channels), then its rotation channels in their
    order, each about the axes turned by those before (M. Meredith, S. Maddock, Motion Capture File Formats Explained,
    2001).
    """
    try:
        words = iter(text.split())
        joints = _hierarchy(words)
        facts = [next(words) for _ in range(5)]  # Frames: N Frame Time: s
        count, step_s = int(facts[1]), float(facts[4])
        width = sum(len(joint.channels) for joint in joints)
        values = [number(word) for word in words]
    except (StopIteration, ValueError, IndexError):
        raise InputError(path, "the BVH is damaged: its hierarchy or head ends early", remedy=REMEDY) from None
    if not step_s > 0 or width == 0 or count < 1 or len(values) != count * width or None in values:
        problem = f"{len(values)} numbers in {count} frames of {width} channels every {step_s:g} s"
        raise InputError(path, f"the BVH is damaged: {problem}", remedy=REMEDY)
    return _tracks(joints, np.array(values, dtype=np.float64).reshape(count, width), step_s, scale_m)


def _hierarchy(words: Iterator[str]) -> list[_Joint]:
    """Read the joints up to the word MOTION; an end site has no channels and is no joint."""
    joints: list[_Joint] = []
    above: list[int | None] = []
    opened: int | None = None
    for word in words:
        if word in ("ROOT", "JOINT"):
            joints.append(_Joint(next(words), above[-1] if above else None))
            opened = len(joints) - 1
        elif word == "End":
            next(words)
            opened = None
        elif word == "{":
            above.append(opened)
        elif word == "}":
            above.pop()
        elif word == "OFFSET":
            three = [float(next(words)) for _ in range(3)]
            if above[-1] is not None:
                joints[above[-1]].offset = three
        elif word == "CHANNELS":
            names = [next(words) for _ in range(int(next(words)))]
            if above[-1] is None or not set(names) <= set(CHANNELS):
                raise ValueError(names)
            joints[above[-1]].channels = names
        elif word == "MOTION":
            return joints
    raise ValueError("no MOTION")


def _tracks(joints: list[_Joint], values: Array, step_s: float, scale_m: float) -> list[BodyTrack]:
    first = 0
    t_s: Array = step_s * np.arange(len(values), dtype=np.float64)
    places: list[Array] = []
    bodies: list[BodyTrack] = []
    turns: list[Rotation] = []
    for joint in joints:
        own = dict(zip(joint.channels, values[:, first : first + len(joint.channels)].T, strict=True))
        first += len(joint.channels)
        place: Array = np.tile(np.array(joint.offset), (len(values), 1))
        for i, axis in enumerate("XYZ"):
            place[:, i] = own.get(f"{axis}position", place[:, i])
        turn = Rotation.identity(len(values))
        for name in joint.channels:
            if name.endswith("rotation"):
                turn = turn * Rotation.from_euler(name[0], own[name][:, None], degrees=True)
        if joint.parent is not None:
            place = places[joint.parent] + np.asarray(turns[joint.parent].apply(place))
            turn = turns[joint.parent] * turn
        places.append(place)
        turns.append(turn)
        scaled: Array = np.asarray(scale_m * place)
        wxyz: Array = np.asarray(turn.as_quat(scalar_first=True))
        bodies.append(BodyTrack(joint.name, t_s, scaled, wxyz))
    return bodies
