"""Artifact that a command takes from a pipeline: that of the stage that declares it as its output."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.cli import render
from kendama_cli.cli.progress import PlainLines, observer
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.errors import StageError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import begin
from kendama_cli.pipeline.runner import Runner
from kendama_cli.pipeline.where import open_store
from kendama_cli.store.codecs import load_artifact


@dataclass(frozen=True)
class PipelineResult:
    """An artifact, and the configuration that it was made with: as plain values, and built."""

    artifact: Any
    config: dict[str, Any]
    settings: dict[str, Any]


def run_for(kind: type, site: Site, pipeline: str, overrides: list[str], *, as_json: bool) -> PipelineResult:
    """Run what ``pipeline`` needs for its first stage that returns a ``kind``; a cached result is taken as it is.

    Raises UsageError where no stage of it gives one, StageError where the run ends without it.
    """
    declared = load_pipeline(pipeline, site.pipeline_folders)
    declared = declared.until(declared.giving(kind).name)
    config = composed(site, [*declared.overrides, *overrides])
    settings = build_settings(config)
    planner = Planner(open_store(site.home, settings, render.note), declared, settings, site.data_roots)
    record = begin(site.home, pipeline, overrides)
    with PlainLines() if as_json else observer() as view:
        Runner(planner, record, view).run()
    last = record.stages[-1]
    if record.outcome != "done" or last.artifact is None:
        raise StageError(last.error or f"{last.name} gave nothing")
    return PipelineResult(load_artifact(kind, Path(last.artifact)), config, settings)
