"""The replay as a part of the page: its data, compact, and the scripts that show it."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from kendama_cli.report.page_head import data_script
from kendama_cli.report.replay.camera_images import CameraImages
from kendama_cli.report.replay.performance import Expected, Frames, Performance
from kendama_cli.report.replay.viewpoint import azimuth_rad
from kendama_cli.report.tracks import Array
from kendama_cli.schema.foxglove import Solid

_FINEST_M = 1e-4
"""Places are whole numbers of this, or of more where they reach beyond what 16 bits hold."""
_MOST = 32767


@cache
def scripts() -> tuple[str, str]:
    """Return three.js with its licence, and the player: both must be allowed by the page's policy."""
    here = files("kendama_cli.report.replay")
    names = ("three.min.js", "motion.js", "cameras.js", "player.js")
    three, *parts = (here.joinpath(name).read_text(encoding="utf-8") for name in names)
    return three, f"'use strict';\n(() => {{\n{''.join(parts)}}})();\n"


def replay(performances: Sequence[Performance], *, once: bool = False) -> str:
    """Return the replay of ``performances`` as HTML, hidden until its script finds that the browser can draw it.

    ``once``: it plays to its end by itself and no further, and not where the browser draws slowly.
    """
    shown = _placed(performances)
    scene = {"performances": [_performance(one) for one in shown], "azimuth": round(azimuth_rad(shown), 4)}
    many = len(shown) > 1
    choices = "".join(
        f'<label><input type="checkbox" data-index="{k}">{html.escape(one.label)}</label>'
        for k, one in enumerate(shown)
        if many
    )
    side = (
        '<span class="seg" role="group" aria-label="arrangement"><button type="button" data-side="0">Overlaid</button>'
        '<button type="button" data-side="1">Side by side</button></span>'
        if many
        else ""
    )
    speeds = "".join(
        f'<button type="button" data-rate="{rate}">{words}</button>'
        for rate, words in ((1, "1\u00d7"), (0.25, "\u00bc"), (0.1, "\u2152"))
    )
    return (
        f'<div class="replay"{" data-once" if once else ""} hidden>'
        '<div class="stage"><canvas tabindex="0" aria-label="Replay in space. Space plays,'
        ' arrow keys turn the view, plus and minus zoom, comma and point step, R resets the view."></canvas>'
        '<p class="legend"></p></div>'
        '<div class="controls"><button type="button" class="play">Play</button>'
        '<input type="range" min="0" max="1" step="any" value="0" aria-label="time"><output></output></div>'
        f'<div class="controls choose"><span class="seg" role="group" aria-label="speed">{speeds}</span>{side}'
        f'<button type="button" class="reset">Reset view</button>{choices}</div>'
        '<div class="cameras" hidden></div>'
        '<p class="run keys">Drag to turn, two fingers or the wheel (after a click) to zoom; keys: space, arrows, + and'
        " \u2212, comma and point for single pictures, R. Times count from the catch.</p>"
        f"{data_script(scene)}</div>"
    )


def _placed(performances: Sequence[Performance]) -> list[Performance]:
    """Place motions without a position where the first that has one begins; those with an arm come first."""
    home = next((one.start_m for one in performances if one.placed), None)
    placed = [one if one.placed or home is None else one.moved(home - one.start_m) for one in performances]
    return sorted(placed, key=lambda one: one.links is None)


def _performance(one: Performance) -> dict[str, Any]:
    return {
        "label": one.label,
        "kind": one.kind,
        "bodies": _frames(one.bodies),
        "links": None if one.links is None else _frames(one.links),
        "solids": [_solid(solid) for solid in one.solids],
        "rope": round(one.rope_m, 5),
        "rim": round(one.rim_m, 5),
        "gravity": one.gravity_m_s2,
        "catch": None if one.catch_s is None else round(one.catch_s, 4),
        "ahead": [_ahead(known) for known in one.expected],
        "images": [_images(seen) for seen in one.images],
    }


def _images(seen: CameraImages) -> dict[str, Any]:
    return {
        "camera": seen.camera,
        "size": list(seen.size_px),
        "times": _rounded(seen.t_s, 4),
        "files": [f"data:image/{seen.format};base64,{base64.b64encode(one).decode()}" for one in seen.files],
        "balls": [None if ball is None else _rounded(ball, 1) for ball in seen.balls],
    }


def _frames(frames: Frames) -> dict[str, Any]:
    places, turns = frames.poses[..., :3], frames.poses[..., 3:]
    step_m = max(_FINEST_M, float(np.abs(places).max()) / _MOST)
    whole = np.concatenate([places / step_m, turns * _MOST], axis=-1)
    return {
        "names": list(frames.names),
        "start": round(frames.start_s, 5),
        "rate": round(frames.rate_hz, 5),
        "step": step_m,
        "poses": _packed(np.rint(whole), "<i2"),
    }


def _solid(solid: Solid) -> dict[str, Any]:
    made: dict[str, Any] = {
        "frame": solid.frame,
        "name": solid.name,
        "kind": solid.kind,
        "rgb": _rounded(solid.rgb, 3),
        "at": _rounded(solid.position_m, 5),
        "turn": _rounded(solid.rotation_wxyz, 5),
    }
    if solid.kind == "mesh":
        vertices = np.array([tuple(vertex) for vertex in solid.vertices_m])
        corners = np.array([tuple(corners) for corners in solid.triangles])
        return made | {"vertices": _packed(vertices, "<f4"), "triangles": _packed(corners, "<u4")}
    return made | {"size": _rounded(solid.size_m, 5), "top": round(solid.top_scale, 4)}


def _ahead(known: Expected) -> list[float]:
    """Return when it was known; of the crossing when, where, how fast; half axes (two sigma) and turn of its
    ellipse.
    """
    values, vectors = np.linalg.eigh(known.covariance_m2)
    minor, major = (2 * np.sqrt(np.maximum(values, 0.0))).tolist()
    turn = float(np.arctan2(vectors[1, 1], vectors[0, 1]))
    row = (known.t_s, known.crossing_s, *known.place_m, *known.velocity_m_s, major, minor, turn)
    return _rounded(row, 4)


def _rounded(values: Any, digits: int) -> list[float]:
    return [round(float(value), digits) + 0.0 for value in values]


def _packed(values: Array, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()
