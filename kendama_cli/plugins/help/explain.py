"""``kendama explain``: the meaning of a name, from its declaration, and the file that gives a setting its value."""

from __future__ import annotations

import dataclasses
import difflib
import fnmatch
import inspect
import re
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.cli import render
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, group_options, groups
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.catalogue import load_pipeline, pipeline_names
from kendama_cli.pipeline.nodes import node_schemas
from kendama_cli.report.tables import label_and_unit
from kendama_cli.schema.declaration import (
    StageDeclaration,
    find_section,
    find_stage,
    section_names,
    stage_names,
)
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.setting_facts import SettingFact, allowed_values, sentence, setting_facts

PAGES = {"setting": "reference/settings", "group": "reference/settings", "topic": "reference/logs"}
OTHERS = "reference/stages"
_ABSENT = object()


@dataclass(frozen=True)
class Explained:
    """One thing that has a name: its ``what`` (setting, metric, ...), its sentence, and lines of facts."""

    name: str
    what: str
    sentence: str
    facts: Mapping[str, str]


def explain(site: Site, names: Sequence[str], *, as_json: bool) -> None:
    """Print the meaning of each name; raises UsageError, with the nearest names, where nothing is called so."""
    found: list[Explained] = []
    for name in dict.fromkeys(names):
        of_name = list(_all_of(site, name))
        if not of_name:
            raise UsageError(_unknown(name))
        found += of_name
    if as_json:
        render.document([dataclasses.asdict(one) for one in found])
        return
    width = shutil.get_terminal_size((80, 24)).columns
    for i, one in enumerate(found):
        render.text(("\n" if i else "") + _shown(one, width))


def _shown(one: Explained, width: int) -> str:
    lines = [f"{one.name} ({one.what})", *_wrapped(one.sentence, width, "  ")]
    page = f"docs/{PAGES.get(one.what, OTHERS)}.md; 'kendama docs' opens the pages"
    for label, text in {**one.facts, "page": page}.items():
        lines += _wrapped(text, width, f"  {label:<9} ") if text else []
    return "\n".join(lines)


def _wrapped(text: str, width: int, head: str) -> list[str]:
    """Return the lines of ``text`` after ``head``."""
    rest = " " * len(head)
    return textwrap.wrap(text, width, initial_indent=head, subsequent_indent=rest, break_on_hyphens=False)


def _all_of(site: Site, name: str) -> Iterator[Explained]:
    for declaration in declarations():
        yield from _of_stage(declaration, name)
    if name.replace(".", "/") in groups(site):
        yield _group(site, name.replace(".", "/"))
    facts = [one for one in all_settings() if name in (one.key, one.key.replace("[]", ""))]
    facts = facts or [one for one in all_settings() if "." not in name and one.key.rpartition(".")[2] == name]
    merged: dict[str, list[SettingFact]] = {}
    for fact in facts:
        merged.setdefault(fact.key, []).append(fact)
    defaults = composed(site, []) if merged else {}
    for key, same in merged.items():
        yield _setting(site, key, same, defaults)
    if name == "seed":
        facts_of_seed = {"default": "0, in conf/config.yaml", "reruns": "all stages that use random numbers"}
        yield Explained("seed", "setting", "Seed of all random numbers; each stage has its own stream.", facts_of_seed)


def declarations() -> list[StageDeclaration]:
    """Return the declarations of all stages and of sections of reports."""
    found = [*map(find_stage, stage_names()), *map(find_section, section_names())]
    return [one for one in found if one is not None]


def all_settings() -> list[SettingFact]:
    """Return every setting of the configuration, those of choices too."""
    schemas, _ = node_schemas()
    return [fact for node, schema in sorted(schemas.items()) for fact in setting_facts(node, schema)]


def names_known() -> list[str]:
    """Return every name that can be explained."""
    found = ["seed", *(fact.key for fact in all_settings())]
    for one in declarations():
        found += [one.name, *one.metrics, *one.topics, *one.figures]
    return list(dict.fromkeys(found))


def _of_stage(stage: StageDeclaration, name: str) -> Iterator[Explained]:
    if name == stage.name:
        facts = {
            "returns": stage.returns.partition(":")[2],
            "metrics": ", ".join(stage.metrics),
            "topics": ", ".join(stage.topics),
            "figures": ", ".join(stage.figures),
            "settings": ", ".join(f"{node}.*" for node in stage.settings),
        }
        yield Explained(name, "stage", f"{stage.title}. {stage.lead}", facts)
    metric = name.removeprefix(f"{stage.name}.")
    for pattern, words in stage.metrics.items():
        if metric == pattern or (metric not in stage.metrics and _matches(metric, pattern)):
            see = f"kendama runs --sort {stage.name}.{metric}"
            facts = {"unit": label_and_unit(metric)[1], "stage": stage.name, "see": see}
            yield Explained(f"{stage.name}.{metric}", "metric", words, facts)
    for topic, kind in stage.topics.items():
        if name in (topic, topic.lstrip("/")) or _matches(name, topic):
            fields = ", ".join(field.name for field in dataclasses.fields(kind))
            doc = " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].replace("``", "").split())
            facts = {"message": f"{kind.__name__}: {doc}", "fields": fields, "see": f"kendama log export {stage.name}"}
            yield Explained(topic, "topic", stage.topic_words.get(topic, ""), facts)
    if name in stage.figures:
        yield Explained(name, "figure", stage.figures[name], {"stage": stage.name, "see": "kendama report"})


def _matches(name: str, pattern: str) -> bool:
    return "*" in pattern and fnmatch.fnmatchcase(name, pattern)


def _group(site: Site, name: str) -> Explained:
    facts = {"choices": ", ".join(f"{name}={one}" for one in group_options(site, name)), "reruns": _reruns(site, name)}
    key = name.replace("/", ".")
    docs = {_plain(fact.group) for fact in all_settings() if fact.key.rpartition(".")[0] == key}
    words = docs.pop() if len(docs) == 1 else "Group of settings, of which one choice is taken."
    return Explained(name, "group", words, facts)


def _setting(site: Site, key: str, same: list[SettingFact], defaults: Any) -> Explained:
    first = same[0]
    value: Any = defaults
    for part in key.split("."):
        value = value.get(part, _ABSENT) if isinstance(value, Mapping) else _ABSENT
    file = None if value is _ABSENT else file_of(site, key, value)
    shown = "" if value is _ABSENT else yaml.safe_dump(value, default_flow_style=True, width=1000).splitlines()[0]
    kinds = ", ".join(fact.kind for fact in same if fact.kind is not None)
    facts = {
        "unit": label_and_unit(key.rpartition(".")[2])[1],
        "allowed": allowed_values(first.field.metadata, first.hint).replace("`", ""),
        "default": shown + (f", in {_place(site, file)}" if file is not None else ""),
        "kind": f"of {key.rpartition('.')[0]}.kind {kinds}" if kinds else "",
        "group": _plain(first.group),
        "reruns": _reruns(site, key),
    }
    return Explained(key, "setting", sentence(first.field), facts)


def _place(site: Site, file: Path) -> str:
    """Return the path of a bundled file from ``conf`` on, that of any other whole."""
    bundled = site.conf_folders[-1]
    return f"conf/{file.relative_to(bundled)}" if file.is_relative_to(bundled) else str(file)


def _plain(group: type) -> str:
    """Return the docstring of a settings class with its equations; empty where Python made it."""
    doc = inspect.getdoc(group) or ""
    return "" if doc.startswith(f"{group.__name__}(") else " ".join(doc.split()).replace("``", "")


def _reruns(site: Site, key: str) -> str:
    """Return the stages that read the node of ``key``, and those of the default pipeline that need their results."""
    node = key.partition(".")[0].partition("/")[0]
    reading: list[str] = []
    following: list[str] = []
    for name in sorted(pipeline_names(site.pipeline_folders), key=lambda name: name != "kendama"):
        for spec in load_pipeline(name, site.pipeline_folders).stages:
            if node in spec.config.values():
                reading.append(spec.declaration.name)
            elif name == "kendama" and set(spec.needs.values()) & {*reading, *following}:
                following.append(spec.name)
    after = f"; then {', '.join(dict.fromkeys(following))}, if their results differ" if following else ""
    return ", ".join(dict.fromkeys(reading)) + after if reading else "no stage"


def _unknown(name: str) -> str:
    known = names_known()
    close = sorted((one for one in known if name.casefold() in re.split(r"\W|_", one)), key=len)  # tau: tau_scale
    last = {one.rpartition(".")[2]: one for one in reversed(known)}
    close += difflib.get_close_matches(name.casefold(), known, n=3, cutoff=0.6)
    close += [last[one] for one in difflib.get_close_matches(name.casefold(), last, n=3, cutoff=0.7)]
    if not close:
        return f"nothing is called '{name}'; 'kendama explain learn' explains a stage, 'kendama config' prints all keys"
    return f"nothing is called '{name}'; type kendama explain {' or '.join(dict.fromkeys(close[:4]))}"


def file_of(site: Site, key: str, value: Any) -> Path | None:
    """Return the file that gives ``key`` its ``value`` in the default configuration; None if it is not found.

    The files of the default choices come first, then the others of the same groups.
    """
    for path, inside in _candidates(site, key.split(".")):
        node: Any = _content(path)
        for part in inside:
            node = node.get(part) if isinstance(node, Mapping) else None
        if node == value and inside:
            return path
    return None


def _candidates(site: Site, parts: list[str]) -> Iterator[tuple[Path, list[str]]]:
    for depth in range(len(parts) - 1, -1, -1):
        for folder in site.conf_folders:
            group = folder.joinpath(*parts[:depth])
            files = [folder / "config.yaml"] if not depth else sorted(group.glob("*.yaml"))
            chosen = _chosen(folder, parts[:depth])
            for path in sorted(files, key=lambda path: path.stem != chosen):
                yield path, parts[depth:]


def _chosen(folder: Path, group: list[str]) -> str | None:
    """Return the choice of ``group`` in the lists of defaults above it."""
    for depth in range(len(group)):
        for path in sorted(folder.joinpath(*group[:depth]).glob("*.yaml")):
            for entry in _content(path).get("defaults", ()):
                if isinstance(entry, Mapping) and (name := entry.get("/".join(group[depth:]))):
                    return str(name)
    return None


def _content(path: Path) -> Mapping[str, Any]:
    try:
        found = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, Mapping) else {}
