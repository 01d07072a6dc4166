"""The figures of interact: where the tool went among the bodies, and what it exerted on them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from kendama_cli.motion.rotation import matrix_of
from kendama_cli.plugins.interact.messages import ContactMessage
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, GOOD, INK, LINE, MUTED, PAPER, SERIES
from kendama_cli.report.tables import number
from kendama_cli.report.tracks import Array
from kendama_cli.schema.foxglove import FrameTransform, JointStates

READABLE = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.2}
"""Box behind a text that must stay readable over lines."""
_ROUND = np.linspace(0.0, 2 * math.pi, 48, endpoint=False)


def interaction_figures(log: StageLog) -> list[Figure]:
    """Return the scene with the tool's path, and the contact; then friction, deviation and efforts."""
    contact = log.table("/interact/contact", ContactMessage)
    first = [_scene(log), _force(contact)]
    second = [_friction(log), _deviation(log), _efforts(log.table("/interact/joints", JointStates))]
    error = log.metrics.get("force_error_rms_n")
    ended = f" Where the desired force is constant, they differ by {number(error)} N rms." if error is not None else ""
    return [
        *figure(
            lettered(
                first,
                [
                    "Side view of the scene: the tool's path, thick where it was in contact. Bodies are grey, the dot"
                    " is the start.",
                    "Force of the tool on the bodies along the desired force (in all, if none is desired), and the"
                    f" desired force; the script's steps by name.{ended}",
                ],
            ),
            first,
        ),
        *figure(
            lettered(
                second,
                [
                    "Lateral over normal contact force while the tool presses: below the dashed line, the measured"
                    " friction, the tool sticks; on it, it slides.",
                    "Distance of the tool from its reference. Lateral: the springs yield to friction; along a desired"
                    " force nothing holds the tool to its reference.",
                    "Torque of each joint over time.",
                ],
            ),
            second,
            columns=3,
        ),
    ]


def _scene(log: StageLog) -> Panel | None:
    tool, contact = log.table("/interact/tool", FrameTransform), log.table("/interact/contact", ContactMessage)
    if len(tool) < 2:
        return None
    x, z = (tool[name].to_numpy(np.float64) for name in ("x_m", "z_m"))
    with drawing("interact-scene", "Side view of the tool's path among the bodies", height_in=3.6) as made:
        axes = made.axes()[0]
        axes.plot(x, z, color=CUP, lw=1.2, label="free")
        if len(contact) == len(tool):
            pressing = contact["body"].to_numpy() != ""
            axes.plot(np.where(pressing, x, np.nan), z, color=BALL, lw=2.6, label="in contact")
        axes.plot(x[:1], z[:1], "o", color=CUP, ms=4, label="_start")
        axes.margins(0.3, 0.3)
        axes.set_aspect("equal", adjustable="datalim")
        for body in log.settings.get("scene", {}).get("bodies", ()):
            # an artist, not a plot: what is shown follows the tool, however large a body is
            axes.add_artist(Polygon(_outline(body), facecolor=LINE, edgecolor=MUTED, lw=0.8, zorder=0.5))
        axes.set_xlabel("x [m]")
        axes.set_ylabel("z [m]")
        legend_above(axes)
    return made.panel("The tool among the bodies")


def _outline(body: Mapping[str, Any]) -> Array:
    """Return the outline (n, 2) in x and z of a body as the settings in the log have it."""
    size, shape = body["size_m"], body["shape"]
    ring = np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
    if shape == "sphere":
        circle: Array = np.array(body["position_m"])[[0, 2]] + size[0] * ring
        return circle
    if shape == "cylinder":
        ends = [np.column_stack([size[0] * ring, np.full(len(ring), s * size[1] / 2)]) for s in (-1, 1)]
        corners = np.vstack(ends)
    else:
        # of a plane, a piece that is larger than any scene
        x, y, top, bottom = (*(edge / 2 for edge in size), -size[2] / 2) if shape == "box" else (50.0, 50.0, 0.0, -50.0)
        corners = np.array(list(itertools.product((-x, x), (-y, y), (bottom, top))))
    seen: Array = (corners @ matrix_of(body["rotation_wxyz"]).T + np.array(body["position_m"]))[:, [0, 2]]
    return seen[ConvexHull(seen).vertices]


def _force(contact: pd.DataFrame) -> Panel | None:
    if contact.empty:
        return None
    t = contact["t_s"].to_numpy(np.float64)
    wanted, along = (contact[name].to_numpy(np.float64) for name in ("wanted_n", "along_n"))
    with drawing("interact-force", "Desired and exerted force over time", height_in=3.6) as made:
        axes = made.axes()[0]
        top = 1.3 * max(float(along.max()), float(wanted.max()), 1.0)
        for index, (start, end, name) in enumerate(_steps(contact)):
            if index % 2:
                axes.axvspan(start, end, color=LINE, alpha=0.45, lw=0)
            axes.text(
                (start + end) / 2, top * 0.99, name, rotation=90, ha="center", va="top", fontsize="small", color=MUTED
            )
        axes.plot(t, along, color=BALL, lw=1.3, label="exerted")
        axes.plot(t, wanted, color=INK, lw=1.0, ls=(0, (4, 3)), label="desired")
        axes.set_xlim(0, t[-1])
        axes.set_ylim(min(0.0, 1.1 * float(along.min())), top)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("force [N]")
        legend_above(axes)
    return made.panel("Desired and exerted force")


def _steps(contact: pd.DataFrame) -> Iterator[tuple[float, float, str]]:
    """Yield start, end and name of each step; two steps of one name side by side count as one."""
    t, names = contact["t_s"].to_numpy(np.float64), contact["step"].tolist()
    start = 0.0
    for i, name in enumerate(names):
        if i + 1 == len(names) or names[i + 1] != name:
            yield start, float(t[i]), str(name)
            start = float(t[i])


def _friction(log: StageLog) -> Panel | None:
    contact = log.table("/interact/contact", ContactMessage)
    if contact.empty:
        return None
    t, wanted, along, across = (
        contact[name].to_numpy(np.float64) for name in ("t_s", "wanted_n", "along_n", "across_n")
    )
    pressing = (wanted > 0.5 * wanted.max()) & (along > 0) & (contact["body"].to_numpy() != "")
    if not pressing.any():
        return None
    with drawing("interact-friction", "Contact force across over along, in time", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        ratio = np.full(len(t), np.nan)
        ratio[pressing] = across[pressing] / along[pressing]
        axes.plot(t, ratio, color=BALL, lw=1.1, label="_force ratio")
        measured = log.metrics.get("friction")
        if isinstance(measured, float):
            axes.axhline(measured, color=MUTED, lw=0.8, ls=(0, (4, 3)), label="_friction")
            axes.text(0.1 * t[-1], measured, f"{measured:.2f}", va="center", color=MUTED, bbox=READABLE)
        axes.set_xlim(0, t[-1])
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("lateral / normal force")
    return made.panel("Friction")


def _deviation(log: StageLog) -> Panel | None:
    tool, wanted = log.table("/interact/tool", FrameTransform), log.table("/interact/reference", FrameTransform)
    if len(tool) < 2 or len(tool) != len(wanted):
        return None
    t = tool["t_s"].to_numpy(np.float64)
    with drawing("interact-deviation", "Distance from the reference over time", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        for axis, colour in (("x", CUP), ("y", GOOD), ("z", BALL)):
            missing = tool[f"{axis}_m"].to_numpy(np.float64) - wanted[f"{axis}_m"].to_numpy(np.float64)
            axes.plot(t, 1e3 * missing, color=colour, lw=1.1, label=axis)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("tool less reference [mm]")
        legend_above(axes)
    return made.panel("Following the reference")


def _efforts(joints: pd.DataFrame) -> Panel | None:
    columns = [name for name in joints.columns if str(name).endswith(".effort_nm")]
    if not columns:
        return None
    with drawing("interact-efforts", "Joint torques over time", width_in=3.4, height_in=2.6) as made:
        axes = made.axes()[0]
        for index, name in enumerate(columns):
            label = str(name).removesuffix(".effort_nm")
            axes.plot(joints["t_s"], joints[name], color=SERIES[index % len(SERIES)], lw=1.0, label=label)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("torque [N m]")
        legend_above(axes, columns=8)
    return made.panel("Joint torques")
