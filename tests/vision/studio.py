"""One ball before one camera, and the shipped detector: for tests and benchmarks."""

import numpy as np

from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.vision.detection.colour_detector import ColourDetector
from tests.vision.scenes import game, lighting, predict, shipped_models, virtual

DETECTOR = ColourDetector(predict().detector)
CUP = np.array([0.0, 0.0, -0.05])
NOTHING = np.empty((0, 3))


class Studio:
    """One camera, one ball at a place and velocity at the moment of the exposure, the cup where it is put."""

    def __init__(self, light="bright", *, cup=CUP, rope=True, seed=0):
        self.ball, self.velocity, self.cup, self.rope = np.zeros(3), np.zeros(3), cup, rope
        self.camera = VirtualCameraBlock(
            shipped_models()[0], virtual(), game(), lighting(light),
            scene=self.scene, clock=lambda: 1.002, rng=np.random.default_rng(seed),
        )  # fmt: skip

    def scene(self, t_s):
        ball = self.ball + (t_s - 1.0) * self.velocity
        rope = hanging_rope(self.cup, ball, 0.4) if self.rope else NOTHING
        return ScenePose(ball, self.cup, np.eye(3), rope, NOTHING)

    def shoot(self, ball, velocity=(0.0, 0.0, 0.0), region=None):
        self.ball, self.velocity = np.asarray(ball, dtype=float), np.asarray(velocity, dtype=float)
        self.camera.restart()
        self.camera.set_region_of_interest(region)
        return self.camera.latest(max_age_s=1.0)

    def true_centre(self):
        return self.camera.model.project(self.ball)[0]
