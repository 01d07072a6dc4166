"""Past runs: list, choose, sort and tag them, and say what differs between two."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kendama_cli.cli import completion, render
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import Home, Json
from kendama_cli.config.site import find_site

runs_app = typer.Typer(
    cls=open_group("runs"), help="List past runs; choose, sort and tag them.", invoke_without_command=True
)

COLUMNS = ("run", "started", "pipeline", "outcome", "tags", "overrides")


@runs_app.callback()
def runs(
    context: typer.Context,
    conditions: Annotated[
        list[str] | None,
        typer.Option(
            "--filter",
            metavar="CONDITION",
            help="Only runs of which this holds: 'learn.alpha>0.3', outcome=done, tags~good; repeat for more.",
        ),
    ] = None,
    sort: Annotated[
        str | None,
        typer.Option(metavar="KEY", help="Key to sort by: of the configuration or STAGE.METRIC, smallest first."),
    ] = None,
    columns: Annotated[
        str | None, typer.Option(metavar="KEY,...", help=f"Columns beside the run's id [{','.join(COLUMNS[1:])}].")
    ] = None,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """List past runs; choose, sort and tag them."""
    if context.invoked_subcommand is None:
        _list(find_site(home).home, conditions or [], sort, columns, as_json=as_json)


@runs_app.command("tag")
def tag(
    run: Annotated[str, typer.Argument(metavar="RUN", help="Id of a run.", autocompletion=completion.runs)],
    tags: Annotated[list[str] | None, typer.Argument(metavar="[TAG]...", help="Tags to add.")] = None,
    remove: Annotated[list[str] | None, typer.Option(metavar="TAG", help="Take this tag away.")] = None,
    note: Annotated[str | None, typer.Option(metavar="TEXT", help="Note on this run.")] = None,
    home: Home = None,
) -> None:
    """Put tags and a note on a run."""
    from kendama_cli.pipeline.record import find_run
    from kendama_cli.pipeline.run_tags import write_tags

    folder = find_site(home).home
    name = str(find_run(folder, run)["run"])
    made = write_tags(folder, name, tags or [], remove or [], note)
    render.text(f"{name}: {' '.join(made.tags) or 'no tags'}{f'; {made.note}' if made.note else ''}")


def diff(
    before: Annotated[str, typer.Argument(metavar="RUN", help="Id of a run.", autocompletion=completion.runs)],
    after: Annotated[
        str | None,
        typer.Argument(metavar="[RUN]", help="Id of another; the newest if left out.", autocompletion=completion.runs),
    ] = None,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """Show the differences between two runs: configuration, code, versions, artifacts, metrics."""
    from kendama_cli.pipeline.record import find_run
    from kendama_cli.pipeline.run_diff import run_differences
    from kendama_cli.store.store import Store

    folder = find_site(home).home
    document = run_differences(Store(folder), find_run(folder, before), find_run(folder, after))
    if as_json:
        render.document(document)
    else:
        _show(document)


def _list(home: Path, conditions: list[str], sort: str | None, columns: str | None, *, as_json: bool) -> None:
    from kendama_cli.pipeline.record import each_run, read_run, unreadable_notice
    from kendama_cli.pipeline.run_facts import RECORDED, FactReader, condition, in_order, unknown_fact
    from kendama_cli.store.runs import record_path
    from kendama_cli.store.store import Store

    tests = [condition(text) for text in conditions]
    head = COLUMNS if columns is None else ("run", *(name.strip() for name in columns.split(",")))
    asked = [*(one.key for one in tests), *([sort] if sort else []), *head]
    reader = FactReader(Store(home), asked)
    found: list[dict[str, Any]] = []
    seen, newest, unreadable = set(RECORDED), None, 0
    for record, run in each_run(home):  # thousands of records are not held at once
        if record is None:
            unreadable += record_path(home, run).exists()
            continue
        newest, facts = record, reader.facts(record)
        seen.update(facts)
        if all(one.holds(facts) for one in tests):
            found.append({name: facts[name] for name in ("run", "tags", "note", *asked) if name in facts})
    if unreadable:
        render.note(unreadable_notice(home, unreadable))
    unknown = next((key for key in asked if key not in seen), None)
    if newest is not None and unknown is not None:
        raise unknown_fact(unknown, reader.all_keys(newest))
    found = in_order(found, sort)
    if as_json:
        records = ((read_run(home, one["run"]), one) for one in found)
        render.documents(
            {**record, "tags": one["tags"].split(), "note": one["note"]} for record, one in records if record
        )
        return
    render.table([[_cell(one.get(name)) for name in head] for one in found], head=head)


def _cell(value: Any) -> str:
    return "" if value is None else value if isinstance(value, str) else render.figure(value)


def _show(document: dict[str, Any]) -> None:
    before, after = document["runs"]
    render.text(f"{before} -> {after}")
    for what, title in (("config", "configuration"), ("versions", "versions")):
        _show_pairs(title, document[what])
    render.text(f"code: {'changed in ' + ', '.join(document['code']) if document['code'] else 'the same'}")
    rows = [(name, state) for name, state in document["artifacts"].items()]
    render.table(rows, head=("stage", "artifact"))
    _show_pairs("metrics", document["metrics"])
    for key, one in document["intervals"].items():
        texts = [
            f"{render.figure(value)} [{render.figure(low)}, {render.figure(high)}]"
            for value, (low, high) in zip(one["values"], one["bounds"], strict=True)
        ]
        verdict = "the intervals overlap: noise" if one["overlap"] else "the intervals do not overlap"
        render.text(f"{key}: {texts[0]} -> {texts[1]}, {verdict}")


def _show_pairs(title: str, pairs: dict[str, list[Any]]) -> None:
    render.text(f"{title}: {'' if pairs else 'the same'}".rstrip())
    for key, (old, new) in pairs.items():
        render.text(f"  {key}: {_cell(old) or '-'} -> {_cell(new) or '-'}")
