"""Work of the commands for movement primitives: find one, show it, write it, sample swings from its distribution."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan, holds_primitive, primitive_of
from kendama_cli.cli import render
from kendama_cli.config.site import find_site
from kendama_cli.devices.demonstrator.plan_file import TEXT_FORMATS, read_plan, text_format
from kendama_cli.errors import MissingPartError, StoreError, UsageError
from kendama_cli.motion.dmp.plan_text import plan_text
from kendama_cli.motion.dmp.primitive import covariance, sample_plan
from kendama_cli.pipeline.record import find_run, past_runs
from kendama_cli.report.tables import label_and_unit
from kendama_cli.schema.declaration import find_stage, stage_names
from kendama_cli.schema.registry import resolve
from kendama_cli.store import durable
from kendama_cli.store.codecs import load_artifact


def show(source: str | None, stage: str | None, home: Path | None, *, as_json: bool) -> None:
    """Show duration, start, goal, weights, and the deviations of the demonstrations."""
    plan = _plan(source, stage, home)
    deviations = covariance(plan).diagonal() ** 0.5
    facts: dict[str, Any] = {
        "duration_s": plan.duration_s,
        "tau_scale": plan.tau_scale,
        "stiffness": plan.stiffness,
        "phase_decay": plan.phase_decay,
        "n_parameters": plan.n_parameters,
        "demonstrations_vary": bool(len(plan.variation)),
        "duration_deviation_s": float(deviations[0] * plan.duration_s),
    }
    c = len(plan.coordinates)
    rows = [
        {
            "coordinate": name,
            "start_velocity_m_s": float(plan.start_velocity_m_s[i]),
            "goal_m": float(plan.goal_m[i]),
            "goal_deviation_m": float(deviations[1 + c + i]),
            "goal_velocity_m_s": float(plan.goal_velocity_m_s[i]),
            "largest_weight": float(abs(plan.weights[i]).max()),
        }
        for i, name in enumerate(plan.coordinates)
    ]
    if as_json:
        render.document({**facts, "coordinates": rows})
        return
    render.prose(render.figures(facts))
    head = [f"{label} [{unit}]" if unit else label for label, unit in map(label_and_unit, rows[0])]
    render.table([[render.figure(value) for value in row.values()] for row in rows], head=head)


def export(source: str | None, stage: str | None, home: Path | None, output: Path) -> None:
    """Write a primitive as YAML or JSON."""
    _write(_plan(source, stage, home), output)


def sample(
    source: str | None, stage: str | None, home: Path | None, output: Path, *, count: int, scale: float, seed: int
) -> None:
    """Write ``count`` swings drawn from a primitive's distribution; raises UsageError where it has none."""
    plan = _plan(source, stage, home)
    if not len(plan.variation):
        raise UsageError("this primitive comes from one demonstration, so nothing varies; encode several to draw from")
    rng = np.random.default_rng(seed)
    for i in range(count):
        name = output if count == 1 else output.with_stem(f"{output.stem}-{i + 1}")
        _write(sample_plan(plan, rng, scale), name)


def _write(plan: MotionPlan, output: Path) -> None:
    form = text_format(output)
    durable.write_file(output.absolute(), plan_text(plan, form).encode())
    render.text(str(output))


def _plan(source: str | None, stage: str | None, home: Path | None) -> MotionPlan:
    if source is not None and Path(source).suffix.lower() in TEXT_FORMATS:
        return read_plan(source)
    if source is not None and Path(source).is_dir():
        return _of_folder(Path(source))
    kind, folder = _of_run(source, stage, home)
    return primitive_of(load_artifact(kind, folder))


def _of_folder(folder: Path) -> MotionPlan:
    for name in stage_names():
        with contextlib.suppress(MissingPartError, StoreError):  # not to be imported, or gives something else
            kind = _gives(name)
            if kind is not None:
                return primitive_of(load_artifact(kind, folder))
    raise UsageError(f"{folder} holds no primitive that can be read; name the artifact of a stage that gives one")


def _of_run(run: str | None, stage: str | None, home: Path | None) -> tuple[type, Path]:
    place = find_site(home).home
    newest = find_run(place, run)
    for record in [newest] if run is not None else reversed(past_runs(place)):
        for made in record["stages"]:
            kind = _gives(made["stage"]) if made["artifact"] is not None and stage in (None, made["name"]) else None
            if kind is not None:
                return kind, Path(made["artifact"])
    which = f"the run {newest['run']} has" if run is not None else f"the runs in {place} have"
    what = "no primitive" if stage is None else f"no primitive of stage '{stage}'"
    raise UsageError(f"{which} {what}; name another run or --stage, or make one with 'kendama run'")


def _gives(stage: str) -> type | None:
    """Return the artifact that the stage's declaration names, if it is or holds a primitive."""
    declaration = find_stage(stage)
    if declaration is None:  # its package is gone
        return None
    kind: type = resolve(declaration.returns, f"stage '{stage}'")
    return kind if holds_primitive(kind) else None
