"""Errors of swings read from rendered phone films, and the rates at which an arm catches with them.

    python -m tests.plugins.films.swing_errors FOLDER [MINUTES [CATCHES [NAME ...]]]

renders the films of FILMS for the SWINGS, with boxes wrong by a pixel, follows ball and cup, and writes
FOLDER/errors.csv: rms error in the swing's plane, scale across and up, rms error of the depth. Films of MARKED have a
printed marker on a cup that turns, which is followed in place of the boxes. With CATCHES it takes so many of the SWINGS
alone, and runs the stage `adapt` (PA10, ``adapt/uncertainty=hard``, visual catch, REPEATS repeats) on what was read,
beside the true swing and beside two whose phases are drawn anew, into FOLDER/catches.csv. What stands there is left
out, and after MINUTES nothing further is begun. Each NAME is a row; without one all are made.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.errors import KendamaError
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.plugins.films.box_follower import BoxTrack
from kendama_cli.plugins.films.swing_video import followed, swings
from kendama_cli.plugins.marker.films import _followed
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.schema.settings import build
from kendama_cli.stages.adapt.stage import Adapt
from tests.motion.swings import settings as encode_settings
from tests.plugins.films.swing_film import Shoot, filmed, person_swing, write_boxes, write_film
from tests.plugins.films.test_swing_video import settings
from tests.plugins.marker.handle_film import MARKER_TO_CUP_M, PHONE, filmed_with_marker
from tests.plugins.marker.test_films import settings as marker_settings
from tests.plugins.phone.rates import QuietContext, distance_m, other_phases
from tests.simulation.dart.bench_robot import adapt_values, bench_arm, kendama_game

SWINGS = (12, 8, 7, 6, 11, 4)
"""Not 3 and 10, which were looked at while building, beside 12."""
FIRST_SEED = 50000
REPEATS = 10
FILMS = {
    "square, 2 m": Shoot(),
    "5 degrees beside": Shoot(yaw_deg=5.0),
    "10 degrees beside": Shoot(yaw_deg=10.0),
    "20 degrees beside": Shoot(yaw_deg=20.0),
    "4 m": Shoot(away_m=4.0),
    "30 images a second": Shoot(rate_hz=30.0),
    "phone leans by 10 degrees": Shoot(roll_deg=10.0),
    "in a hand, 3 px": Shoot(shake_px=3.0),
}
ALSO = {"string 1 cm too long": {"string_m": 0.41}, "no string given": {"string_m": None}}
"""The first film read with other settings."""
MARKED = {
    "marker": (PHONE, {}),
    "marker, its place on the cup not given": (PHONE, {"marker_to_cup_m": [0.0, 0.0, 0.0]}),
    "marker, phone leans by 3 degrees": (replace(PHONE, roll_deg=3.0), {}),
    "marker, 20 degrees beside": (replace(PHONE, yaw_deg=20.0), {}),
}
"""Films of a marker, exposed for 8 ms, and settings with which they are read."""
NULLS = ("phases drawn anew", "phases drawn again")
READ = (*FILMS, *ALSO, *MARKED)
ERRORS = ("plane_error_mm", "scale_x", "scale_z", "depth_mm")
CATCH = ("caught", "repeats_caught", "tau")
Make = Callable[[str, int], list[object]]


def tracked(folder: Path, name: str, number: int) -> tuple[np.ndarray, dict[str, BoxTrack]]:
    """Film the swing, follow ball and cup, and keep times and tracks in ``folder``; its last value is the seconds."""
    kept = folder / f"{name.replace(' ', '-')}-{number}.npz"
    if not kept.exists():
        shoot, seed = FILMS[name], FIRST_SEED + number
        film, path = filmed(person_swing(number), shoot, seed), kept.with_suffix(".mp4")
        write_film(path, film, shoot.rate_hz)
        write_boxes(path.with_name(f"{path.stem}-boxes"), path.stem, film, seed)
        began_s = time.process_time()
        t_s, tracks = followed(VideoFile(path), None)
        values = {f"{thing}_{part}": value for thing, one in tracks.items() for part, value in vars(one).items()}
        np.savez(kept, t_s=t_s, seconds=time.process_time() - began_s, **values)
        path.unlink()
    read = dict(np.load(kept))
    parts = [field.name for field in dataclasses.fields(BoxTrack)]
    tracks = {thing: BoxTrack(*(read[f"{thing}_{part}"] for part in parts)) for thing in ("ball", "cup")}
    return read["t_s"], tracks


def read_swing(folder: Path, name: str, number: int) -> Recording:
    """Return the swing of a row's film as the part reads it; raises InputError where it refuses."""
    if name in MARKED:
        return marked_swing(folder, name, number)
    film_name, changes = ("square, 2 m", ALSO[name]) if name in ALSO else (name, {})
    t_s, tracks = tracked(folder, film_name, number)
    path = folder / f"{name}.mp4"
    (found,) = swings(path, t_s, tracks, settings(path, **{"string_m": 0.4, "tie_m": 0.035, **changes}), ())
    return found


def marked_swing(folder: Path, name: str, number: int) -> Recording:
    """Return the swing of a row's film with a marker, as the part reads it."""
    shoot, changes = MARKED[name]
    same = next(one for one, (other, _) in MARKED.items() if other == shoot)
    path = folder / f"{same.replace(' ', '-')}-{number}.mp4"
    if not path.exists():
        write_film(path, filmed_with_marker(number, shoot, FIRST_SEED + number), shoot.rate_hz)
    values = {"field_of_view_deg": None, "marker_to_cup_m": MARKER_TO_CUP_M.tolist(), **changes}
    own = marker_settings(path, **values)
    (found,) = checked_swings(_followed(str(path), own), own.plausible, math.inf, own.segments)
    return found


def true_path(number: int, t_s: np.ndarray) -> np.ndarray:
    """The cup's true path at ``t_s``."""
    swing = person_swing(number)
    return np.column_stack([np.interp(t_s, swing.t_s, one) for one in swing.cup_m.T])


def errors(number: int, seen: Recording) -> list[float]:
    """Return the rms error in the plane [mm], the scales along x and up, and the rms error of the depth [mm]."""
    best = min(
        (true_path(number, seen.t_s + late_s) for late_s in np.arange(0.0, 1.0, 0.005)),
        key=lambda one: distance_m(seen.position_m[:, [0, 2]], one[:, [0, 2]]),
    )
    true_m, found = best - best.mean(axis=0), seen.position_m - seen.position_m.mean(axis=0)
    scales = [float(found[:, i] @ true_m[:, i] / (true_m[:, i] @ true_m[:, i])) for i in (0, 2)]
    plane_mm = 1e3 * distance_m(seen.position_m[:, [0, 2]], best[:, [0, 2]])
    return [round(plane_mm, 2), *(round(one, 4) for one in scales), round(1e3 * float((true_m - found)[:, 1].std()), 1)]


def catch(number: int, swing: Demonstration) -> list[object]:
    """Return True if an arm catches with this swing, how many of the REPEATS it catches, and its tau."""
    values = dataclasses.replace(build(AdaptSettings, adapt_values(), "adapt"), repeats=REPEATS, thorough=True)
    try:
        plan = encode_demonstrations([swing], encode_settings())
        made = Adapt(adapt=values, robot=bench_arm(), game=kendama_game()).run({"encode": plan}, QuietContext(number))
    except KendamaError as error:
        print(number, error, file=sys.stderr)
        return [False, 0, ""]
    metrics = made.metrics
    return [metrics["caught"], round(REPEATS * (metrics["success_rate"] or 0.0)), round(metrics["tau_scale"], 3)]


def swing_of(folder: Path, name: str, number: int) -> Demonstration:
    """Return the swing of a row: as it was read from its film, the true one, or one with other phases."""
    if name in READ:
        seen = read_swing(folder, name, number)
        return Demonstration("0", seen.t_s, seen.position_m, seen.rotation_wxyz)
    t_s = np.arange(0.0, person_swing(number).t_s[-1], 0.01)
    path_m = true_path(number, t_s)
    if name in NULLS:
        path_m = other_phases(FIRST_SEED + number + 100 * NULLS.index(name), path_m, apart=False)
    return Demonstration("0", t_s, path_m)


def fill(table: Path, columns: tuple[str, ...], wanted: list[tuple[str, int]], make: Make, end_s: float) -> None:
    """Append the rows that are not in the table yet."""
    if not table.exists():
        table.write_text(",".join(("film", "swing", *columns)) + "\n")
    there = {(one["film"], int(one["swing"])) for one in csv.DictReader(table.open())}
    for name, number in wanted:
        if (name, number) not in there and time.monotonic() < end_s:
            row = make(name, number)
            with table.open("a") as file:
                csv.writer(file).writerow([name, number, *row])


def main() -> None:
    """Fill both tables, and print the rates of catches."""
    folder = Path(sys.argv[1])
    minutes, catches = (float(sys.argv[at]) if len(sys.argv) > at else other for at, other in ((2, 600.0), (3, 0.0)))
    chosen = sys.argv[4:] or ["true swing", *NULLS, *READ]
    folder.mkdir(parents=True, exist_ok=True)
    end_s = time.monotonic() + 60 * minutes
    rows = [(name, number) for name in READ if name in chosen for number in SWINGS[: int(catches) or None]]
    fill(
        folder / "errors.csv",
        ERRORS,
        rows,
        lambda name, number: errors(number, read_swing(folder, name, number)),
        end_s,
    )
    rows = [(name, number) for name in chosen for number in SWINGS[: int(catches)]]
    fill(folder / "catches.csv", CATCH, rows, lambda name, number: catch(number, swing_of(folder, name, number)), end_s)
    made = list(csv.DictReader((folder / "catches.csv").open()))
    for name in dict.fromkeys(one["film"] for one in made):
        own = [one for one in made if one["film"] == name]
        sure = sum(int(one["repeats_caught"]) >= 0.9 * REPEATS for one in own)
        interval = success_interval(sure, len(own))
        print(f"{name}: {sure} of {len(own)} [{interval.low:.2f}, {interval.high:.2f}]")


if __name__ == "__main__":
    main()
