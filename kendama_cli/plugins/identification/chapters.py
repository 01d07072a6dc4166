"""The figures of identify (friction with both models, its compensation) and of measure (a swing that dies away)."""

from __future__ import annotations

import numpy as np

from kendama_cli.motion.sampling import columns_at
from kendama_cli.plugins.identification.messages import FreeSwingMessage, JointFrictionMessage
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import columns_of, drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, GOOD, INK, MUTED
from kendama_cli.report.tracks import Array
from kendama_cli.schema.foxglove import FrameTransform, JointStates

_COLUMNS = 4
_MOST_JOINTS = 8
ENLARGED = 20
_PLACE = ["x_m", "y_m", "z_m"]


def identification_figures(log: StageLog) -> list[Figure]:
    """Return the friction of every joint over its velocity; the cup on its circle, before and after."""
    friction = _friction(log)
    before, after = (_rms(log, when) for when in ("before", "after"))
    tracking = [_circle(log), _misses(log)]
    speed = log.metrics.get("tracking_speed_m_s")
    at = f" at {speed:.3g} m/s" if isinstance(speed, int | float) else ""
    return [
        *figure(
            [
                "Friction torque of each joint over its velocity, in a motion that neither model was fitted to."
                " Dots: measured, what rigid bodies, tool and known friction do not explain. Lines: the parametric"
                " model of Coulomb, Stribeck and viscous friction, and the two-layer network. The better model runs"
                " through the dots."
            ],
            [friction],
            columns=1,
        ),
        *figure(
            lettered(
                tracking,
                [
                    f"Path of the cup on a circle in the swing plane{at}; its tracking error is drawn {ENLARGED} times"
                    " as large. With compensation the path must lie nearer to the reference.",
                    f"Tracking error of the cup over time{before}{after}. The drive's own delay, the same for both, is"
                    " subtracted.",
                ],
            ),
            tracking,
        ),
    ]


def _rms(log: StageLog, when: str) -> str:
    value = log.metrics.get(f"tracking_rms_mm_{when}")
    words = {"before": "; without compensation", "after": ", with it"}[when]
    return f"{words} {value:.2g} mm rms" if isinstance(value, int | float) else ""


def _friction(log: StageLog) -> Panel | None:
    samples, chosen = log.table("/identify/friction", JointFrictionMessage), log.metrics.get("model")
    if samples.empty:
        return None
    chain = [str(column).removesuffix(".position_rad") for column in log.table("/identify/joints", JointStates).columns]
    joints = sorted(set(samples["joint"]), key=lambda name: (chain.index(name) if name in chain else 0, name))
    joints = joints[:_MOST_JOINTS]
    columns = min(columns_of(9.6, _COLUMNS), len(joints))
    rows = -(-len(joints) // columns)
    with drawing(
        "identify-friction", "Friction torque over velocity, per joint", height_in=0.5 + 1.9 * rows, width_in=9.6
    ) as made:
        grid = made.canvas.subplots(rows, columns, squeeze=False)
        for axes, joint in zip(grid.flat, joints, strict=False):
            shown = samples[samples["joint"] == joint].sort_values("velocity_rad_s")
            speed = shown["velocity_rad_s"].to_numpy(np.float64)
            torque = shown["friction_nm"].to_numpy(np.float64)
            axes.plot(speed, torque, ".", color=MUTED, ms=2.0, alpha=0.4, label="measured", rasterized=False)
            for name, colour, style in (("parametric", CUP, "-"), ("network", BALL, "--")):
                values = shown[f"{name}_nm"].to_numpy(np.float64)
                label = f"{name} (chosen)" if name == chosen else name
                for part in (speed < 0, speed > 0):  # no line across the reversal, where nothing was measured
                    axes.plot(speed[part], values[part], style, color=colour, lw=1.4, label=label)
                    label = f"_{name}"
            axes.axhline(0.0, color=INK, lw=0.5, label="_zero")
            low, high = np.quantile(torque, [0.01, 0.99])
            margin = 0.3 * max(high - low, 1e-3)
            axes.set_ylim(low - margin, high + margin)
            axes.set_title(joint, loc="left")
        for axes in grid.flat[len(joints) :]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel("friction [Nm]")
        for axes in grid[-1]:
            axes.set_xlabel("velocity [rad/s]")
        handles, labels = grid.flat[0].get_legend_handles_labels()
        made.canvas.legend(handles, labels, loc="outside upper left", ncols=3)
    return made.panel("Friction that the controller does not know")


def _paths(log: StageLog) -> dict[str, tuple[Array, Array]]:
    """Return time and positions of the cup by name, with the references delayed as the drive delays them."""
    found = {}
    delay_ms = log.metrics.get("drive_delay_ms")
    late_s = delay_ms / 1e3 if isinstance(delay_ms, int | float) else 0.0
    for name in ("reference", "before", "after"):
        table = log.table(f"/identify/tracking/{name}", FrameTransform)
        if len(table) > 1:
            positions = table[_PLACE].to_numpy(np.float64)
            found[name] = (table["t_s"].to_numpy(np.float64) + (late_s if name == "reference" else 0.0), positions)
    return found


def _circle(log: StageLog) -> Panel | None:
    paths = _paths(log)
    if len(paths) < 2 or "reference" not in paths:
        return None
    desired = paths["reference"]
    home = desired[1][0]
    with drawing("identify-circle", "Path of the cup in the swing plane, errors enlarged", height_in=3.6) as made:
        axes = made.axes()[0]
        axes.plot(*(1e3 * (desired[1] - home)[:, [0, 2]]).T, color=MUTED, lw=1.0, label="reference")
        for name, colour in (("before", BALL), ("after", GOOD)):
            if name in paths:
                meant = columns_at(paths[name][0], *desired)
                shown = meant + ENLARGED * (paths[name][1] - meant) - home
                axes.plot(*(1e3 * shown[:, [0, 2]]).T, color=colour, lw=1.1, label=f"{name} (error × {ENLARGED})")
        axes.set_xlabel("x [mm]")
        axes.set_ylabel("z [mm]")
        axes.set_aspect("equal", adjustable="datalim")
        legend_above(axes)
    return made.panel("The cup on its circle")


def _misses(log: StageLog) -> Panel | None:
    paths = _paths(log)
    if len(paths) < 2 or "reference" not in paths:
        return None
    with drawing("identify-misses", "Distance of the cup from its reference over time", height_in=3.6) as made:
        axes = made.axes()[0]
        for name, colour in (("before", BALL), ("after", GOOD)):
            if name in paths:
                t_s, reached = paths[name]
                miss = np.linalg.norm(reached - columns_at(t_s, *paths["reference"]), axis=1)
                axes.plot(t_s, 1e3 * miss, color=colour, lw=1.1, label=name)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("tracking error [mm]")
        axes.set_ylim(bottom=0)
        legend_above(axes)
    return made.panel("Tracking error of the cup")


def figures(log: StageLog) -> list[Figure]:
    """Return the angle over time, measured and fitted, and the distance between both."""
    table = log.table("/measure/swing", FreeSwingMessage)
    if table.empty:
        return []
    t_s = table["t_s"].to_numpy(np.float64)
    x, z, fitted_x, fitted_z = table[["x_m", "z_m", "fitted_x_m", "fitted_z_m"]].to_numpy(np.float64).T
    seen, fitted = np.degrees(np.arctan2(x, -z)), np.degrees(np.arctan2(fitted_x, -fitted_z))
    left_mm = 1e3 * np.hypot(x - fitted_x, z - fitted_z)
    with drawing("measure-swing", "Angle of the free swing over time") as made:
        axes = made.axes()[0]
        axes.plot(t_s, seen, color=BALL, lw=0.8, label="measured")
        axes.plot(t_s, fitted, color=CUP, lw=0.6, ls=(0, (4, 3)), label="fitted")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("angle [°]")
        legend_above(axes)
    with drawing("measure-left", "Residual of the fit over time") as rest:
        axes = rest.axes()[0]
        axes.plot(t_s, left_mm, ".", color=MUTED, ms=2, label="residual")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("distance [mm]")
        axes.set_ylim(bottom=0)
    panels: list[Panel | None] = [made.panel("The free swing"), rest.panel("Residual of the fit")]
    captions = [
        "Angle of the freely swinging ball under a cup at rest, measured and fitted by a pendulum with drag k1 + k2 v:"
        " the lines must cover each other to the end.",
        "Distance of the measured ball from the fitted one. A trend over time means that the model lacks something.",
    ]
    return figure(lettered(panels, captions), panels)
