"""Encode: demonstrations become one movement primitive."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.devices.demonstrator.plan_file import read_plan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.averaging import COORDINATES, Deviation, Encoding, apart, axes_of, encode, prepare
from kendama_cli.motion.dmp.onset import between_samples_m
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.motion.dmp.turning import encode_rotations, rotations_of, tilt_only
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.encode.messages import WeightsMessage
from kendama_cli.stages.interface import Metric, StageContext, StageResult

LOG_RATE_HZ = 100.0

HIDES_M = 0.025
"""The mouth's radius less the ball's, 45 - 20 mm: where the cup is off by more, a ball on its middle meets the rim."""

AMPLE = 1.2
"""The rate that is advised over the least: among few samples a motion's ends are found too far apart."""

SHARES = np.linspace(0.0, 1.0, 101)
"""Where the paths of demonstrations are compared."""


class Encode:
    """Stage from the DemonstrationSet of ``capture`` to the MotionPlan of the average primitive.

    With ``encode.plan`` it takes nothing and gives the primitive of that file.
    """

    def __init__(self, *, encode: EncodeSettings) -> None:
        self._settings = encode

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Encode every demonstration, average the parameters, and measure what was lost.

        ``rmse_mm`` (pooled over all samples) and ``max_error_mm`` (of the worst sample) are between each
        demonstration and its own primitive; ``spread_mm`` is the rms distance of the demonstrations' primitives from
        their average at equal fractions, ``spread_max_mm`` the maximum; ``outliers`` names the demonstrations that
        stand apart, which are left out where ``encode.outliers`` is ``drop``. Raises StageError, naming the
        demonstration, where one cannot be encoded or has too few samples, and InputError for a plan that cannot be
        read.
        """
        if self._settings.plan is not None:
            return _imported(read_plan(self._settings.plan), ctx)
        if "capture" not in given:
            raise StageError("encode: no demonstrations; set encode.plan=FILE or take a pipeline with a capture stage")
        demonstrations: Sequence[Demonstration] = given["capture"].demonstrations
        encoding = self._encoded(demonstrations)
        paths = _paths(encoding)
        _check_axes(demonstrations, paths)
        outside = apart(paths, encoding.parameters.duration_s)
        names = ", ".join(one.name for one, far in zip(demonstrations, outside, strict=True) if far) or "none"
        warnings: tuple[str, ...] = (f"far from the others, but averaged in: {names}",) if outside.any() else ()
        if outside.any() and self._settings.outliers == "drop":
            demonstrations = [one for one, far in zip(demonstrations, outside, strict=True) if not far]
            left = f"left out of the average, far from the other {len(demonstrations)}: {names} (encode.outliers=keep)"
            warnings = (left,)
            encoding = self._encoded(demonstrations)
            paths = _paths(encoding)
        ctx.progress(len(demonstrations), len(demonstrations))
        plans = [encoding.plan(i) for i in range(len(encoding))]
        own = [encoding.deviation(plan, i) for i, plan in enumerate(plans)]
        warnings += _too_few_samples(demonstrations, encoding, own, self._settings.functions)
        mean, turned_metrics = _with_turn(encoding.average(), demonstrations, encoding, self._settings)
        _log_demonstrations(ctx, demonstrations, encoding, plans)
        _log_plan(ctx, mean)
        spread = np.linalg.norm(paths - play(mean, SHARES * mean.duration_s).position_m, axis=2)
        metrics: dict[str, Metric] = {
            "n_parameters": mean.n_parameters,
            "rmse_mm": 1e3 * _pooled(own),
            "max_error_mm": 1e3 * max(one.max_m for one in own),
            "duration_s": mean.duration_s,
            "spread_mm": 1e3 * float(np.sqrt(np.mean(spread**2))),
            "spread_max_mm": 1e3 * float(spread.max()),
            "duration_spread_s": float(np.std(encoding.parameters.duration_s)),
            "width": encoding.basis.width,
            "outliers": names,
            "averaged": len(encoding),
            **turned_metrics,
        }
        return StageResult(mean, metrics, warnings)

    def _encoded(self, demonstrations: Sequence[Demonstration]) -> Encoding:
        try:
            return encode(prepare(demonstrations, self._settings), self._settings)
        except ValueError as error:
            raise StageError(f"encode: {error}") from None


def _with_turn(
    mean: MotionPlan, demonstrations: Sequence[Demonstration], encoding: Encoding, settings: EncodeSettings
) -> tuple[MotionPlan, dict[str, Metric]]:
    """Return the average primitive, with the cup's rotation if all demonstrations have one, and its metrics."""
    found = encode_rotations(demonstrations, encoding, settings)
    if found is None:
        return mean, {}
    turned = dataclasses.replace(mean, turn=found[0])
    tilt, spin = tilt_only(rotations_of(turned, SHARES * turned.duration_s))
    figures: dict[str, Metric] = {
        "turn_rmse_deg": float(np.degrees(found[1])),
        "tilt_max_deg": float(np.degrees(tilt.max())),
        "spin_max_deg": float(np.degrees(spin.max())),
    }
    return turned, figures


def _paths(encoding: Encoding) -> Array:
    """Return the paths of each demonstration's primitive at ``SHARES``; (N, n, c)."""
    plans = [encoding.plan(i) for i in range(len(encoding))]
    return np.array([play(plan, SHARES * plan.duration_s).position_m for plan in plans])


def _imported(plan: MotionPlan, ctx: StageContext) -> StageResult:
    _log_plan(ctx, plan)
    return StageResult(plan, {"n_parameters": plan.n_parameters, "duration_s": plan.duration_s})


def _check_axes(demonstrations: Sequence[Demonstration], paths: Array) -> None:
    for i, demonstration in enumerate(demonstrations):
        turned = axes_of(paths[i], [*paths[:i], *paths[i + 1 :]], COORDINATES)
        if turned is not None:
            raise StageError(
                f"encode: demonstration '{demonstration.name}' moves along other axes than the others: it agrees with "
                f"them where {turned}; look at capture.columns and capture.sign, or leave it out of capture.path"
            )


def _too_few_samples(
    demonstrations: Sequence[Demonstration], encoding: Encoding, own: Sequence[Deviation], functions: int
) -> tuple[str, ...]:
    """Report motions with fewer samples than their primitive has numbers, and the error of each.

    Raises StageError where that is more than HIDES_M.
    """
    needed, told = functions + 2, []
    for one, trimmed, lost in zip(demonstrations, encoding.trimmed, own, strict=True):
        count, lasts_s = len(trimmed.position_m), trimmed.duration_s
        if count >= needed:
            continue
        off_m = max(lost.max_m, between_samples_m(trimmed.position_m))
        told.append(
            f"{one.name}: {count} samples show its motion of {lasts_s:.2g} s ({(count - 1) / lasts_s:.3g} Hz), and the "
            f"primitive has {needed} numbers a coordinate: expect an error of {1e3 * off_m:.0f} mm at worst; record "
            f"at {math.ceil(AMPLE * needed / lasts_s)} Hz or more"
        )
        if off_m > HIDES_M:
            raise StageError(
                f"encode: {told[-1]} (allowed: {1e3 * HIDES_M:.0f} mm, the clearance of the ball in the mouth)"
            )
    return tuple(told)


def _pooled(deviations: Sequence[Deviation]) -> float:
    squares = sum(one.samples * one.rms_m**2 for one in deviations)
    return float(np.sqrt(squares / sum(one.samples for one in deviations)))


def _log_demonstrations(
    ctx: StageContext, demonstrations: Sequence[Demonstration], encoding: Encoding, plans: Sequence[MotionPlan]
) -> None:
    for i, (demonstration, plan) in enumerate(zip(demonstrations, plans, strict=True)):
        trimmed = encoding.trimmed[i]
        t_s = trimmed.share * trimmed.duration_s
        _log_path(
            ctx, "/encode/demonstrated", demonstration.name, t_s, trimmed.position_m - encoding.parameters.origin_m[i]
        )
        _log_path(ctx, "/encode/own", demonstration.name, t_s, play(plan, t_s).position_m)
        _log_weights(ctx, demonstration.name, plan)


def _log_plan(ctx: StageContext, plan: MotionPlan) -> None:
    t_s = np.arange(round(plan.duration_s * LOG_RATE_HZ) + 1) / LOG_RATE_HZ
    _log_path(ctx, "/encode/reproduced", "reproduced", t_s, play(plan, t_s).position_m)
    _log_weights(ctx, "reproduced", plan)


def _log_weights(ctx: StageContext, name: str, plan: MotionPlan) -> None:
    for coordinate, values in zip(plan.coordinates, plan.weights, strict=True):
        ctx.log.write("/encode/weights", 0.0, WeightsMessage(name, coordinate, centers=plan.centers, values=values))


def _log_path(ctx: StageContext, topic: str, child: str, t_s: Array, position_m: Array) -> None:
    for t, position in zip(t_s, position_m, strict=True):
        ctx.log.write(topic, float(t), FrameTransform("world", child, position))
