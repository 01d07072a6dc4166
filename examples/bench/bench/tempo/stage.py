"""Stage that plays the primitive at several time scales."""

import dataclasses

import numpy as np

from bench.tempo.artifact import TempoStudy
from bench.tempo.messages import TempoMessage
from kendama_cli.extension import StageResult, play


class Tempo:
    """Stage from the MotionPlan of ``encode`` to a TempoStudy."""

    def __init__(self, *, tempo):
        self._settings = tempo

    def run(self, given, ctx):
        scales, peaks = self._settings.tau_scales, []
        for index, scale in enumerate(scales):
            plan = dataclasses.replace(given["encode"], tau_scale=scale)
            motion = play(plan, np.linspace(0.0, scale * plan.duration_s, 500))
            peaks.append(float(np.linalg.norm(motion.velocity_m_s, axis=1).max()))
            fits = peaks[-1] <= self._settings.allowed_m_s
            ctx.log.write("/tempo/scale", float(index), TempoMessage(scale, peaks[-1], fits))
            ctx.progress(index + 1, len(scales), tau_scale=scale)
        allowed = [scale for scale, peak in zip(scales, peaks, strict=True) if peak <= self._settings.allowed_m_s]
        metrics = {"min_tau_scale": min(allowed, default=None), "peak_speed_m_s": max(peaks)}
        return StageResult(TempoStudy(np.array(scales), np.array(peaks)), metrics)
