"""Try the predictor on recorded flights of one's own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import Json
from kendama_cli.errors import InputError, UsageError
from kendama_cli.schema.units import count_of

if TYPE_CHECKING:
    from kendama_cli.plugins.calibration.flight_search import RecordedFlight
    from kendama_cli.plugins.calibration.flight_trial import FlightTrial

SEEN = (0.3, 0.5, 0.7, 0.9)
WITHIN_95 = 5.991
"""Quantile 0.95 of chi-square with two degrees of freedom: the stated ellipse that holds 95 % of the errors."""
GRAVITY_OFF = 0.02
MORE = "log more flights, or give several logs"


def log_predict(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="CSV (t_s,x_m,y_m,z_m), Qualisys TSV, Motive CSV, C3D or MCAP; several of one laboratory, of a throw "
            "each even, count as one recording.",
        ),
    ],
    calibrate: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Learn gravity, drag and wobble from this file's flights; repeat for more "
            "[the other flights of FILE..., each flight's own left out].",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Predict the end of every free flight in a recording from its first part, and say how far off that is.

    With logs of runs whose cameras saw flights, learn the noise of their detector instead.

    Example: kendama log predict throws.csv
    """
    from kendama_cli.plugins.calibration.detector_noise import detected  # cv2
    from kendama_cli.plugins.calibration.flight_trial import try_flights  # scipy

    _refuse_repeated(files, calibrate or [])
    if all(detected(path) for path in files):
        _learn_noise(files, as_json=as_json)
        return
    flights = _flights(files)
    others = _flights(calibrate) if calibrate else None
    document = _document(files, flights, try_flights(flights, SEEN, others))
    if (off := _gravity_off(document["model"])) is not None:
        render.note(off)
    if as_json:
        render.document(document)
        return
    model = document["model"]
    whence = "the flights named by --calibrate" if calibrate else "the other flights"
    if not model["calibrated_on"]:
        whence = "nothing, for want of other flights"
    what = str(files[0]) if len(files) == 1 else f"{len(files)} files"
    render.prose(
        f"{what}: {count_of(len(flights), 'flight')}; gravity, drag and wobble from {whence}: {render.figures(model)}"
    )
    rows = [document[str(seen)] for seen in SEEN]
    render.table([[render.figure(value) for value in row.values()] for row in rows], head=list(rows[0]))


def _refuse_repeated(files: Sequence[Path], calibrate: Sequence[Path]) -> None:
    """Raise UsageError for a file, or an exact copy of one, that is given twice.

    Its flights would count twice, and a prediction be calibrated on the very flight that it is of.
    """
    from kendama_cli.store.durable import file_sha256

    seen: dict[str, Path] = {}
    for path in (*files, *calibrate):
        if not path.is_file():  # told by its reader
            continue
        before = seen.setdefault(file_sha256(path), path)
        if before is path:
            continue
        what = "given twice" if before == path else f"a copy of {before}"
        if path in calibrate and before in files:
            raise UsageError(
                f"--calibrate {path}: it is {'among the files to predict' if before == path else what}, so flights "
                "would be predicted from themselves; leave out --calibrate, or give other flights"
            )
        raise UsageError(f"{path}: it is {what}, so its flights would count twice; leave out one of the two")


def _flights(paths: Sequence[Path]) -> list[RecordedFlight]:
    """Return the flights of all files, and tell what is left out; raises InputError if no file has any."""
    from kendama_cli.plugins.calibration.flight_search import DROP_M, FLIGHT_S, find_flights, left_rising
    from kendama_cli.plugins.shared.recordings.reader import read_tracks  # pandas

    found, notes, tracks = [], [], 0
    for path in paths:
        recorded = read_tracks(path)
        flights = find_flights(recorded)
        tracks += len(recorded)
        found += flights
        if repeated := sum(one.repeated for one in recorded):
            notes.append(f"{path}: {repeated} samples have the time of the one before; left out")
        if rising := left_rising(recorded):
            notes.append(f"{path}: {rising} flights end before the ball falls; left out")
        if not flights:
            notes.append(f"{path}: no free flight; left out")
    if not found:
        where = f"its {tracks} tracks" if tracks > 1 else "its only track" if tracks else "it, for it has no track"
        if len(paths) > 1:
            where = f"the {tracks} tracks of {len(paths)} files"
        problem = (
            f"no free flight in {where}: none falls as gravity wants it to for {FLIGHT_S:g} s and "
            f"ends {DROP_M:g} m under its apex"
        )
        raise InputError(
            str(paths[0]), problem, remedy="record balls that are thrown up and fall, in metres and seconds, z up"
        )
    for note in notes:
        render.note(note)
    return found


def _learn_noise(paths: Sequence[Path], *, as_json: bool) -> None:
    from kendama_cli.plugins.calibration.detector_noise import detected_flights, fit_noise

    flights = [flight for path in paths for flight in detected_flights(path)]
    try:
        motion = fit_noise(flights)
    except ValueError as wrong:
        raise InputError(str(paths[0]), f"its detector's noise cannot be learned: {wrong}", remedy=MORE) from None
    document = {"files": [str(path) for path in paths], "flights": len(flights), "motion": vars(motion)}
    if as_json:
        render.document(document)
        return
    settings = " ".join(
        f"predict.motion.{name}={render.figure(value)}" for name, value in vars(motion).items() if name != "kind"
    )
    render.prose(f"the detector's noise along {count_of(len(flights), 'flight')}:")
    render.text(f"predict/motion=coloured {settings}")


def _gravity_off(model: Mapping[str, Any]) -> str | None:
    """Return a line where the learned gravity is not the standard one, None where it is."""
    from kendama_cli.plugins.calibration.flight_search import GRAVITY_M_S2

    scale, tilt_rad = model["gravity_m_s2"] / GRAVITY_M_S2 - 1, math.hypot(model["tilt_x_rad"], model["tilt_y_rad"])
    if math.hypot(scale, tilt_rad) <= GRAVITY_OFF:
        return None
    return (
        f"the flights' gravity is {scale:+.1%} in size and {math.degrees(tilt_rad):.1f}° from upright: look at the "
        "scale and the vertical of the calibration, or the ball is slowed by more than drag"
    )


def _document(paths: Sequence[Path], flights: list[RecordedFlight], trial: FlightTrial) -> dict[str, Any]:
    import numpy as np

    document: dict[str, Any] = {"files": [str(path) for path in paths], "flights": len(flights)}
    for j, seen in enumerate(SEEN):
        figures: dict[str, Any] = {"observed_fraction": seen, "flights": len(flights)}
        for name, errors in (
            ("position_error_mm", trial.position_error_mm[:, j]),
            ("time_error_ms", trial.time_error_ms[:, j]),
        ):
            known = errors[np.isfinite(errors)]
            for part in (50, 95):
                figures[f"{name}_p{part}"] = float(np.quantile(known, part / 100)) if len(known) else None
        known = trial.squared_sigmas[:, j][np.isfinite(trial.squared_sigmas[:, j])]
        if len(known):
            figures["position_sigma_mm_p50"] = float(np.nanmedian(trial.sigma_mm[:, j]))
            figures["inside_95"] = float((known < WITHIN_95).mean())
        figures["predicted"] = int(np.isfinite(trial.position_error_mm[:, j]).sum())
        document[str(seen)] = figures
    model = trial.model
    document["model"] = {
        "calibrated_on": model.flights,
        "gravity_m_s2": float(np.linalg.norm(model.gravity_m_s2)),
        "tilt_x_rad": float(model.tilt_rad[0]),
        "tilt_y_rad": float(model.tilt_rad[1]),
        "drag_per_s": model.drag_per_s,
        "sigma_m": model.sigma_m,
        **{f"wobble_{name}": value for name, value in vars(model.motion).items() if name != "kind"},
    }
    return document
