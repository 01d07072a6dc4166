"""What the pipeline, store, log, report and command line know of a stage: one declaration, nothing heavy imported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Kind = Literal["computes", "records", "moves"]


@dataclass(frozen=True)
class Headline:
    """A metric that a reader should see first; ``words`` follow the number, as in "of swing-ups succeed"."""

    metric: str
    words: str


@dataclass(frozen=True)
class StageDeclaration:
    """One stage; it stands as ``STAGE`` in the ``__init__`` of the stage's folder, an entry point names it.

    ``run``, ``gives``, ``chapter`` and ``ensemble_chapter`` are ``module:name``: the stage's class, its artifact's
    frozen dataclass, and what draws its chapters of a run's and of a comparison's report. ``settings`` are the schemas
    of the configuration nodes that this stage brings; ``topics`` the message dataclasses of its log, by topic.
    ``kind``: ``computes`` (cached), ``records`` (kept, never replaced unasked) or ``moves`` (never by a cache miss
    alone: needs ``--arm``).
    """

    name: str
    title: str
    lead: str
    run: str
    gives: str
    settings: Mapping[str, Any]
    topics: Mapping[str, type]
    kind: Kind = "computes"
    chapter: str | None = None
    ensemble_chapter: str | None = None
    headline: tuple[Headline, ...] = field(default=())
