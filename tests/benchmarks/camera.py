"""Speed of the virtual camera on a robot of 70 000 triangles, and of MuJoCo's software renderer on the same one.

``python -m tests.benchmarks.camera`` prints name, value, unit and ratio; CPU time of one thread, warmed up, the best of
five. MuJoCo (``pip install 'mujoco<4'``) renders by Mesa's software through EGL, without lens, blur or noise; where
that is not installed the last line says so.
"""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable

import numpy as np

from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.rendering.mesh import LinkMesh
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.vision.cameras.region import Region, around
from tests.vision.scenes import game, lighting, shipped_models, virtual

JOINTS_M = np.array(
    [[0.6, 0.4, -0.55], [0.62, 0.38, -0.2], [0.5, 0.3, 0.05], [0.3, 0.2, 0.0], [0.15, 0.15, -0.1], [0.0, 0.1, -0.15],
     [0.0, 0.0, -0.12], [0.0, 0.0, -0.04]]
)  # fmt: skip
RINGS, SIDES = 50, 100
TIE_M, BALL_M = np.zeros(3), np.array([0.1, 0.0, 0.3])


def link(length_m: float) -> LinkMesh:
    """A knobbly tube along z of 2 x RINGS x SIDES triangles."""
    ring, side = np.meshgrid(np.arange(RINGS + 1), np.arange(SIDES), indexing="ij")
    part, angle = ring / RINGS, 2 * np.pi * side / SIDES
    radius = (0.045 + 0.004 * np.sin(9 * angle) * np.sin(40 * part)) * np.sin(np.pi * np.clip(part, 0.02, 0.98)) ** 0.3
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), part * length_m], axis=-1).reshape(-1, 3)
    a = (ring[:-1] * SIDES + side[:-1]).ravel()
    b = (ring[:-1] * SIDES + (side[:-1] + 1) % SIDES).ravel()
    triangles = np.concatenate([np.column_stack([a, b, a + SIDES]), np.column_stack([b, b + SIDES, a + SIDES])])
    return LinkMesh(vertices, triangles, (0.32, 0.34, 0.37))


def robot() -> tuple[list[LinkMesh], np.ndarray]:
    """Seven links, and where each stands."""
    poses = []
    for a, b in itertools.pairwise(JOINTS_M):
        z = (b - a) / np.linalg.norm(b - a)
        x = np.cross(z, [0.31, 0.9, 0.2])
        x /= np.linalg.norm(x)
        poses.append(np.column_stack([x, np.cross(z, x), z, a]))
    lengths = np.linalg.norm(np.diff(JOINTS_M, axis=0), axis=1)
    return [link(float(length) + 0.03) for length in lengths], np.array(poses)


def camera(light: str) -> tuple[VirtualCameraBlock, Callable[[], None]]:
    """The left camera on a moving robot, and what makes it take its next frame."""
    links, poses = robot()
    now = [0.01]

    def scene(t_s: float) -> ScenePose:
        moved, ball = poses.copy(), BALL_M + [1.5 * np.sin(t_s), 0.0, 0.1 * np.sin(9 * t_s)] * np.array(0.05)
        moved[:, :, 3] += [0.02 * np.sin(20 * t_s), 0.0, 0.0]
        return ScenePose(ball, TIE_M, np.eye(3), hanging_rope(TIE_M, ball, 0.4), np.empty((0, 3)), moved)

    made = VirtualCameraBlock(
        shipped_models()[0], virtual(), game(), lighting(light),
        scene=scene, clock=lambda: now[0], rng=np.random.default_rng(10000), links=links,
    )  # fmt: skip

    def take() -> None:
        now[0] += 1 / virtual().rate_hz
        made.latest(max_age_s=1.0)

    return made, take


def milliseconds(work: Callable[[], object], repeats: int = 5, each: int = 3) -> float:
    """CPU milliseconds of one ``work``, the best of ``repeats``, after one that does not count."""
    work()
    spent = []
    for _ in range(repeats):
        began = time.process_time()
        for _ in range(each):
            work()
        spent.append((time.process_time() - began) / each)
    return 1e3 * min(spent)


def mujoco_milliseconds() -> float | str:
    """MuJoCo's renderer, in Mesa's software, on the same links at 640 x 480 with shadows, or why it does not answer."""
    for name, value in (("MUJOCO_GL", "egl"), ("LIBGL_ALWAYS_SOFTWARE", "1"), ("LP_NUM_THREADS", "1")):
        os.environ.setdefault(name, value)  # before the import, which reads them
    try:
        import mujoco  # noqa: PLC0415

        model = mujoco.MjModel.from_xml_string(_xml(), _assets())
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer = mujoco.Renderer(model, 480, 640)
    except Exception as error:  # missing libraries raise what they like
        return f"no software renderer answers ({type(error).__name__}: {error})"

    def draw() -> None:
        renderer.update_scene(data, camera="left")
        renderer.render()

    return milliseconds(draw)


def _assets() -> dict[str, bytes]:
    links, poses = robot()
    made = {}
    for i, (mesh, pose) in enumerate(zip(links, poses, strict=True)):
        placed = mesh.vertices_m @ pose[:, :3].T + pose[:, 3]
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in placed]
        lines += [f"f {a} {b} {c}" for a, b, c in mesh.triangles + 1]
        made[f"link{i}.obj"] = "\n".join(lines).encode()
    return made


def _xml() -> str:
    meshes = "".join(f'<mesh name="m{i}" file="link{i}.obj" inertia="shell"/>' for i in range(7))
    geoms = "".join(f'<geom type="mesh" mesh="m{i}"/>' for i in range(7))
    return f"""<mujoco><visual><global offwidth="640" offheight="480"/><quality shadowsize="2048"/></visual>
    <asset>{meshes}</asset><worldbody>
    <light pos="-1.5 -2 2.5" dir="1.5 2 -2.5" castshadow="true"/>
    <light pos="2 -1.5 2" dir="-2 1.5 -2" castshadow="true"/>
    <camera name="left" pos="-0.25 -1.5 0.25" xyaxes="1 0 0 0 0 1" fovy="43.6"/>
    <geom type="plane" size="5 5 .1" pos="0 0 -0.55"/><geom type="sphere" size="0.02" pos="0.1 0 0.3"/>
    <body>{geoms}</body></worldbody></mujoco>"""


def main() -> None:
    print(f"{'name':<44}{'value':>9}  unit      ratio")
    peer = mujoco_milliseconds()
    base = peer if isinstance(peer, float) else float("nan")
    for light in ("bright", "side"):
        made, take = camera(light)
        whole_ms = milliseconds(take)
        print(f"{f'640 x 480, 70k triangles, {light}':<44}{whole_ms:>9.1f}  ms/frame  {whole_ms / base:.2f}")
        made.set_region_of_interest(around(made.model.project(BALL_M)[0], 79))
        near_ms = milliseconds(take)
        print(f"{f'160 x 160 about the ball, {light}':<44}{near_ms:>9.1f}  ms/frame  {near_ms / base:.2f}")
        made.set_region_of_interest(Region(240, 160, 400, 320))
        cup_ms = milliseconds(take)
        print(f"{f'160 x 160 about cup and hand, {light}':<44}{cup_ms:>9.1f}  ms/frame  {cup_ms / base:.2f}")
    shown = f"{base:>9.1f}  ms/frame  1.00" if isinstance(peer, float) else f"  {peer}"
    print(f"{'MuJoCo, same links, shadow maps':<44}{shown}")


if __name__ == "__main__":
    main()
