"""Measuring cameras for a setup.yaml."""

from __future__ import annotations

import csv
import io
import math
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path

from scipy.spatial.transform import Rotation

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.cli.setup_work import amended, refuse_setup
from kendama_cli.config.compose import composed
from kendama_cli.config.laboratory import read_setup
from kendama_cli.config.site import Site
from kendama_cli.devices.camera.calibration import camera_model, read_calibration
from kendama_cli.errors import InputError, UsageError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.calibration import brightness
from kendama_cli.plugins.calibration.board import Board, BoardSearch, BoardView
from kendama_cli.plugins.calibration.hand_eye import PlacedCameras, place_cameras, place_on_link
from kendama_cli.plugins.calibration.hand_poses import matching, read_hand_poses
from kendama_cli.plugins.calibration.latency import Blinks, measure_delay
from kendama_cli.plugins.shared.videos.views import cameras_of, read_views
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import count_of
from kendama_cli.settings.camera import CameraModelSettings
from kendama_cli.settings.setup import SIGMAS_95, MeasuredNumber, PlacedCamera
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region

PAGE = "docs/plugins/calibration.md"


@dataclass(frozen=True)
class PlaceRequest:
    """Images by camera, these cameras' calibration, the hand's poses, and the robot where they are of its joints.

    With a ``link`` the cameras are on it, the poses are its own, and the board stands still.
    """

    paths: tuple[Path, ...]
    calibration: Path
    poses: Path
    robot: str | None
    link: str | None
    board: Board
    kinds: tuple[str, ...]


def write_page(output: Path) -> None:
    """Write the page that blinks."""
    refuse_output(output, "a page is HTML", ".html")
    write_output(output, files(__package__).joinpath("blink.html").read_bytes())
    render.text(f"{output}: open it on a screen before the camera; at its end it offers blinks.csv")


def record_brightness(site: Site, overrides: Sequence[str], output: Path, seconds: float, region: str | None) -> None:
    """Write the table of a live camera."""
    refuse_output(output, "the table is a CSV", ".csv")
    settings = build_settings(composed(site, overrides))
    seen = brightness.watch(settings["camera"], seconds, _region(region))
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("t_s", "brightness"))
    rows.writerows((f"{t_s:.6f}", f"{level:.3f}") for t_s, level in zip(seen.stamp_s, seen.level, strict=True))
    write_output(output, text.getvalue().encode())
    words = shlex.join(["kendama", "camera", "latency", str(output), "blinks.csv"])
    render.text(f"{output}: {count_of(len(seen.level), 'image')}; next: {words}")


def measure_latency(
    film: Path, blinks: Path, stamps: Path | None, region: str | None, output: Path | None, *, as_json: bool
) -> None:
    """Measure, show, and keep it where a setup is named; raises InputError where the light is not found."""
    if output is not None:
        refuse_setup(output)
    switched = Blinks(brightness.read_column(blinks, "t_s"))
    if film.suffix.lower() == ".csv":
        seen = brightness.of_table(film)
    elif stamps is None:
        raise UsageError(f"{film}: a film does not say when its frames came; give --stamps FILE, CSV with a column t_s")
    else:
        seen = brightness.of_film(film, stamps, _region(region))
    try:
        found = measure_delay(switched, seen.stamp_s, seen.level)
    except ValueError as wrong:
        raise InputError(str(film), str(wrong), remedy=f"{PAGE} says how to film the light") from None
    if output is not None:
        source = f"{film.name}: {found.frames} images, {found.switches} switches"
        amended(output, camera_delay_s=MeasuredNumber(round(found.delay_s, 6), round(found.sigma_s, 7), source))
    if as_json:
        render.document({**asdict(found), "sigma_s": found.sigma_s, "setup": None if output is None else str(output)})
        return
    render.prose(
        f"delay {1e3 * found.delay_s:.2f} ms, with 95 % from {1e3 * found.low_s:.2f} to {1e3 * found.high_s:.2f}; "
        f"{found.frames} images, {found.switches} switches, {found.explained:.0%} of the brightness explained"
    )
    render.text(f"camera.latency_s={found.delay_s:.5f}" if output is None else f"{output}; use it with setup={output}")


def place_in_robot(site: Site, request: PlaceRequest, output: Path, *, as_json: bool) -> None:
    """Place the cameras, show how well, and keep them in the setup; raises InputError, with nothing written."""
    refuse_setup(output)
    by_name = {one.name: one for one in read_calibration(str(request.calibration))}
    hands = read_hand_poses(request.poses, _arm(site, request.robot), request.link)
    search = BoardSearch(request.board, request.kinds)
    views: dict[str, list[BoardView]] = {}
    for name, sources in cameras_of(request.paths).items():
        if name not in by_name:
            raise InputError(
                str(request.calibration), f"it has no camera '{name}'", remedy="name folders as 'camera calibrate' did"
            )
        found = [search.find(pixels, view) for view, pixels in read_views(sources)]
        views[name] = [one for one in found if one is not None]
    matching(hands, {view.name for seen in views.values() for view in seen}, request.poses)
    models = [camera_model(by_name[name]) for name in views]
    try:
        if request.link is None:
            made = place_cameras(search.board, models, views, hands)
        else:
            made = place_on_link(request.link, search.board, models, views, hands)
    except ValueError as wrong:
        raise InputError(str(request.poses), str(wrong), remedy=f"{PAGE} says how to hold the board") from None
    source = f"{made.views} images, {made.rms_px:.2f} px left"
    placed = tuple(
        PlacedCamera(_settings(one), _triple(made.sigma_m), _triple(made.sigma_rad), source) for one in made.cameras
    )
    before = (read_setup(output).cameras or ()) if output.exists() else ()
    elsewhere = tuple(one for one in before if one.camera.link != request.link)
    amended(output, cameras=(*elsewhere, *placed))
    _show(made, output, as_json=as_json)


def _show(made: PlacedCameras, output: Path, *, as_json: bool) -> None:
    if as_json:
        cameras = {one.name: asdict(_settings(one)) for one in made.cameras}
        sigma = {"sigma_m": made.sigma_m.tolist(), "sigma_rad": made.sigma_rad.tolist()}
        left = {"rms_px": made.rms_px, "rms_m": made.rms_m, "views": made.views}
        board = "board_in_world_m" if made.cameras[0].link else "board_in_hand_m"
        in_hand = {board: made.board_in_hand_m.tolist()}
        render.document({"cameras": cameras, **sigma, **left, **in_hand, "setup": str(output)})
        return
    off = " ".join(f"{1e3 * SIGMAS_95 * value:.2f}" for value in made.sigma_m)
    turned = " ".join(f"{math.degrees(SIGMAS_95 * value):.3f}" for value in made.sigma_rad)
    for one in made.cameras:
        render.text(
            f"{one.name}: {' '.join(f'{value:.4f}' for value in one.position_in_world_m)} m in "
            + (f"link '{one.link}'" if one.link else "the robot's world")
        )
    render.text(f"known to +-{off} mm and +-{turned} deg (95 %)")
    render.prose(f"residual {made.rms_px:.2f} px, {1e3 * made.rms_m:.2f} mm at the board, rms over {made.views} images")
    render.text(f"{output}; use it with setup={output}")


def _arm(site: Site, robot: str | None) -> RobotModel | None:
    if robot is None:
        return None
    settings = build_settings(composed(site, [f"robot={robot}"]))
    game = settings["game"]
    return RobotModel(resolve_files(settings["robot"], "robot", site.data_roots), game.cup, game.gravity_m_s2)


def _settings(model: CameraModel) -> CameraModelSettings:
    w, x, y, z = Rotation.from_matrix(model.world_to_camera.T).as_quat(canonical=True, scalar_first=True).tolist()
    (fx, fy), (cx, cy) = model.focal_px.tolist(), model.center_px.tolist()
    a, b, c, d, e = model.distortion.tolist()
    return CameraModelSettings(
        name=model.name,
        width_px=model.width_px,
        height_px=model.height_px,
        focal_px=(fx, fy),
        center_px=(cx, cy),
        lens=model.lens,
        distortion=(a, b, c, d, e),
        position_m=_triple(model.position_in_world_m),
        look_at_m=None,
        rotation_wxyz=(w, x, y, z),
        readout_s=model.readout_s,
        link=model.link,
    )


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _region(text: str | None) -> Region | None:
    if text is None:
        return None
    try:
        x, y, width, height = (int(part) for part in text.split(","))
    except ValueError:
        raise UsageError(f"--region {text}: give four whole numbers in pixels, such as 200,100,80,80") from None
    made = Region(x, y, x + width, y + height)
    if made.empty or x < 0 or y < 0:
        raise UsageError(f"--region {text}: no pixel lies in it")
    return made
