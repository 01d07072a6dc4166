"""The commands beside the pipeline's own: the store, and logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kendama_cli.cli import completion, render
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import ConfigDir, Home, Json, LogPlace, RemotePlace
from kendama_cli.config.site import find_site
from kendama_cli.schema.registry import brought

cache_app = typer.Typer(cls=open_group("cache"), help="Look after the store of finished work.", no_args_is_help=True)
log_app = typer.Typer(cls=open_group("log"), help="Look into MCAP logs.", no_args_is_help=True)


@cache_app.command("path")
def cache_path(
    place: Annotated[
        str,
        typer.Argument(
            metavar="RUN/STAGE",
            help="Or STAGE alone: of the newest run that has it.",
            autocompletion=completion.artifacts,
        ),
    ],
    home: Home = None,
) -> None:
    """Print the folder of a stage's artifact, in which its log lies as well.

    Example: kendama cache path learn
    """
    from kendama_cli.pipeline.artifact_place import artifact_folder

    render.text(str(artifact_folder(find_site(home).home, place)))


@cache_app.command("ls")
def cache_ls(as_json: Json = False, home: Home = None) -> None:
    """List what is stored: stage, key, size, artifact, metrics.

    Example: kendama cache ls
    """
    import dataclasses

    from kendama_cli.store.store import Store

    entries = Store(find_site(home).home).entries()
    if as_json:
        render.document([{**dataclasses.asdict(item), "artifact": str(item.artifact)} for item in entries])
        return
    rows = [
        (item.stage, item.key[:12], _size(item.artifact), item.artifact.name[:12], render.figures(item.metrics, 3))
        for item in entries
    ]
    render.table(rows, head=("stage", "key", "size", "artifact", "metrics"))


@cache_app.command("verify")
def cache_verify(
    remote: RemotePlace = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None
) -> int:
    """Read every stored byte and name what is damaged; damaged work is computed again when it is next needed.

    Example: kendama cache verify
    """
    if remote is not None:
        verify_remote = brought("cache verify --remote", "kendama.remotes", "verify")
        return int(verify_remote(find_site(home, config_dir), remote, as_json=as_json))
    from kendama_cli.store.garbage import verify
    from kendama_cli.store.store import Store

    damage = verify(Store(find_site(home).home))
    if as_json:
        render.document({"damaged": [{"path": str(item.path), "problem": item.problem} for item in damage]})
    elif damage:
        for item in damage:
            render.text(f"{item.path}: {item.problem}")
        render.error(f"{len(damage)} damaged; 'kendama cache gc' removes them, 'kendama run' computes them again")
    else:
        render.text("every byte is as it was written")
    return 1 if damage else 0


@cache_app.command("gc")
def cache_gc(
    keep_runs: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Forget all but the newest N runs and what only they used.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only name what would be deleted.")] = False,
    home: Home = None,
) -> None:
    """Delete damaged entries, artifacts that nothing names, and what killed runs left behind.

    Example: kendama cache gc --keep-runs 20 --dry-run
    """
    from kendama_cli.store.garbage import collect_garbage
    from kendama_cli.store.store import Store

    done = collect_garbage(Store(find_site(home).home), keep_runs, dry_run=dry_run)
    for path in done.deleted:
        render.text(f"{'would delete' if dry_run else 'deleted'} {path}")
    for path in done.left:
        render.text(f"left {path}: it is, holds or is reached through something that kendama did not make")
    render.text(f"{len(done.deleted)} {'would be ' if dry_run else ''}deleted")


@log_app.command("info")
def log_info(file: LogPlace, as_json: Json = False, home: Home = None) -> None:
    """Show the content of an MCAP log.

    Example: kendama log info adapt
    """
    from kendama_cli.log.export import describe  # pandas
    from kendama_cli.pipeline.artifact_place import log_path

    facts = describe(log_path(find_site(home).home, file))
    if as_json:
        render.document(facts)
    else:
        _show_log(facts)


@log_app.command("export")
def log_export(
    file: LogPlace,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="PATH",
            help="FILE.csv, FILE.parquet, a folder [the log's or stage's name .csv].",
        ),
    ] = None,
    topic: Annotated[str | None, typer.Option(metavar="TOPIC", help="Only this topic.")] = None,
    form: Annotated[
        str,
        typer.Option(
            "--format",
            metavar="FORMAT",
            help="table, or lerobot: the demonstrations and games of a RUN as LeRobot datasets.",
            autocompletion=completion.export_formats,
        ),
    ] = "table",
    fps: Annotated[int, typer.Option(min=1, max=1000, help="Frames per second of a dataset.")] = 50,
    home: Home = None,
) -> None:
    """Export an MCAP log to CSV or Parquet, or as a LeRobot dataset.

    Example: kendama log export learn -o learn.csv
    """
    from kendama_cli.pipeline.log_export import ExportRequest, exporter

    for path in exporter(form)(ExportRequest(find_site(home).home, file, output, topic, fps)):
        render.text(str(path))


def _show_log(facts: dict[str, Any]) -> None:
    render.text(f"{facts['path']}: {facts['messages']} messages, {facts['duration_s']:.3f} s")
    rows = [(item["topic"], item["schema"], str(item["messages"])) for item in facts["channels"]]
    render.table(rows, head=("topic", "schema", "messages"))


def _size(folder: Path) -> str:
    size = sum(file.stat().st_size for file in folder.iterdir())
    return f"{size / 1e6:.2f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"
