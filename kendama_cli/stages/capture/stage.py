"""Capture: the hand's swings become demonstrations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.demonstration import Demonstration, DemonstrationSet
from kendama_cli.devices.demonstrator.interface import Demonstrator, open_demonstrators
from kendama_cli.devices.demonstrator.settings import CaptureSettings
from kendama_cli.motion.sampling import step_s
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.interface import StageContext, StageResult

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class Capture:
    """Takes nothing; gives the DemonstrationSet of all swings that the configured hand offers."""

    def __init__(self, *, capture: CaptureSettings) -> None:
        self._settings = capture

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Record every swing; metrics: the median rate, the mean duration, the largest speed of all.

        Raises InputError for a recording that cannot be used, MissingPartError for a device that is not there.
        """
        hands = open_demonstrators(self._settings, ctx.progress)
        demonstrations: list[Demonstration] = []
        warnings: list[str] = []
        for hand in hands:
            demonstrations.append(_record(hand, ctx))
            warnings += getattr(hand, "warnings", ())
            ctx.progress(len(demonstrations), len(hands))
        origins = {getattr(hand, "origin", "") for hand in hands}
        errors_m = [one for hand in hands if (one := getattr(hand, "likely_error_m", None)) is not None]
        rates = [1.0 / step_s(swing.t_s) for swing in demonstrations]
        return StageResult(
            DemonstrationSet(tuple(demonstrations)),
            {
                "n_demonstrations": len(demonstrations),
                "sample_rate_hz": round(float(np.median(rates)), 6),
                "duration_s": float(np.mean([swing.duration_s for swing in demonstrations])),
                "peak_speed_m_s": max(swing.peak_speed_m_s for swing in demonstrations),
                "origin": origins.pop() if len(origins) == 1 else "mixed",
                **({"likely_error_mm": 1e3 * max(errors_m)} if errors_m else {}),
            },
            tuple(warnings),
        )


def _record(hand: Demonstrator, ctx: StageContext) -> Demonstration:
    try:
        samples = list(hand.samples())
    finally:
        hand.close()
    for sample in samples:
        message = FrameTransform("world", hand.name, sample.position_m, sample.rotation_wxyz)
        ctx.log.write("/capture/cup", sample.t_s, message)
    rotation = np.array([sample.rotation_wxyz for sample in samples])
    return Demonstration(
        hand.name,
        np.array([sample.t_s for sample in samples]),
        np.array([sample.position_m for sample in samples]),
        # a source without orientation says upright throughout
        rotation if (rotation != UPRIGHT).any() else None,
    )
