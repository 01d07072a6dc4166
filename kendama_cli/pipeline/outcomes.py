"""Outcomes of a run's stages for its record: cached, ran, or failed and why."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kendama_cli.pipeline.plan import StagePlan
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.workers import Job
from kendama_cli.store import durable


def cached(plan: StagePlan, record: RunRecord) -> StageOutcome:
    """Return the outcome of a stage whose result was stored; ``record`` notes what it was computed with."""
    record.cached_with[plan.spec.name] = {} if plan.result is None else plan.result.made_with
    return _with_result(plan, "cached", 0.0)


def ran(plan: StagePlan, seconds: float) -> StageOutcome:
    """Return the outcome of a stage whose result a worker computed."""
    return _with_result(plan, "ran", seconds)


def failed(job: Job, code: int, seconds: float, printed: Path) -> StageOutcome:
    """Return the outcome of a stage whose worker ended with ``code`` and without a result; it printed ``printed``."""
    spec = job.plan.spec
    message = _failure(job.failed, code, printed)
    return StageOutcome(spec.name, spec.declaration.name, job.plan.key, "failed", seconds, None, {}, message)


def _with_result(plan: StagePlan, status: str, seconds: float) -> StageOutcome:
    spec, result = plan.spec, plan.result
    assert result is not None
    artifact = str(result.artifact)
    first = [one.metric for one in spec.declaration.headline if one.metric in result.metrics]
    metrics = {**{name: result.metrics[name] for name in first}, **result.metrics}  # in the order of what is read first
    return StageOutcome(spec.name, spec.declaration.name, plan.key, status, seconds, artifact, metrics)


def _failure(reported: Mapping[str, Any] | None, code: int, printed: Path) -> str:
    if reported is not None and not reported["unexpected"]:
        return str(reported["message"])
    if reported is not None:
        return f"{reported['message']} (unexpected; its traceback is in {printed})"
    if code < 0:
        return (
            f"its worker was ended by {signal.Signals(-code).name}; the same command goes on from the last checkpoint"
        )
    lines = (durable.read_file(printed) or b"").decode(errors="replace").strip().splitlines()
    said = f": {lines[-1]}" if lines else ""
    return f"its worker ended with code {code}{said}; what it printed is in {printed}"
