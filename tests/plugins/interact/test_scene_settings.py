"""Content of a scene file, and the one line that tells what is wrong with it."""

from __future__ import annotations

import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.plugins.interact.scene_settings import FreeBody, SprungBody, StaticBody
from kendama_cli.plugins.interact.settings import InteractSettings
from kendama_cli.schema.settings import build
from tests.plugins.interact.shipped_scene import body, press, scene


def _free(**changed):
    values = body() | {"kind": "free", "mass_kg": 0.5} | changed
    return {name: value for name, value in values.items() if value is not None}


def test_bodies_are_static_free_or_sprung():
    made = scene(body(), _free(name="block"), body("soft_table") | {"name": "pad"}).bodies
    assert [type(one) for one in made] == [StaticBody, FreeBody, SprungBody]


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        ([body(shape="cone")], r"'scene\.bodies\[0\]\.shape' is 'cone'; allowed: box, cylinder, sphere, plane"),
        ([body(size_m=[0.6, 0.4, 0.0])], r"'scene\.bodies\[0\]\.size_m\[2\]' is 0\.0; allowed: above 0"),
        (
            [body(size_m=[0.6, 0.4])],
            r"'scene\.bodies\[0\]\.size_m' is \[0\.6, 0\.4\]; allowed for a box: "
            r"\[edge along x, edge along y, edge along z\]",
        ),
        ([body(shape="plane")], r"size_m' is .*; allowed for a plane: \[\]"),
        (
            [body(), _free(name="block"), body()],
            r"'scene\.bodies' has 2 bodies called 'table'; allowed: one of each name",
        ),
        ([body(mass_kg=3.0)], r"unknown key 'scene\.bodies\[0\]\.mass_kg'; allowed here: .*kind"),
        ([_free(mass_kg=None)], r"missing key 'scene\.bodies\[0\]\.mass_kg': Mass"),
        ([_free(mass_kg=0.0)], r"'scene\.bodies\[0\]\.mass_kg' is 0\.0; allowed: above 0"),
        (
            [_free(shape="plane", size_m=[])],
            r"'scene\.bodies\[0\]\.shape' is 'plane' for a body that moves; allowed: box, cylinder, sphere",
        ),
        (
            [body(rotation_wxyz=[1.0, 1.0, 0.0, 0.0])],
            r"rotation_wxyz' is \[1\.0, 1\.0, 0\.0, 0\.0\] of length 1\.414; allowed: length 1, as \[1, 0, 0, 0\]",
        ),
        ([body(kind="fixed")], r"'scene\.bodies\[0\]\.kind' is 'fixed'; allowed: free, sprung, static"),
        ([body(restitution=1.5)], r"restitution' is 1\.5; allowed: at least 0 and at most 1"),
    ],
)
def test_a_scene_that_cannot_be_is_refused_in_one_line(bodies, message):
    with pytest.raises(ConfigError, match=message) as caught:
        scene(*bodies)
    assert "\n" not in str(caught.value)


def test_a_script_without_steps_is_refused():
    with pytest.raises(ConfigError, match=r"'interact\.script' is empty; allowed: one step or more"):
        press(script=[])
    assert isinstance(press(), InteractSettings)


def test_a_body_tells_of_itself_alone():
    with pytest.raises(ConfigError, match=r"'mass_kg'"):
        build(FreeBody, _free(mass_kg="heavy"))
