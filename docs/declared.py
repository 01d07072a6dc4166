"""Sphinx extension: lists of stages, settings, topics and metrics on pages, read from their declarations.

Where a page says ``<!-- declared: NAME -->`` alone on a line, Markdown of the function NAME takes its place; a word
behind the name is its argument. A link to
a CSV file alone on a line becomes its table, above the link.
"""

from __future__ import annotations

import csv
import dataclasses
import inspect
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml
from typer.main import get_command

from kendama_cli import api
from kendama_cli import errors as kendama_errors
from kendama_cli.cli.app import app
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, bundled_root, find_site
from kendama_cli.errors import KendamaError
from kendama_cli.pipeline.catalogue import load_pipeline, pipeline_names
from kendama_cli.pipeline.nodes import node_schemas
from kendama_cli.schema.declaration import StageDeclaration, find_stage, stage_names
from kendama_cli.schema.messages import codec
from kendama_cli.schema.setting_facts import allowed_values, has_kind, listed_items, sentence, setting_fields
from kendama_cli.schema.settings import variants

LONGEST = 60
"""Values with more characters are left out of a table."""
_ROW = re.compile(r"^\|.*$", re.M)
NO_BREAK = "\N{NO-BREAK SPACE}"
_PLACE = re.compile(r"^<!-- declared: (\w+)(?: ([\w /*-]+))? -->$", re.M)
_DATA = re.compile(r"^\[[^\]]+\]\(([\w/]+\.csv)\)$", re.M)


def setup(app: Any) -> dict[str, Any]:
    """Connect the filling of pages; Sphinx calls this."""
    app.connect("source-read", _fill)
    return {"parallel_read_safe": True}


def _fill(app: Any, name: str, source: list[str]) -> None:
    folder = (Path(app.srcdir) / name).parent
    text = _DATA.sub(lambda found: f"{data_table(folder / found[1])}\n{found[0]}", filled(source[0]))
    source[0] = _ROW.sub(lambda found: _unbroken(found[0]), text)


def filled(text: str) -> str:
    """Return a page with what is declared in each place for it."""
    return _PLACE.sub(lambda found: PARTS[found[1]](*filter(None, [found[2]])), text)


def _unbroken(row: str) -> str:
    """Return a row of a table in which no interval and no bound breaks into two lines."""
    row = re.sub(r"\[(-?[\d.]+), (-?[\d.]+)(?: %)?\]", lambda found: found[0].replace(" ", NO_BREAK), row)
    return re.sub(r"([≥≤<>]) (?=\d)", rf"\1{NO_BREAK}", row)


def data_table(path: Path) -> str:
    """Return the table in Markdown of a CSV file, whose first row is its head."""
    head, *rows = csv.reader(path.read_text().splitlines())
    return "\n".join(_table(tuple(head), [tuple(row) for row in rows]))


def stages() -> str:
    """Return a section for each stage: its purpose, headline metrics, topics and settings."""
    settings = _Settings()
    declarations = [one for name in stage_names() if (one := find_stage(name)) is not None]
    return "\n".join(line for one in declarations for line in _stage(one, settings))


def nodes() -> str:
    """Return a section for each node of the configuration that several stages read."""
    settings = _Settings()
    schemas, error = node_schemas()
    if error is not None:
        raise error
    brought = {name for stage in stage_names() if (one := find_stage(stage)) is not None for name in one.settings}
    lines = []
    for name in sorted(set(schemas) - brought):
        lines += [f"## Node {name}", "", *settings.tables(name, schemas[name]), ""]
    return "\n".join(lines)


def overview() -> str:
    """Return a table of the stages of the default pipeline, then of all others, with their purpose and result."""
    first = [spec.name for spec in load_pipeline("kendama", _pipeline_folders()).stages]
    names = [*first, *(name for name in stage_names() if name not in first)]
    found = [one for name in names if (one := find_stage(name)) is not None]
    rows = [(f"[`{one.name}`](settings.md#stage-{one.name})", one.lead, f"`{_returned(one)}`") for one in found]
    return "\n".join(_table(("stage", "what it does", "returns"), rows))


def pipelines() -> str:
    """Return a table of the bundled pipelines: the first sentence of each file, and its stages."""
    folders, rows = _pipeline_folders(), []
    for name in pipeline_names(folders):
        lead = (folders[0] / f"{name}.yaml").read_text().splitlines()[0].removeprefix("# ")
        stages = ", ".join(f"`{spec.name}`" for spec in load_pipeline(name, folders).stages)
        rows.append((f"`{name}`", lead, stages))
    return "\n".join(_table(("pipeline", "content", "stages"), rows))


def choices(words: str) -> str:
    """Return a table of the choices of a group of ``conf/``, all or those of a pattern, by the lead of each file."""
    group, pattern = (*words.split(), "*")[:2]
    rows = []
    with tempfile.TemporaryDirectory() as empty:
        folders = find_site(Path(empty)).conf_folders
    for folder in folders:
        for path in sorted((folder / group).glob(f"{pattern}.yaml")):
            lines = path.read_text().splitlines()
            rows.append((f"`{path.stem}`", next(one for one in lines if "@package" not in one).removeprefix("# ")))
    return "\n".join(_table((group, "content"), rows))


def topics() -> str:
    """Return a table of all topics: the schema of their messages, and what they hold."""
    rows = [
        (f"`{topic}`", codec(kind).schema, stage.topic_words.get(topic, ""))
        for name in stage_names()
        if (stage := find_stage(name)) is not None
        for topic, kind in stage.topics.items()
    ]
    return "\n".join(_table(("topic", "schema", "meaning"), rows))


def errors() -> str:
    """Return a table of the exit codes, and one of the error classes with their meaning."""
    codes = [("0", "done"), ("1", "a stage or a file failed"), ("2", "the request was wrong"), ("130", "interrupted")]
    kinds = [one for one in vars(kendama_errors).values() if isinstance(one, type) and issubclass(one, KendamaError)]
    rows = [(f"`{one.__name__}`", one.__base__.__name__, str(one.exit_code), _plain(one.__doc__)) for one in kinds]
    table = _table(("class", "derives from", "exit code", "meaning"), rows)
    return "\n".join([*_table(("exit code", "meaning"), codes), *table])


def python() -> str:
    """Return the functions of the Python interface, then its classes, by their docstrings."""
    objects = {name: getattr(api, name) for name in api.__all__}
    functions = [name for name, one in objects.items() if inspect.isfunction(one)]
    lines = ["## Functions", "", *_documented("autofunction", functions)]
    return "\n".join([*lines, "## Classes", "", *_documented("autoclass", sorted(set(objects) - set(functions)))])


def _documented(directive: str, names: list[str]) -> Iterator[str]:
    options = ["   :members:"] if directive == "autoclass" else []
    yield "```{eval-rst}"
    for name in names:
        yield from (f".. {directive}:: kendama_cli.api.{name}", *options, "")
    yield from ("```", "")


def environment(words: str) -> str:
    """Return the ``head``, ``actions``, ``observations`` or ``arguments`` of an environment's page."""
    import environments  # noqa: PLC0415 - beside this file, and needs Gymnasium

    part, name = words.split()
    return "\n".join(environments.PARTS[part](name))


def help_of(words: str) -> str:
    """Return the ``--help`` of a command, and of those below it, at 80 columns."""
    command: Any = get_command(app)
    context = command.make_context("kendama", [], resilient_parsing=True, terminal_width=80)
    for word in words.split():
        command = command.get_command(context, word)
        context = command.make_context(word, [], parent=context, resilient_parsing=True, terminal_width=80)
    below = command.list_commands(context) if hasattr(command, "list_commands") else []
    own = f"```text\n$ kendama {words} --help\n{command.get_help(context).strip()}\n```\n"
    return "\n".join([own, *(f"### kendama {words} {name}\n\n{help_of(f'{words} {name}')}" for name in below)])


def _pipeline_folders() -> list[Path]:
    return [bundled_root() / "pipelines"]


def _codes(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _returned(stage: StageDeclaration) -> str:
    return stage.returns.partition(":")[2]


def _stage(stage: StageDeclaration, settings: _Settings) -> Iterator[str]:
    yield from (f"## Stage {stage.name}", "", stage.lead, "", f"Returns `{_returned(stage)}`.", "")
    yield from _table(("metric", "meaning"), [(f"`{name}`", words) for name, words in stage.metrics.items()])
    fields = {topic: [one.name for one in dataclasses.fields(kind)] for topic, kind in stage.topics.items()}
    rows = [(f"`{topic}`", stage.topic_words.get(topic, ""), _codes(names)) for topic, names in fields.items()]
    yield from _table(("topic", "meaning", "fields"), rows)
    yield from _table(("figure", "meaning"), [(f"`{name}`", words) for name, words in stage.figures.items()])
    for name, schema in stage.settings.items():
        yield from settings.tables(name, schema)


class _Settings:
    """Tables of settings; the values are those of the bundled ``conf/``."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._site: Site = find_site(Path(self._folder.name))
        self._defaults = composed(self._site, [])
        self._chosen: dict[str, Mapping[str, Any]] = {}

    def tables(self, name: str, schema: Any) -> Iterator[str]:
        """Yield the table of node ``name``, and one for each variant that can stand below it."""
        waiting: list[tuple[str, Any, str | None]] = [(name, schema, None)]
        while waiting:
            key, annotation, choice = waiting.pop(0)
            kinds = variants(annotation)
            if choice is None and has_kind(kinds):
                waiting = [*((key, one, kind) for kind, one in kinds.items()), *waiting]
                continue
            title = f"`{key}`" if choice is None else f"`{key}`, kind `{choice}`"
            root = next(iter(kinds.values()))
            rows, deeper = [], []
            for path, entry, hint in setting_fields(root, key):
                if has_kind(variants(hint)):
                    deeper.append((path, hint, None))
                elif (items := listed_items(hint)) is not None:
                    deeper.append((f"{path}[]", items, None))
                else:
                    rows.append((f"`{path}`", *self._row(path, key, choice, entry, hint)))
            yield from (f"### {title}", "")
            if root.__doc__ and not root.__doc__.startswith(f"{root.__name__}("):
                yield from (_plain(root.__doc__), "")
            yield from _table(("key", "value in `conf/`", "meaning", "allowed"), rows)
            waiting = [*deeper, *waiting]

    def _row(self, path: str, key: str, choice: str | None, entry: Any, hint: Any) -> tuple[str, str, str]:
        value = _at(self._composition(key, choice), path)
        text = (
            yaml.safe_dump(value, default_flow_style=True, width=10000).splitlines()[0] if value is not _MISSING else ""
        )
        shown = f"`{text}`" if 0 < len(text) <= LONGEST else ""
        return shown, sentence(entry), allowed_values(entry.metadata, hint)

    def _composition(self, key: str, choice: str | None) -> Mapping[str, Any]:
        """Return the configuration in which ``key`` has the kind ``choice``, or the default one."""
        here = _at(self._defaults, key)
        if choice is None or (isinstance(here, Mapping) and here.get("kind") == choice):
            return self._defaults
        group = key.replace(".", "/")
        if f"{group}={choice}" not in self._chosen:
            found: Mapping[str, Any] = {}
            for folder in self._site.conf_folders:
                for path in sorted((folder / group).glob("*.yaml")):
                    text = yaml.safe_load(path.read_text()) or {}
                    if not found and text.get("kind") == choice:
                        found = composed(self._site, [f"{group}={path.stem}"])
            self._chosen[f"{group}={choice}"] = found
        return self._chosen[f"{group}={choice}"]


_MISSING = object()


def _at(config: Any, path: str) -> Any:
    for part in path.split("."):
        if not isinstance(config, Mapping) or part not in config:
            return _MISSING
        config = config[part]
    return config


def _plain(docstring: str) -> str:
    return " ".join(docstring.split()).replace("``", "`")


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> Iterator[str]:
    if rows:
        for cells in (head, ("---",) * len(head), *rows):
            yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"
        yield ""


_NAMED = (stages, nodes, overview, pipelines, choices, topics, errors, python, environment)
PARTS: dict[str, Callable[..., str]] = {**{one.__name__: one for one in _NAMED}, "help": help_of}
