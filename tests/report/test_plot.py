"""Plots of the report, before they are SVG."""

from __future__ import annotations

import pytest

from kendama_cli.report.plot import drawing, legend_above


@pytest.mark.parametrize(
    "labels",
    [["cup", "ball"], [f"learn/learner={kind}" for kind in ("random_replay", "epsilon_greedy", "tile_coding", "dyna")]],
)
def test_a_legend_is_never_wider_than_its_figure(labels):
    with drawing("legend", "lines") as made:
        axes = made.axes()[0]
        for label in labels:
            axes.plot([0, 1], label=label)
        axes.set_ylabel("reward")
        legend_above(axes)
    box = axes.get_legend().get_window_extent()
    assert box.x1 <= made.canvas.bbox.width
    assert axes.bbox.width > 0.7 * made.canvas.bbox.width, "the axes are not squeezed by their legend"
