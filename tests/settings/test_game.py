"""Values of rope, cup and air that are refused, and the results of the others."""

from __future__ import annotations

import math
from typing import Any

import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from tests.shipped_conf import plain


def game(cup: str = "floor", air: str = "quadratic", **keys: Any) -> GameSettings:
    values = plain("game", "kendama") | {"cup": plain("game/cup", cup), "air": plain("game/air", air)}
    for key, value in keys.items():
        node = values
        *path, last = key.split("__")
        for part in path:
            node = node[part]
        node[last] = value
    return build(GameSettings, values, "game")


def test_a_cup_that_the_rope_cannot_reach_over_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"'game\.rope\.length_m' is 0\.16: the cup is too wide .* above 0\.168"):
        game(rope__length_m=0.16)
    with pytest.raises(ConfigError, match=r"'game\.rope\.length_m' is 0\.4: the cup is too wide"):
        game(cup__radius_m=0.17)
    assert game(rope__length_m=0.17).way_into_cup_m == pytest.approx(0.168)


def test_a_cup_into_which_the_ball_does_not_fit_is_refused() -> None:
    with pytest.raises(
        ConfigError, match=r"'game\.ball\.radius_m' is 0\.05: the ball does not fit .* below cup\.radius_m"
    ):
        game(ball__radius_m=0.05)
    with pytest.raises(
        ConfigError, match=r"'game\.cup\.depth_m' is 0\.004: the floor would fill the cup; allowed: above"
    ):
        game(cup__depth_m=0.004)


def test_a_handle_wider_than_the_cup_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"'game\.cup\.tie\.radius_m' is 0\.05.* wider than the cup; allowed: up to"):
        game("handle", cup__tie__radius_m=0.05)


def test_the_default_drag_is_that_of_the_sphere_and_a_third_more_for_the_string() -> None:
    sphere = 0.5 * 1.2 * 0.47 * math.pi * 0.02**2
    linear, quadratic = game().drag
    assert linear == 0.0
    assert game(air__string_diameter_m=0.0).drag[1] == pytest.approx(sphere)
    assert 1.2 * sphere < quadratic < 1.4 * sphere
    assert game(air="linear").drag == (0.002, 0.0)


def test_the_strings_share_is_what_its_elements_slow_the_ball_by() -> None:
    """An element at s moves with v s / l, and a force at s acts on the ball with s / l."""
    n, length, v = 2000, 0.4, 3.0
    force = 0.0
    for i in range(n):
        s = (i + 0.5) / n * length
        force += 0.5 * 1.2 * 1.2 * 0.0015 * (length / n) * (v * s / length) ** 2 * s / length
    string = game().drag[1] - game(air__string_diameter_m=0.0).drag[1]
    assert string * v * v == pytest.approx(force, rel=1e-5)
