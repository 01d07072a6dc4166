"""setup=FILE: what was measured takes the place of what the configuration believed, and nothing else changes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from kendama_cli.config.compose import composed, composition
from kendama_cli.config.site import Site, find_site
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.nodes import build_settings

CAMERA = {
    "name": "left",
    "width_px": 640,
    "height_px": 480,
    "focal_px": [600.0, 600.0],
    "center_px": [320.0, 240.0],
    "distortion": [0.0] * 5,
    "position_m": [0.5, -1.5, 0.9],
    "look_at_m": None,
    "rotation_wxyz": [0.7071067811865476, -0.7071067811865476, 0.0, 0.0],
}
MEASURED: dict[str, Any] = {
    "rope_m": {"value": 0.4123, "sigma": 0.0005, "source": "run 12"},
    "drag": {
        "linear_n_s_m": 0.0001,
        "quadratic_n_s2_m2": 0.0005,
        "at_3_m_s": 0.0016,
        "sigma_at_3_m_s": 0.00002,
        "source": "run 12",
    },
    "camera_delay_s": {"value": 0.037, "sigma": 0.0004, "source": "an LED"},
    "marker_to_cup_m": {"value": [0.0, 0.02, -0.01], "sigma": [0.001, 0.001, 0.001], "source": "a pivot"},
    "cameras": [{"camera": CAMERA, "sigma_m": [0.001] * 3, "sigma_rad": [0.002] * 3, "source": "24 images"}],
}


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "setup.yaml").write_text(yaml.safe_dump(MEASURED))
    return find_site(tmp_path / "home")


def test_every_measured_value_stands_where_it_is_read(site: Site) -> None:
    settings = build_settings(
        composed(
            site,
            [
                "setup=setup.yaml",
                "capture=marker",
                "capture.path=film.mp4",
                "capture.field_of_view_deg=65.0",
                "camera=device",
            ],
        )
    )
    assert settings["game"].rope.length_m == 0.4123
    assert settings["game"].air.quadratic_n_s2_m2 == 0.0005
    assert settings["adapt"].uncertainty.rope_m == pytest.approx(1.96 * 0.0005)
    assert math.prod(settings["adapt"].uncertainty.drag_scale) == pytest.approx(1.0)
    assert settings["adapt"].uncertainty.drag_scale[1] == pytest.approx(1 + 1.96 * 0.02 / 1.6, rel=1e-3)
    assert settings["capture"].marker_to_cup_m == (0.0, 0.02, -0.01)
    assert settings["camera"].latency_s == 0.037
    assert settings["adapt"].sensor_model.latency_s == 0.037 + settings["transfer"].observation.processing_s
    assert [one.position_m for one in settings["camera"].cameras] == [(0.5, -1.5, 0.9)]
    assert settings["transfer"].observation.camera_origin == "world"


def test_without_a_setup_and_with_an_empty_one_nothing_changes(site: Site) -> None:
    Path("setup.yaml").write_text("{}\n")
    assert composed(site, ["setup=setup.yaml"]) == composed(site, []) == composed(site, ["setup=null"])


@pytest.mark.parametrize("camera", ["virtual", "mujoco"])
def test_what_a_choice_does_not_have_is_left_alone_and_rendered_cameras_stay_where_they_are(
    site: Site, camera: str
) -> None:
    usual, measured = (composed(site, [f"camera={camera}", *said]) for said in ([], ["setup=setup.yaml"]))
    assert measured["capture"] == usual["capture"]
    assert measured["camera"] == usual["camera"]
    assert measured["transfer"] == usual["transfer"]


@pytest.mark.parametrize(
    ("override", "key", "value"),
    [
        ("game.rope.length_m=0.5", ("game", "rope", "length_m"), 0.5),
        ("game/air=linear", ("game", "air", "kind"), "linear"),
        ("adapt/uncertainty=none", ("adapt", "uncertainty", "rope_m"), 0.0),
    ],
)
def test_what_the_command_line_says_itself_holds(site: Site, override: str, key: tuple[str, ...], value: Any) -> None:
    node: Any = composed(site, ["setup=setup.yaml", override])
    for part in key:
        node = node[part]
    assert node == value


def test_a_changed_setup_is_seen_though_the_composition_was_stored(site: Site) -> None:
    assert composed(site, ["setup=setup.yaml"])["game"]["rope"]["length_m"] == 0.4123
    changed = MEASURED | {"rope_m": {"value": 0.39, "sigma": 0.001, "source": "a ruler"}}
    Path("setup.yaml").write_text(yaml.safe_dump(changed))
    assert composed(site, ["setup=setup.yaml"])["game"]["rope"]["length_m"] == 0.39
    assert str(Path("setup.yaml").resolve()) in composition(site, ["setup=setup.yaml"]).looked


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("rope_m: 0.4\n", r"'rope_m' must be a group of keys"),
        ("rope_m: {value: 0.4}\n", r"missing key 'rope_m\.sigma'"),
        ("rope: {value: 0.4}\n", r"unknown key 'rope', did you mean 'rope_m'\?"),
        ("rope_m: {value: 0.4, sigma: -1.0, source: x}\n", r"'rope_m\.sigma' is -1\.0; allowed: at least 0"),
        ("- 1\n", r"it holds no group of measured values"),
        ("a: [\n", r"it cannot be read"),
    ],
)
def test_what_is_no_setup_is_one_clear_line(site: Site, content: str, says: str) -> None:
    Path("setup.yaml").write_text(content)
    with pytest.raises(ConfigError, match=says) as caught:
        composed(site, ["setup=setup.yaml"])
    assert "setup.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("override", "says"), [("setup=nowhere.yaml", "no such file 'nowhere.yaml'"), ("setup=", "names no file")]
)
def test_a_setup_that_is_not_there_is_one_clear_line(site: Site, override: str, says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        composed(site, [override])
