"""The compiled shapes against the same closed forms in numpy, and the noise against the normal distribution."""

import numpy as np
import pytest

from kendama_cli.rendering import kernel_light, kernel_shapes
from kendama_cli.rendering.kernel_shapes import Sizes
from tests.rendering.closed_forms import Capsule, OpenCup, Sphere

SIZES = Sizes(0.02, 0.045, 0.048, 0.07, 0.003, 0.0, 0.0, 0.004)
TURN = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
BALL, CUP = np.array([0.05, 0.02, 0.03]), np.array([-0.02, 0.01, 0.0])
ROPE = np.array([[0.0, 0.0, -0.08], [0.03, 0.05, 0.06]])
BODIES = {
    "ball": (1, Sphere(BALL, 0.02)),
    "cup": (2, OpenCup(CUP, TURN, 0.045, 0.07, 0.003)),
    "rope": (4, Capsule(ROPE[0], ROPE[1], 0.004)),
}


def twice(a):
    return np.array([a, a], dtype=float)


@pytest.mark.parametrize("name", BODIES)
def test_rays_meet_each_body_where_its_closed_form_says(name):
    bit, shape = BODIES[name]
    rng, start = np.random.default_rng(10000), np.array([0.3, -0.5, 0.35])
    directions = rng.uniform(-0.1, 0.1, (20000, 3)) - start
    n = len(directions)
    depth, owner, normals = np.full(n, np.inf), np.full(n, -1, dtype=np.int32), np.zeros((n, 3))
    kernel_shapes.meet(
        start, directions, np.full(n, 0.5), np.full(n, bit), twice(BALL), twice(CUP), twice(TURN), twice(ROPE), SIZES,
        depth, owner, normals,
    )  # fmt: skip
    expected = shape.hit(start, directions)
    hit = np.isfinite(expected.t)
    assert hit.sum() > 500
    assert np.array_equal(hit, owner != -1)
    assert np.abs(depth[hit] - expected.t[hit]).max() < 1e-12
    assert np.abs(normals[hit] - expected.normals[hit]).max() < 1e-9


def test_bodies_that_are_not_near_are_not_met():
    depth, owner = np.full(1, np.inf), np.full(1, -1, dtype=np.int32)
    start = np.array([0.3, -0.5, 0.35])
    kernel_shapes.meet(
        start, (BALL - start)[None], np.zeros(1), np.zeros(1, dtype=np.int64), twice(BALL), twice(CUP), twice(TURN),
        twice(ROPE), SIZES, depth, owner, np.zeros((1, 3)),
    )  # fmt: skip
    assert owner[0] == -1


def sensed(level, *, key=7, read_e=10.0, size=400):
    """Codes of an evenly lit sensor without gamma, in electrons of a full well of 65535."""
    out = np.zeros((size, size, 3), dtype=np.uint8)
    codes = np.arange(2**16) % 256
    light = np.full((size, size, 3), level)
    kernel_light.digitise(light, 0, 0, size, np.uint64(key), 1.0, 65535.0, read_e, codes.astype(np.uint8), out)
    return out


def test_the_sensors_noise_is_shot_and_read_noise_of_a_normal_shape():
    electrons = 900.0
    low = sensed(electrons / 65535).astype(float)
    values = (low - electrons + 128) % 256 - 128  # the code's low byte tells the deviation from 900
    sigma = np.sqrt(electrons + 100)
    n = values.size
    assert values.mean() == pytest.approx(0, abs=4 * sigma / np.sqrt(n))
    assert values.std() == pytest.approx(sigma, rel=0.01)
    for within, share in ((1, 0.683), (2, 0.954)):  # an eight-fold sum of bytes: 0.678 and 0.956
        assert (np.abs(values) < within * sigma).mean() == pytest.approx(share, abs=0.015)


def test_noise_is_independent_from_pixel_to_pixel_and_from_key_to_key():
    a, b = (sensed(0.5, key=key).astype(float) % 256 for key in (7, 8))
    values = (a - 32767.5 % 256 + 128) % 256 - 128
    other = (b - 32767.5 % 256 + 128) % 256 - 128
    n = values[..., 0].size
    pairs = [(values[:, 1:, 0], values[:, :-1, 0]), (values[1:, :, 0], values[:-1, :, 0]),
             (values[..., 0], values[..., 1]), (values[..., 0], other[..., 0])]  # fmt: skip
    for x, y in pairs:
        assert abs(np.corrcoef(x.ravel(), y.ravel())[0, 1]) < 5 / np.sqrt(n)
