"""The grid covers and tiles the space of plain states."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.state import SwingState
from tests.learning.settings_files import learn_settings

REAL = st.floats(-1e6, 1e6)
STATE = st.builds(SwingState, REAL, REAL, REAL, REAL)


def test_the_default_grid_has_the_papers_324_states():
    grid = StateGrid(learn_settings().grid)
    assert grid.shape == (2, 3, 18, 3)
    assert grid.n_states == 324


SIDES = learn_settings("easy", grid__position="side", grid__position_edges_m=[0.0]).grid
GRIDS = {name: StateGrid(learn_settings(name).grid) for name in ("easy", "hard", "paper_caught")}


@pytest.mark.parametrize("name", GRIDS)
@given(state=STATE)
def test_every_state_falls_into_exactly_one_row_and_the_row_tells_the_cell(name, state):
    grid = GRIDS[name]
    cell = grid.cell(state)
    assert all(0 <= bin_ < n for bin_, n in zip(cell, grid.shape, strict=True))
    assert grid.row(state) == np.ravel_multi_index(cell, grid.shape)


@given(STATE, st.integers(-3, 3))
def test_full_turns_of_the_ball_change_nothing_away_from_an_edge(state, turns):
    grid = StateGrid(learn_settings().grid)
    angle = math.remainder(state.angle_rad, 2 * math.pi)
    fraction = (angle * 18 / (2 * math.pi) + 0.5) % 1.0
    if 1e-9 < fraction < 1 - 1e-9:
        turned = state._replace(angle_rad=angle + 2 * math.pi * turns)
        assert grid.row(turned) == grid.row(state._replace(angle_rad=angle))


def test_all_rows_are_reached_by_the_centres_of_the_cells():
    grid = StateGrid(SIDES)
    rows = {
        grid.row(SwingState(x, v, angle, rate))
        for x in (-0.2, 0.2)
        for v in (-0.9, 0.0, 0.9)
        for angle in np.arange(18) * 2 * math.pi / 18
        for rate in (-4.0, 0.0, 4.0)
    }
    assert rows == set(range(324))


def test_the_first_angle_bin_is_centred_on_hanging():
    grid = StateGrid(learn_settings().grid)
    cells = [grid.cell(SwingState(0, 0, math.radians(angle), 0))[2] for angle in (-10.1, -9.9, 0, 9.9, 10.1, 180)]
    assert cells == [17, 0, 0, 0, 1, 9]


def test_a_cell_holds_its_lower_edge():
    grid = StateGrid(learn_settings().grid)
    below = math.nextafter(0.7, 0.0)
    assert [grid.cell(SwingState(0, v, 0, 0))[1] for v in (below, 0.7)] == [1, 2]


def test_distance_does_not_tell_the_sides_apart_and_side_does():
    distance, side = StateGrid(learn_settings().grid), StateGrid(SIDES)
    left, right = SwingState(-0.3, 0, 0, 0), SwingState(0.3, 0, 0, 0)
    assert distance.row(left) == distance.row(right)
    assert side.row(left) != side.row(right)


@given(STATE.filter(lambda state: state.x_m != 0.0))
def test_a_mirrored_grid_gives_a_state_and_its_mirror_image_one_row_but_two_places(state):
    grid = GRIDS["paper_caught"]
    image = SwingState(*(-part for part in state))
    assert grid.row(image) == grid.row(state)
    assert abs(grid.place(image) - grid.place(state)) == grid.n_states


def test_a_mirrored_grid_tells_outward_from_inward_and_far_from_near():
    grid = StateGrid(learn_settings("paper_caught").grid)
    outward, inward, near = (SwingState(x, v, 0.5, 2.0) for x, v in ((0.3, 0.9), (0.3, -0.9), (0.1, 0.9)))
    assert len({grid.row(state) for state in (outward, inward, near)}) == 3
    assert [grid.cell(state)[:2] for state in (outward, inward, near)] == [(1, 2), (1, 0), (0, 2)]
