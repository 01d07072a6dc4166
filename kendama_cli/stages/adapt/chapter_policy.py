"""The figure of a policy search: what its rollouts cost, and what the repeats after every generation said."""

from __future__ import annotations

import numpy as np

from kendama_cli.report.figure import Panel
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, GOOD, INK, MUTED, PAPER
from kendama_cli.stages.adapt.messages import AdaptExploredMessage, AdaptProofMessage

_MOST_MISS_MM = 500.0
CAPTION = (
    "What each rollout of the policy search cost: how far from the planned cup the ball came down, more where it never"
    " did; the rollouts of a generation are in one drawn world. Bars: the share of the repeats after a generation, in"
    " fresh worlds, that were caught; they stop once too many are lost, and do not count as rollouts."
)


def policy_search(log: StageLog) -> Panel | None:
    """Costs and outcomes over the rollouts; None where the search was another."""
    explored = log.table("/adapt/explored", AdaptExploredMessage)
    if explored.empty:
        return None
    number = explored["index"].to_numpy(np.float64) + 1.0
    cost_mm = np.minimum(1e3 * explored["cost_m"].to_numpy(np.float64), _MOST_MISS_MM)
    caught = explored["caught"].to_numpy(bool)
    with drawing("adapt-policy", "Cost of the rollouts of the policy search", height_in=3.6) as made:
        axes = made.axes()[0]
        for which, fill, colour, label in ((~caught, PAPER, MUTED, "missed"), (caught, GOOD, GOOD, "caught")):
            if which.any():
                axes.plot(number[which], cost_mm[which], "o", color=colour, mfc=fill, ms=4.5, label=label)
        axes.set_xlabel("rollout")
        axes.set_ylabel("cost [mm]")
        axes.set_ylim(bottom=0)
        proofs = log.table("/adapt/proof", AdaptProofMessage)
        if len(proofs):
            share = axes.twinx()
            shares = proofs.groupby("rollouts")["caught"].mean()
            after = shares.index.to_numpy(np.float64) + 0.5
            share.bar(
                after, 100 * shares.to_numpy(np.float64), width=0.5, color=BALL, alpha=0.5, label="repeats caught"
            )
            share.set_ylim(0, 105)
            share.set_ylabel("repeats caught [%]", color=INK)
            share.grid(visible=False)
        legend_above(axes)
    return Panel("The search for the motion's shape", made.svg)
