"""Chapters of a report, found by each stage's declaration, whichever package it comes from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from kendama_cli.errors import InputError, KendamaError, MissingPartError
from kendama_cli.report.ensemble import Ensemble
from kendama_cli.report.figure import Figure
from kendama_cli.report.replay.performance import Performance
from kendama_cli.report.source import StageLog
from kendama_cli.schema.declaration import Headline, StageDeclaration, find_section, find_stage
from kendama_cli.schema.registry import declared, resolve

COMPARISONS = "kendama.comparisons"


@dataclass(frozen=True)
class EnsembleChapter:
    """The chapter of one stage in a comparison of runs, by the stage's name in the group ``kendama.comparisons``.

    ``topics`` are the topics of the log that ``figures`` and ``tables`` (HTML) read. ``pooled``: whether the mean of
    a headline metric over the groups says something, as it does over bodies and not over ways to learn.
    """

    title: str
    lead: str
    topics: tuple[str, ...]
    figures: Callable[[Ensemble], list[Figure]]
    tables: Callable[[Ensemble], str]
    headline: tuple[Headline, ...] = ()
    pooled: bool = False


def declaration_of(name: str, entry: Mapping[str, Any]) -> StageDeclaration | None:
    """Return the declaration behind the stage ``name`` of a run, whose record has ``entry``; None where none is
    installed.
    """
    try:
        return (None if entry else find_section(name)) or find_stage(str(entry.get("stage", name)))
    except KendamaError:
        return None


def draw(declaration: StageDeclaration, log: StageLog) -> tuple[list[Figure], str]:
    """Return the figures of a stage's chapter, or none and the reason, which a log of another version can be."""
    if declaration.chapter is None:
        return [], ""
    try:
        figures = list(resolve(declaration.chapter, f"the chapter of stage '{declaration.name}'")(log))
    except (InputError, MissingPartError) as error:
        return [], f"This chapter cannot be drawn: {error}."
    except Exception as error:  # a chapter of another package, or a log from before it changed: the page goes on
        return [], undrawn(error)
    return figures, "" if figures else "The log of this stage holds nothing to draw."


def undrawn(error: Exception) -> str:
    """Return what a page says where a chapter fails on a log."""
    reason = " ".join(f"{type(error).__name__}: {error}".split())
    return (
        f"This chapter cannot be drawn from this log ({reason}). Where the log was made by another version, run the "
        "stage again with --force."
    )


def film(declaration: StageDeclaration, log: StageLog) -> str:
    """Return the moving picture of a stage as HTML; empty where it has none, or none can be drawn."""
    if declaration.film is None:
        return ""
    try:
        return resolve(declaration.film, f"the film of stage '{declaration.name}'")(log) or ""
    except Exception:  # the chapter of the same stage says what is wrong
        return ""


def performances(declaration: StageDeclaration, log: StageLog) -> list[Performance]:
    """Return what the stage adds to the replay in space; empty where it has nothing, or nothing that can be drawn."""
    if declaration.replay is None:
        return []
    try:
        return list(resolve(declaration.replay, f"the replay of stage '{declaration.name}'")(log))
    except Exception:  # the chapter of the same stage says what is wrong
        return []


def ensemble_chapter(declaration: StageDeclaration | None) -> EnsembleChapter | None:
    """Return the stage's chapter of a comparison; None where no package declares one that can be imported."""
    if declaration is None or declaration.name not in (known := declared(COMPARISONS)):
        return None
    try:
        found = resolve(known[declaration.name], f"the comparison of stage '{declaration.name}'")
    except KendamaError:
        return None
    return found if isinstance(found, EnsembleChapter) else None
