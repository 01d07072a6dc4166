"""Past runs: list, choose, sort and tag them, compare their metrics, and say what differs between two."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from kendama_cli.cli import completion, render
from kendama_cli.cli.fitted import terminal_columns
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import Home, Json
from kendama_cli.config.site import find_site
from kendama_cli.errors import UsageError


class _RunsGroup(open_group("runs")):  # type: ignore[misc]
    """Group whose words are runs where none of them is a command."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse; words that select runs are kept for the callback."""
        if self.commands.keys() & set(args):
            return list(super().parse_args(ctx, args))
        ctx.allow_interspersed_args = True
        super().parse_args(ctx, args)
        ctx.meta[SELECTED] = [*ctx._protected_args, *ctx.args]
        ctx._protected_args, ctx.args = [], []
        return []

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words of the usage line."""
        return ["[OPTIONS]", "[RUN]...", "|", "COMMAND [ARGS]..."]


runs_app = typer.Typer(
    cls=_RunsGroup,
    help="List past runs; choose, sort and tag them, and compare their metrics. RUN: an id or number, a range 1..40, "
    "sweep:NAME, or last.",
    invoke_without_command=True,
)

SELECTED = "kendama.selected"
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
        str | None,
        typer.Option(
            metavar="KEY,...",
            help=f"Columns beside the run's id [{','.join(COLUMNS[1:])}]; of --table, metrics STAGE.METRIC.",
        ),
    ] = None,
    table: Annotated[
        bool,
        typer.Option(
            "--table", help="Compare metrics: a row for equal overrides, means and 95 % intervals over seeds."
        ),
    ] = False,
    markdown: Annotated[bool, typer.Option("--md", help="Print --table as Markdown.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print --table as CSV, with every digit.")] = False,
    precision: Annotated[
        int | None, typer.Option(metavar="N", min=1, max=17, help="Significant digits of --table [4].")
    ] = None,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """List past runs; choose, sort and tag them, and compare their metrics."""
    if context.invoked_subcommand is not None:
        return
    folder, selected = find_site(home).home, list(context.meta.get(SELECTED, []))
    if not (table or markdown or as_csv):
        if precision is not None:
            raise UsageError("--precision is for 'kendama runs --table'; add --table")
        _list(folder, selected, conditions or [], sort, columns, as_json=as_json)
        return
    from kendama_cli.cli.run_table_view import TableForm, show_run_table
    from kendama_cli.pipeline.run_selection import LAST

    records = _chosen(folder, selected or [LAST], conditions or [])
    kind = "json" if as_json else "csv" if as_csv else "md" if markdown else "text"
    show_run_table(records, [one.strip() for one in (columns or "").split(",") if one], TableForm(kind, precision))


@runs_app.command("tag")
def tag(
    run: Annotated[str, typer.Argument(metavar="RUN", help="Id of a run.", autocompletion=completion.runs)],
    tags: Annotated[list[str] | None, typer.Argument(metavar="[TAG]...", help="Tags to add.")] = None,
    remove: Annotated[list[str] | None, typer.Option(metavar="TAG", help="Take this tag away.")] = None,
    note: Annotated[str | None, typer.Option(metavar="TEXT", help="Note on this run.")] = None,
    home: Home = None,
) -> None:
    """Put tags and a note on a run.

    Example: kendama runs tag 12 good
    """
    from kendama_cli.pipeline.record import find_run
    from kendama_cli.pipeline.run_tags import write_tags

    folder = find_site(home).home
    name = str(find_run(folder, run)["run"])
    made = write_tags(folder, name, tags or [], remove or [], note)
    render.text(f"{name}: {' '.join(made.tags) or 'no tags'}{f'; {made.note}' if made.note else ''}")


def diff(
    before: Annotated[
        str,
        typer.Argument(
            metavar="RUN",
            help="Id of a run; or several: a range 1..40, sweep:NAME.",
            autocompletion=completion.selections,
        ),
    ],
    after: Annotated[
        str | None,
        typer.Argument(
            metavar="[RUN]",
            help="Id of another, or several; the newest if left out.",
            autocompletion=completion.selections,
        ),
    ] = None,
    as_json: Json = False,
    home: Home = None,
) -> None:
    """Show the differences between two runs (configuration, code, versions, artifacts, metrics) or two sweeps.

    Example: kendama diff 1 2
    """
    from kendama_cli.pipeline.run_diff import group_differences, run_differences
    from kendama_cli.pipeline.run_selection import select_runs
    from kendama_cli.store.store import Store

    folder = find_site(home).home
    first, second = select_runs(folder, [before]), select_runs(folder, [after] if after else [])
    if len(first) == len(second) == 1:
        document = run_differences(Store(folder), first[0], second[0])
        render.document(document) if as_json else _show(document)
        return
    document = group_differences(first, second)
    document["runs"] = [before, after or str(second[0]["run"])]
    render.document(document) if as_json else _show_groups(document)


def _chosen(home: Path, selected: list[str], conditions: list[str]) -> list[dict[str, Any]]:
    """Return the selected records of which every condition holds; raises UsageError if there are none."""
    from kendama_cli.pipeline.run_facts import FactReader, condition
    from kendama_cli.pipeline.run_selection import select_runs
    from kendama_cli.store.store import Store

    tests = [condition(text) for text in conditions]
    reader = FactReader(Store(home), [one.key for one in tests])
    records = select_runs(home, selected)
    found = [record for record in records if all(one.holds(reader.facts(record)) for one in tests)]
    if not found:
        raise UsageError(f"none of {len(records)} runs meets {' and '.join(conditions)}; 'kendama runs' lists them")
    return found


def _list(
    home: Path, selected: list[str], conditions: list[str], sort: str | None, columns: str | None, *, as_json: bool
) -> None:
    from kendama_cli.pipeline.record import each_run, read_run, unreadable_notice
    from kendama_cli.pipeline.run_facts import RECORDED, FactReader, condition, in_order, unknown_fact
    from kendama_cli.pipeline.run_selection import select_runs
    from kendama_cli.store.home import record_path
    from kendama_cli.store.store import Store

    tests = [condition(text) for text in conditions]
    head = COLUMNS if columns is None else ("run", *(name.strip() for name in columns.split(",")))
    asked = [*(one.key for one in tests), *([sort] if sort else []), *head]
    reader = FactReader(Store(home), asked)
    found: list[dict[str, Any]] = []
    seen, newest, unreadable = set(RECORDED), None, 0
    chosen = ((record, str(record["run"])) for record in select_runs(home, selected)) if selected else each_run(home)
    for record, run in chosen:  # thousands of records are not held at once
        if record is None:
            unreadable += record_path(home, run).exists()
            continue
        newest, facts = record, reader.facts(record)
        seen.update(facts)
        if all(one.holds(facts) for one in tests):
            found.append({name: facts[name] for name in ("run", "tags", "note", "sweep", *asked) if name in facts})
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
    if columns is None and any(one["sweep"] for one in found):
        head = (*head[:-1], "sweep", head[-1])
    if columns is None and terminal_columns():
        found = [{**one, "started": _minute(one["started"])} for one in found]
    optional = ("started", "pipeline") if columns is None else ()
    render.table([[_cell(one.get(name)) for name in head] for one in found], head=head, optional=optional)
    render.note(f"home: {render.short(home)}")


def _minute(started: str) -> str:
    """Return a time as the clock here shows it, to the minute."""
    return f"{datetime.fromisoformat(started).astimezone():%Y-%m-%d %H:%M}"


def _cell(value: Any) -> str:
    return "" if value is None else value if isinstance(value, str) else render.figure(value)


def _show(document: dict[str, Any]) -> None:
    before, after = document["runs"]
    render.text(f"{before} -> {after}")
    for what, title in (("config", "configuration"), ("versions", "versions")):
        _show_pairs(title, document[what])
    render.prose(f"code: {'changed in ' + ', '.join(document['code']) if document['code'] else 'the same'}")
    rows = [(name, state) for name, state in document["artifacts"].items()]
    render.table(rows, head=("stage", "artifact"))
    _show_pairs("metrics", document["metrics"])
    for key, one in document["intervals"].items():
        _show_interval(key, one)


def _show_interval(key: str, one: dict[str, Any]) -> None:
    texts = [
        f"{render.figure(value)} [{render.figure(low)}, {render.figure(high)}]"
        for value, (low, high) in zip(one["values"], one["bounds"], strict=True)
    ]
    verdict = "the intervals overlap: noise" if one["overlap"] else "the intervals do not overlap"
    render.prose(f"{key}: {texts[0]} -> {texts[1]}, {verdict}")


def _show_groups(document: dict[str, Any]) -> None:
    (before, after), (first, second) = document["runs"], document["counts"]
    render.text(f"{before} ({first} runs) -> {after} ({second} runs)")
    _show_pairs("overrides", document["overrides"])
    render.text("metrics: mean [95 % interval] over the runs")
    for key, one in document["intervals"].items():
        _show_interval(f"  {key}", one)


def _show_pairs(title: str, pairs: dict[str, list[Any]]) -> None:
    render.text(f"{title}: {'' if pairs else 'the same'}".rstrip())
    for key, (old, new) in pairs.items():
        render.prose(f"  {key}: {render.change(old, new)}")
