"""Encode: demonstrations become one movement primitive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.averaging import Deviation, average, deviation, encode_swing, prepare
from kendama_cli.motion.dmp import play
from kendama_cli.settings.encode import EncodeSettings
from kendama_cli.stages.interface import Made, Metric, StageContext

LOG_RATE_HZ = 100.0


class Encode:
    """Takes the DemonstrationSet of ``capture``; gives the MotionPlan of the average primitive."""

    def __init__(self, *, encode: EncodeSettings) -> None:
        self._settings = encode

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Encode every demonstration, average the parameters, and measure what was lost.

        ``rmse_mm`` (pooled over all samples) and ``max_error_mm`` (of the worst sample) are between each
        demonstration and its own primitive; ``spread_*`` are between each demonstration and the average primitive
        played at its duration. Raises StageError, naming the demonstration, where one cannot be encoded.
        """
        demonstrations = given["capture"].demonstrations
        try:
            swings = [prepare(demonstration, self._settings) for demonstration in demonstrations]
        except ValueError as error:
            raise StageError(f"encode: {error}") from None
        plans = []
        for swing in swings:
            plans.append(encode_swing(swing, self._settings))
            ctx.progress(len(plans), len(swings))
        mean = average(plans)
        own = [deviation(plan, swing) for plan, swing in zip(plans, swings, strict=True)]
        spread = [deviation(mean, swing) for swing in swings]
        for demonstration, swing in zip(demonstrations, swings, strict=True):
            t_s = swing.share * swing.duration_s
            _log(ctx, "/encode/demonstrated", demonstration.name, t_s, swing.position_m)
        t_s = np.arange(round(mean.duration_s * LOG_RATE_HZ) + 1) / LOG_RATE_HZ
        _log(ctx, "/encode/reproduced", "reproduced", t_s, play(mean, t_s).position_m)
        return Made(mean, _metrics(mean, plans, own, spread))


def _metrics(
    mean: MotionPlan, plans: Sequence[MotionPlan], own: Sequence[Deviation], spread: Sequence[Deviation]
) -> dict[str, Metric]:
    return {
        "n_parameters": mean.n_parameters,
        "rmse_mm": 1e3 * _pooled(own),
        "max_error_mm": 1e3 * max(one.max_m for one in own),
        "duration_s": mean.duration_s,
        "duration_spread_s": float(np.std([plan.duration_s for plan in plans])),
        "spread_rmse_mm": 1e3 * _pooled(spread),
        "spread_max_mm": 1e3 * max(one.max_m for one in spread),
    }


def _pooled(deviations: Sequence[Deviation]) -> float:
    squares = sum(one.samples * one.rms_m**2 for one in deviations)
    return float(np.sqrt(squares / sum(one.samples for one in deviations)))


def _log(ctx: StageContext, topic: str, child: str, t_s: Array, position_m: Array) -> None:
    for t, position in zip(t_s, position_m, strict=True):
        ctx.log.write(topic, float(t), {"parent": "world", "child": child, "position_m": position})
