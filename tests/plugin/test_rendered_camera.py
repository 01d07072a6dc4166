"""A rendered camera of another package, with no class of ours but the declared interface, where flights are studied."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests import warm_command
from tests.documented_package import declare_installed

DECLARED = """
from kendama_cli.schema.registry import Variant
CAMERA = Variant("sketch", settings="studio.settings:Sketch", makes="studio.camera:open_cameras")
"""
SETTINGS = """
from dataclasses import dataclass
from typing import ClassVar, Literal
from kendama_cli.schema.settings import setting
from kendama_cli.settings.camera import CameraRig, FrameTiming

@dataclass(frozen=True)
class Sketch(CameraRig):
    source: ClassVar = "rendered"
    kind: Literal["sketch"] = setting("discs on grey")
    rate_hz: float = setting("frames per second [Hz]", above=0)
    in_turn: bool = setting("the second camera exposes half a period later")

    @property
    def timing(self):
        stagger_s = 0.5 / self.rate_hz if self.in_turn else 0.0
        return FrameTiming(self.rate_hz, exposure_s=0.0, busy_s=0.0, stagger_s=stagger_s)
"""
CAMERA = """
import math
import cv2
import numpy as np
from kendama_cli.devices.camera.interface import RegionOfInterest, StaleFrame, too_old

SHIFT = 6  # bits of a pixel's fraction in cv2's drawing

class Sketchbook:
    def __init__(self, model, settings, offset_s, clock, scene):
        self.model, self._rate_hz, self._offset_s = model, settings.rate_hz, offset_s
        self._clock, self._scene, self._region = clock, scene, RegionOfInterest(model)

    @property
    def _newest(self):
        return math.floor((self._clock() - self._offset_s) * self._rate_hz + 1e-9)

    @property
    def next_s(self):
        return max(self._newest + 1, 0) / self._rate_hz + self._offset_s

    def latest(self, *, max_age_s):
        if self._newest < 0:
            raise StaleFrame(self.model.name, math.inf, f"camera '{self.model.name}': no frame yet")
        t_s = self._newest / self._rate_hz + self._offset_s
        if self._clock() - t_s > max_age_s:
            raise too_old(self.model.name, self._clock() - t_s, max_age_s)
        ball = self._scene.scene(t_s).ball_m
        pixels = np.full((self.model.height_px, self.model.width_px, 3), 110, dtype=np.uint8)
        radius = self.model.focal_px[0] * self._scene.game.ball.radius_m / self.model.depth_m(ball)
        centre = np.rint(self.model.project(ball)[0] * 2**SHIFT).astype(int)
        cv2.circle(pixels, centre.tolist(), round(radius * 2**SHIFT), (30, 40, 220), -1, cv2.LINE_AA, SHIFT)
        return self._region.frame(t_s, pixels)

    def set_region_of_interest(self, region):
        self._region.set(region)

    def restart(self):
        pass

    def close(self):
        pass

def open_cameras(settings, models, clock, scene):
    stagger_s = settings.timing.stagger_s
    return [Sketchbook(model, settings, number * stagger_s, clock, scene) for number, model in enumerate(models)]
"""
CONF = """
defaults:
  - _self_
  - rig: stereo
kind: sketch
rate_hz: 100.0
in_turn: false
"""
PIPELINE = "stages:\n  predict: {config: [predict, camera, lighting, game, seed]}\n"


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a package that brings a camera, as if it were installed, and a configuration of it."""
    folder = tmp_path_factory.mktemp("studio")
    files = {
        "studio/__init__.py": DECLARED,
        "studio/settings.py": SETTINGS,
        "studio/camera.py": CAMERA,
        "conf/camera/sketch.yaml": CONF,
        "pipelines/flights.yaml": PIPELINE,
    }
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    declare_installed(folder, "studio", {"kendama.cameras": "sketch = studio:CAMERA"})
    return folder


def environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}


def kendama(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return warm_command.kendama(words, folder, environment(folder), 240, libraries=True)


def test_it_conforms(studio: Path) -> None:
    plain = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist"]
    suite = ["-p", "kendama_cli.conformance", "--suite", "camera"]
    done = warm_command.python([*plain, *suite, "--override", "camera=sketch"], studio, environment(studio), 240)
    assert done.returncode == 0, done.stdout + done.stderr


def test_flights_are_predicted_from_its_images_and_its_timing_counts(studio: Path) -> None:
    run = ("run", "-p", "flights", "--json", "camera=sketch", "predict.flights=2", "predict.image_every=0")
    done = kendama(studio, *run)
    assert done.returncode == 0, done.stderr
    (predict,) = json.loads(done.stdout)["stages"]
    assert predict["metrics"]["predicted_rate"] == 1.0
    assert predict["metrics"]["position_error_mm_p95"] < 6.0  # the stereo study's bound for 0.2 px
    refused = kendama(studio, *run, "camera.in_turn=true")
    assert refused.returncode != 0
    assert "needs two cameras that expose together" in refused.stderr


@pytest.mark.parametrize("in_turn", ["false", "true"])
def test_camera_check_looks_through_it(studio: Path, in_turn: str) -> None:
    words = ("camera", "check", "--seconds", "0.2", "--json", "camera=sketch", f"camera.in_turn={in_turn}")
    done = kendama(studio, *words)
    assert done.returncode == 0, done.stderr
    for one in json.loads(done.stdout)["cameras"].values():
        assert 20 <= one["frames"] <= 21
        assert one["rate_hz"] == pytest.approx(100)
        assert one["missed"] == 0
        assert one["seen"] > 0.9
