"""Without embreex, which has no wheel for Linux on aarch64, images of ball and cup are as ever, and meshes refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PROGRAM = """
import hashlib, sys
if "hide" in sys.argv:
    sys.modules["embreex"] = None
import numpy as np
from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import MissingPartError
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.vision.cameras.region import Region
from tests.vision.scenes import game, lighting, shipped_models, virtual

def image(arm_m):
    pose = ScenePose(np.array([0.0, 0.0, 0.3]), np.zeros(3), np.eye(3), np.empty((0, 3)), arm_m)
    camera = VirtualCameraBlock(
        shipped_models()[0], virtual(), game(), lighting("bright"),
        scene=lambda t_s: pose, clock=lambda: 1.0, rng=np.random.default_rng(3),
    )
    camera.set_region_of_interest(Region(300, 200, 340, 240))
    return camera.latest(max_age_s=1.0).pixels

print(hashlib.sha256(image(np.empty((0, 3))).tobytes()).hexdigest())
try:
    image(np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1.0]]))
    print("the arm was drawn")
except MissingPartError as error:
    print(error.part, error)
"""


def lines(*arguments: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_a_scene_without_meshes_gives_the_same_image_and_an_arm_is_refused_in_one_line() -> None:
    (image, drawn), (image_without, refused) = lines(), lines("hide")
    assert image_without == image
    assert drawn == "the arm was drawn"
    assert refused.startswith("embreex a camera was asked for the image of an arm or another mesh, which needs embreex")
