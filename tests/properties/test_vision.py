"""Laws of projection and triangulation, for random cameras and points."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at
from kendama_cli.vision.cameras.triangulation import ray_constraints, triangulate

coordinate = st.floats(-0.3, 0.3)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)


@st.composite
def cameras(draw: st.DrawFn) -> list[CameraModel]:
    """Two to four cameras about the origin, 1 to 3 m away, no two of them nearly in line with it."""
    count = draw(st.integers(2, 4))
    around = draw(st.floats(0.0, 2 * np.pi))
    made = []
    for i in range(count):
        heading = around + i * draw(st.floats(0.3, 0.8))
        away, height = draw(st.floats(1.0, 3.0)), draw(st.floats(-0.5, 1.0))
        position = np.array([away * np.cos(heading), away * np.sin(heading), height])
        focal = draw(st.floats(400.0, 1500.0))
        distortion = np.array([draw(st.floats(-0.1, 0.1)), *(draw(st.floats(-0.005, 0.005)) for _ in range(4))])
        made.append(
            CameraModel(
                name=f"camera {i}",
                width_px=1280,
                height_px=960,
                focal_px=np.array([focal, focal * draw(st.floats(0.98, 1.02))]),
                center_px=np.array([640.0, 480.0]) + draw(st.floats(-20.0, 20.0)),
                distortion=distortion,
                world_to_camera=looking_at(position, (0.0, 0.0, 0.0)),
                position_in_world_m=position,
            )
        )
    return made


@given(cameras(), point)
def test_what_is_projected_into_cameras_is_triangulated_from_them(models: list[CameraModel], place: np.ndarray) -> None:
    # farther than half the focal length from the middle the lens model itself may fold
    seen = [model.project(place[None])[0] for model in models]
    assume(all(np.abs(px - m.center_px).max() < 0.5 * m.focal_px.min() for px, m in zip(seen, models, strict=True)))
    found = triangulate([ray_constraints(model, px, np.eye(2)) for model, px in zip(models, seen, strict=True)])
    assert found is not None
    # undistortion stops at 1e-9 px or so; that is 1e-11 of the distance, widened by a shallow angle between the rays
    assert np.abs(found.position_m - place).max() < 1e-7


@given(cameras(), point, st.floats(0.1, 10.0))
def test_a_noisier_pixel_widens_the_covariance_by_its_square(
    models: list[CameraModel], place: np.ndarray, scale: float
) -> None:
    seen = [model.project(place[None])[0] for model in models]
    once = triangulate([ray_constraints(m, px, np.eye(2)) for m, px in zip(models, seen, strict=True)])
    more = triangulate([ray_constraints(m, px, scale**2 * np.eye(2)) for m, px in zip(models, seen, strict=True)])
    assert once is not None
    assert more is not None
    np.testing.assert_allclose(more.covariance_m2, scale**2 * once.covariance_m2, rtol=1e-6)
