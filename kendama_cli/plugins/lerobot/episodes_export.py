"""``kendama log export --format lerobot``: what a run's stages offer to learn from, each as a dataset of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from kendama_cli.errors import InputError, UsageError
from kendama_cli.pipeline.artifact_place import LOG, log_path
from kendama_cli.pipeline.log_export import ExportRequest
from kendama_cli.pipeline.record import find_run, past_runs
from kendama_cli.report.source import StageLog
from kendama_cli.schema.declaration import find_stage, stage_names
from kendama_cli.schema.registry import resolve


def export_episodes(request: ExportRequest) -> list[Path]:
    """Write the datasets of a place: of a RUN a folder for each of its stages; return the folders written.

    Raises UsageError where there is nothing to learn from or a folder is not empty, InputError for a log that cannot be
    read.
    """
    if request.topic is not None:
        raise UsageError("--format lerobot takes no --topic: it reads all that its episodes need")
    home, place, output, fps = request.home, request.place, request.output, request.fps
    folder = output or Path(f"{place.strip('/').replace('/', '-').removesuffix('.mcap')}-lerobot")
    whole_run = _is_run(home, place)
    written = []
    for name, path in _logs(home, place) if whole_run else [("", log_path(home, place))]:
        target = folder / name
        if target.exists() and (not target.is_dir() or any(target.iterdir())):
            raise UsageError(f"'{target}' is there already and not empty; name another folder with -o")
        if _write(path, target, fps):
            written.append(target)
    if not written:
        known = ", ".join(name for name in stage_names() if _offers(name))
        raise UsageError(f"'{place}' holds no episodes to learn from; the logs of {known} do")
    return written


def _is_run(home: Path, place: str) -> bool:
    """Return True if ``place`` names a whole run: no file, no RUN/STAGE, and no stage of a run there is."""
    if "/" in place or place.endswith(".mcap") or Path(place).exists():
        return False
    return not any(made["name"] == place for record in past_runs(home) for made in record["stages"])


def _logs(home: Path, run: str) -> Iterator[tuple[str, Path]]:
    """Yield the name and log of each stage of ``run`` whose log is stored and offers episodes."""
    for made in find_run(home, run)["stages"]:
        if made["artifact"] is not None and _offers(str(made["stage"])):
            yield str(made["name"]), Path(made["artifact"]) / LOG


def _offers(stage: str) -> bool:
    declaration = find_stage(stage)
    return declaration is not None and declaration.episodes is not None


def _write(path: Path, target: Path, fps: int) -> bool:
    """Write the log at ``path`` to ``target``; return True if it had episodes."""
    if not path.exists():
        raise InputError(str(path), "is not there", remedy="'kendama run' makes it again")
    log = StageLog(path)
    for name in stage_names():  # a log tells the pipeline's name of its stage; its topics tell whose it is
        declaration = find_stage(name)
        if declaration is None or declaration.episodes is None or not log.topics_under(f"/{name}/"):
            continue
        made = resolve(declaration.episodes, f"the episodes of stage '{name}'")(log, fps)
        if made is not None:
            from kendama_cli.plugins.lerobot.dataset import write_dataset  # noqa: PLC0415 - needs the extra parquet

            write_dataset(made, target)
            return True
    return False
