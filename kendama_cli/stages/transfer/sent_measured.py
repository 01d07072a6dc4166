"""Every command that was really sent to the arm, against what it measured."""

from __future__ import annotations

import numpy as np

from kendama_cli.log.messages import JointExchangeMessage
from kendama_cli.motion.tracking_delay import Tracking, tracking
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP, MUTED, SERIES
from kendama_cli.report.tables import number
from kendama_cli.report.tracks import Array


def sent_and_measured(log: StageLog, start_s: float, end_s: float) -> list[Figure]:
    """The joints from ``start_s`` to ``end_s``, and of all that was ever sent the delay and the rms of each joint."""
    told = log.messages("/transfer/exchange", JointExchangeMessage)
    if len(told) < 3:
        return []
    names = list(told.messages[0].joints)
    sent, measured = told.column(lambda one: one.sent_rad), told.column(lambda one: one.measured_rad)
    whole = tracking(told.t_s, sent, measured)
    shown = (told.t_s > start_s) & (told.t_s <= end_s)
    panels: list[Panel | None] = [
        _angles(told.t_s[shown], sent[shown], measured[shown], names) if shown.sum() > 1 else None,
        _joints(whole, names),
    ]
    delays = whole.delay_s[np.isfinite(whole.delay_s)]
    spread = f"; the delays lie from {1e3 * delays.min():.1f} to {1e3 * delays.max():.1f} ms" if len(delays) else ""
    minutes = number(len(told) * float(np.median(np.diff(told.t_s))) / 60)
    captions = lettered(
        panels,
        [
            "Joint angles in one game: what was really sent (grey, wide) and what the arm measured.",
            f"All {len(told)} control periods ({minutes} min): the delay with which each joint follows what was sent to"
            f" it (bars){spread}; the rms of measured less sent (rings), and what of it the delay does not explain"
            " (points). A joint that hardly moved has no bar.",
        ],
    )
    return figure(captions, panels)


def _angles(t_s: Array, sent: Array, measured: Array, names: list[str]) -> Panel:
    every = max(1, len(t_s) // 1500)
    with drawing("transfer-angles", "Joint angles as sent and as measured") as made:
        axes = made.axes()[0]
        for j, name in enumerate(names):
            axes.plot(t_s[::every], np.degrees(sent[::every, j]), color=MUTED, lw=3.0, alpha=0.4)
            colour = SERIES[j % len(SERIES)]
            axes.plot(t_s[::every], np.degrees(measured[::every, j]), color=colour, lw=1.0, label=name)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("angle [deg]")
        legend_above(axes)
    return Panel("Sent and measured", made.svg)


def _joints(whole: Tracking, names: list[str]) -> Panel:
    place = np.arange(len(names))
    with drawing("transfer-tracking", "Delay and rms of each joint") as made:
        axes = made.axes()[0]
        axes.bar(place, 1e3 * np.nan_to_num(whole.delay_s), color=CUP, alpha=0.35, width=0.6, label="delay")
        axes.set_ylabel("delay [ms]")
        axes.set_xticks(place, names, rotation=30, ha="right")
        right = axes.twinx()
        right.plot(place, 1e3 * whole.rms_rad, "o", mfc="none", color=SERIES[1], label="rms")
        right.plot(place, 1e3 * whole.left_rms_rad, "o", ms=4, color=SERIES[1], label="rms without the delay")
        right.set_ylabel("measured less sent [mrad]")
        right.set_ylim(bottom=0)
        legend_above(right)
    return Panel("Delay and rms of each joint", made.svg)
