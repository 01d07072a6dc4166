"""Declaration of a stage: all that pipeline, store, log, report and command line know of it; nothing heavy is imported.

Stages come by the entry point group ``kendama.stages``, the nodes of configuration that several stages read by
``kendama.settings``; ours stand in our own ``pyproject.toml`` as another package's do in its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import declared, resolve

STAGES = "kendama.stages"
NODES = "kendama.settings"
SECTIONS = "kendama.sections"

Kind = Literal["computes", "records", "moves"]
KINDS: tuple[Kind, ...] = ("computes", "records", "moves")
"""In the order of what they touch: nothing, a person's hand, the world."""


@dataclass(frozen=True)
class Headline:
    """A metric that a reader should see first; ``words`` follow the number, as in "of swing-ups succeed".

    ``{robot}`` in them is the robot that the stage drove: the twin, say.
    """

    metric: str
    words: str

    def of(self, robot: str) -> str:
        """Return the words about ``robot``."""
        return self.words.replace("{robot}", robot)


@dataclass(frozen=True)
class StageDeclaration:
    """One stage; it stands as ``STAGE`` in the ``__init__`` of the stage's folder, an entry point names it.

    ``run``, ``returns``, ``chapter``, ``film``, ``replay`` and ``episodes`` are ``module:name``: the stage's class; its
    artifact's frozen dataclass; what draws its chapter of a run's report (``StageLog -> list[Figure]``); what draws the
    moving picture at the head of the page (``StageLog -> str | None``); what its log adds to the replay in space there
    (``StageLog -> list[Performance]``); what others can learn from in it (``StageLog``, frames per second ``-> Episodes
    | None``). Its chapter of a comparison of runs comes by the group ``kendama.comparisons`` (``EnsembleChapter``).
    ``settings`` are the schemas of the configuration nodes that this stage brings (a frozen dataclass, a union of them
    distinguished by ``kind``, or a Registry); ``topics`` the message dataclasses of its log, by topic.

    ``kind`` is the most that the stage may ever do: ``computes`` (cached by inputs, settings and code), ``records``
    (cached without its code: a recording is never replaced unasked), ``moves`` (never cached, and needs ``--arm``).
    What it does in one run is for its settings to say, by a class attribute: ``live = True`` on those of a device
    that a person must act for, ``moves = True`` on those of hardware that may be real. Where no settings say so it
    computes: a demonstrator that reads files, or a simulated twin.

    ``brief`` tells a result in a few words, with its metrics in braces as ``str.format`` takes them, or as
    ``{n:swing}`` with what they count. Of several lines the first is shown whose metrics the run has. ``again`` says
    the same way what a later run may take from this one, which is ``{run}``, and its ``{stage}``.
    ``metrics``, ``topic_words`` and ``figures`` say in a sentence each what a metric, a topic and a figure of the
    report (by the name that ``drawing`` is given) is, and what is good. ``kendama explain``, the report and the pages
    print them. A ``*`` in a name stands for a joint or a camera.

    ``capped`` names counts that end at a cap, and for each the metric that is False where it did.

    ``methods`` are sentences of a paper's method section: ``{KEY}`` stands for the value of that setting (from its
    node on) or metric in a run, with its unit; a sentence with a value that a run lacks is left out of its report.

    ``packages`` are further ones whose code counts for its result, or entry point groups of which all that they name
    does: see docs/howto/write-a-package.md.
    """

    name: str
    title: str
    lead: str
    run: str
    returns: str
    settings: Mapping[str, Any]
    topics: Mapping[str, type]
    kind: Kind = "computes"
    chapter: str | None = None
    film: str | None = None
    replay: str | None = None
    episodes: str | None = None
    headline: tuple[Headline, ...] = field(default=())
    methods: tuple[str, ...] = ()
    packages: tuple[str, ...] = ()
    brief: str = ""
    again: str = ""
    metrics: Mapping[str, str] = field(default_factory=dict)
    capped: Mapping[str, str] = field(default_factory=dict)
    topic_words: Mapping[str, str] = field(default_factory=dict)
    figures: Mapping[str, str] = field(default_factory=dict)


def stage_names() -> list[str]:
    """Return the stages that installed packages declare, sorted."""
    return sorted(declared(STAGES))


def find_stage(name: str) -> StageDeclaration | None:
    """Return the declaration of the stage ``name``; None where no package declares it.

    Raises MissingPartError where its module cannot be imported, ConfigError where it is no declaration of that name.
    """
    return _find(STAGES, name, "stage")


def section_names() -> list[str]:
    """Return the sections of reports that installed packages declare, sorted."""
    return sorted(declared(SECTIONS))


def find_section(name: str) -> StageDeclaration | None:
    """Return the declaration of a report's section on the log ``NAME.mcap`` beside a run, which no pipeline makes.

    None where no package declares it. Raises as ``find_stage``.
    """
    return _find(SECTIONS, name, "section")


def _find(group: str, name: str, what: str) -> StageDeclaration | None:
    target = declared(group).get(name)
    if target is None:
        return None
    found = resolve(target, f"{what} '{name}'")
    if not isinstance(found, StageDeclaration) or found.name != name or found.kind not in KINDS:
        raise ConfigError(
            name,
            f"entry point '{name}' of group {group} names {target}, which is {type(found).__name__} "
            f"'{getattr(found, 'name', '')}'; it must name a StageDeclaration of name '{name}' whose kind is one of "
            f"{', '.join(KINDS)}",
        )
    return found
