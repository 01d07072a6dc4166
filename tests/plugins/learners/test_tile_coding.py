"""Tile coding: tiles that cover the state evenly, and values that learn as a table's do where there is one tiling."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.learning.sarsa import ValueTable
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition
from kendama_cli.plugins.learners.tile_coding import Tiles, TileValues
from tests.learning.settings_files import learn_settings


def tiled(task: str = "hard", **replaced: object) -> Tiles:
    return Tiles(learn_settings(task, "learn/learner=tile_coding", **replaced))


def shared(tiles: Tiles, one: SwingState, other: SwingState) -> int:
    """Tiles that two states have in common."""
    return len(set(tiles.active(one)) & set(tiles.active(other)))


def test_every_state_lies_in_one_tile_of_every_tiling():
    tiles, rng = tiled("paper_caught"), np.random.default_rng(0)
    one = tiles.n // 8
    for _ in range(200):
        active = tiles.active(SwingState(*(rng.standard_normal(4) * [1.0, 3.0, 4.0, 30.0])))
        assert (active // one).tolist() == list(range(8))


def test_states_share_fewer_tiles_the_farther_they_are_apart_and_the_angle_goes_round():
    tiles = tiled()
    begin = SwingState(0.05, 0.1, 1.0, 2.0)
    common = [shared(tiles, begin, begin._replace(angle_rad=1.0 + far)) for far in (0.0, 0.1, 0.2, 0.3, 0.4)]
    assert common[0] == 8
    assert common == sorted(common, reverse=True)
    assert common[-1] == 0  # a tile is 0.35 rad wide
    nearly = begin._replace(angle_rad=np.pi - 0.01), begin._replace(angle_rad=-np.pi + 0.01)
    assert shared(tiles, *nearly) >= 7


def test_left_and_right_share_their_tiles_as_the_grid_has_it():
    here = SwingState(0.1, 0.3, 1.0, -2.0)
    turned = SwingState(*(-value for value in here))
    assert shared(tiled("paper_caught"), here, turned) == 8  # mirrored
    assert shared(tiled("hard"), here, turned) == 0
    assert shared(tiled("hard"), here, here._replace(x_m=-0.1)) == 8  # distance


@pytest.mark.parametrize("update", ["sarsa", "q"])
def test_one_tiling_learns_as_a_table_does(update):
    settings = learn_settings("hard", "learn/learner=tile_coding", learner__tilings=1, update=update, trace_decay=0.8)
    rng = np.random.default_rng(3)
    start = rng.standard_normal((6, 3))
    table = ValueTable(start, gamma=settings.gamma, trace_decay=0.8, update=update)
    values = TileValues(np.array(start), settings)
    row, column = 0, 0
    for step in range(400):
        ended = step % 20 == 19
        following, chosen, reward = int(rng.integers(6)), int(rng.integers(3)), float(rng.standard_normal())
        ahead = (None, None) if ended else (following, chosen)
        visits = [values.visit(np.array([place])) for place in (row, following)]
        table.update(Transition(row, column, reward, *ahead), 0.3)
        aside = (None, None) if ended else (visits[1], chosen)
        values.update(Transition(visits[0], column, reward, *aside), 0.3)
        row, column = following, chosen
        if ended:
            table.begin()
            values.begin()
    assert values.q == pytest.approx(table.q, abs=1e-12)


def test_a_step_moves_the_sum_over_the_tilings_by_alpha():
    settings = learn_settings("hard", "learn/learner=tile_coding")
    values = TileValues(np.zeros((80, 5)), settings)
    visit = values.visit(np.arange(0, 80, 10))
    values.update(Transition(visit, 2, 1.0, None, None), 0.7)
    assert values.values(values.q, visit) == pytest.approx([0.0, 0.0, 0.7, 0.0, 0.0])
