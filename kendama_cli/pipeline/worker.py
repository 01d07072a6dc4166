"""The process that runs one stage: ``python -m kendama_cli.pipeline.worker``, a request on its standard input.

Only here are stages and blocks imported. It reports what happens to its parent as JSON lines on standard output; what
the stage or a library prints goes wherever standard error points. Where locks are inherited, the stage's stays held
until this process ends, even where the parent was killed.
"""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import json
import math
import os
import signal
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.errors import KendamaError, StageError, StoreError
from kendama_cli.log.writer import METRICS, is_metric
from kendama_cli.pipeline.artifact_place import LOG
from kendama_cli.pipeline.context import WorkerContext
from kendama_cli.pipeline.inputs import at_places
from kendama_cli.pipeline.nodes import node_schemas
from kendama_cli.pipeline.record import versions
from kendama_cli.schema.artifacts import artifact_type
from kendama_cli.schema.declaration import StageDeclaration, find_stage
from kendama_cli.schema.registry import resolve
from kendama_cli.schema.settings import build_value
from kendama_cli.stages.interface import StageResult
from kendama_cli.store.checkpoint import CheckpointFolder
from kendama_cli.store.codecs import load_artifact, save_artifact
from kendama_cli.store.durable import canonical_json, plain_disk_errors
from kendama_cli.store.store import Store
from kendama_cli.system.interface import system

Emit = Callable[[Mapping[str, Any]], None]
"""Sends one event to the process that started the worker."""


@dataclass(frozen=True)
class ReadyStage:
    """A stage that is imported and constructed, with its settings by its own names for them."""

    declaration: StageDeclaration
    stage: Any
    settings: dict[str, Any]
    returns: type


def main() -> int:
    """Run the stage that standard input asks for; 0 where its artifact is in the store."""
    request = json.loads(sys.stdin.buffer.readline())
    events = os.dup(1)
    os.dup2(2, 1)  # libraries print to 1 without asking Python
    return work(request, events)


def work(request: Mapping[str, Any], events: int, ready: ReadyStage | None = None) -> int:
    """Run ``request`` as its worker and report on the file descriptor ``events``; return the exit code.

    ``ready`` is the stage where it is constructed already.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as Ctrl-C
    signal.signal(signal.SIGTERM, _interrupt)
    channel = os.fdopen(events, "wb")

    def emit(event: Mapping[str, Any]) -> None:
        channel.write(json.dumps(event).encode() + b"\n")
        channel.flush()

    try:
        system().end_with_parent()
        emit(run_stage(request, emit, ready or make_stage(request)))
    except KeyboardInterrupt:
        return 130
    except KendamaError as error:
        _print_traceback()
        emit({"event": "failed", "message": str(error), "unexpected": False, "refused": error.exit_code == 2})
        return 1
    except Exception as error:
        _print_traceback()
        message = f"{type(error).__name__}: {error}".splitlines()[0]
        emit({"event": "failed", "message": message, "unexpected": True})
        return 1
    return 0


def make_stage(request: Mapping[str, Any]) -> ReadyStage:
    """Build the stage that ``request`` names."""
    declaration = _declaration(request)
    stage_class = resolve(declaration.run, f"stage '{request['stage']}'")
    schemas, _ = node_schemas()
    settings = {
        own: build_value(schemas[node["name"]], node["value"], node["name"])
        for own, node in request["settings"].items()
    }
    try:
        inspect.signature(stage_class).bind(**settings)
    except TypeError as error:
        fed = ", ".join(settings) or "none"
        raise StageError(
            f"stage '{request['stage']}' does not take the nodes that its pipeline entry lists under 'config' ({fed}): "
            f"{error}"
        ) from error
    locations = request.get("places", {})  # where files are on this machine; the log has the paths as they were named
    stage = stage_class(**{own: at_places(value, locations) for own, value in settings.items()})
    # what cannot be stored need not be made
    returns = artifact_type(declaration.returns, f"stage '{request['stage']}'")
    return ReadyStage(declaration, stage, settings, returns)


def run_stage(request: Mapping[str, Any], emit: Emit, ready: ReadyStage) -> dict[str, Any]:
    """Run the stage of ``request`` with its inputs and store its result; return the event that reports it."""
    given = _Given(
        {
            own: load_artifact(artifact_type(one["returns"], f"stage '{own}'"), Path(one["folder"]))
            for own, one in request["given"].items()
        }
    )
    store = Store(Path(request["home"]))
    checkpoints = CheckpointFolder(store.checkpoint_folder(request["stage"], request["key"]))
    if request["fresh"]:
        checkpoints.discard()
    topics = ready.declaration.topics
    context = WorkerContext(
        seed=request["seed"],
        checkpoints=checkpoints,
        topics=topics,
        emit=emit,
        attended=bool(request.get("attended")),
    )
    with contextlib.closing(context):
        try:
            made = ready.stage.run(given, context)
        except BaseException as error:
            # of a computation that was interrupted the checkpoint stays; of one that failed only its log says why
            if ready.declaration.kind != "computes" or isinstance(error, StageError):
                _keep_log(request, context, ready.settings, str(error))
            raise
        return _finish(request, store, context, ready, made)


def _keep_log(request: Mapping[str, Any], context: WorkerContext, settings: Mapping[str, Any], stopped: str) -> None:
    """Return the log of a stage that broke off, which lies beside its run."""
    if "broken_off" not in request or not len(context.log):
        return
    metrics = {"completed": False, "warnings": f"the stage broke off: {stopped}" if stopped else "it was interrupted"}
    with contextlib.suppress(OSError, StoreError):  # a full disk: what broke the stage off is the better message
        context.log.finish(
            request["broken_off"], stage=request["stage"], settings=_plain_settings(settings), metrics=metrics
        )


def _finish(
    request: Mapping[str, Any], store: Store, context: WorkerContext, ready: ReadyStage, made: Any
) -> dict[str, Any]:
    """Keep what the stage made; the event that reports it."""
    if not isinstance(made, StageResult):
        raise StageError(
            f"stage '{request['stage']}' returned a {type(made).__name__}, not a StageResult(artifact, metrics)"
        )
    metrics = {key: _plain(value) for key, value in made.metrics.items()}
    for key, value in metrics.items():
        if not is_metric(value):
            raise StageError(f"stage '{request['stage']}': its metric '{key}' is a {type(value).__name__}; {METRICS}")
    if made.warnings:
        metrics["warnings"] = "\n".join(made.warnings)
    with store.scratch_folder() as folder, plain_disk_errors(folder):
        save_artifact(ready.returns, made.artifact, folder, f"stage '{request['stage']}'")
        (folder / "metrics.json").write_bytes(canonical_json(metrics) + b"\n")
        settings = _plain_settings(ready.settings)
        context.log.finish(folder / LOG, stage=request["stage"], settings=settings, metrics=metrics)
        result = store.put(folder, request["stage"], request["key"], metrics, request["parts"], made_with=versions())
    return {"event": "done", "artifact": str(result.artifact), "metrics": metrics}


def _plain_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {own: dataclasses.asdict(value) for own, value in settings.items()}


def _declaration(request: Mapping[str, Any]) -> StageDeclaration:
    found = find_stage(request["declared"])
    if found is None:
        raise StageError(f"stage '{request['declared']}' is not installed any more; install its package again")
    return found


def _print_traceback() -> None:
    with contextlib.suppress(OSError):  # a full disk takes no traceback either; the message goes through the pipe
        traceback.print_exc()


class _Given(dict[str, Any]):
    """Artifacts by the stage's own names for them."""

    def __missing__(self, name: str) -> Any:
        listed = ", ".join(self) or "nothing"
        raise StageError(f"the stage takes '{name}', but its pipeline entry lists {listed} under 'needs'; add it there")


def _plain(value: Any) -> Any:
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _interrupt(signum: int, frame: Any) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # all is written; an ending interpreter first frees every module, a fifth of what importing takes
