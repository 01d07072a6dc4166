"""What is known of a past run by dotted keys, to choose and to sort by: its record, configuration and metrics."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.run_tags import read_tags
from kendama_cli.store import durable
from kendama_cli.store.store import Store

RECORDED = ("run", "pipeline", "started", "outcome", "overrides", "tags", "note")
_TEST = re.compile(r"^\s*([A-Za-z0-9_.]+)\s*(<=|>=|!=|=|<|>|~)\s*(.*?)\s*$")
_COMPARED: Mapping[str, Callable[[Any, Any], bool]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "!=": operator.ne,
    "=": operator.eq,
    "<": operator.lt,
    ">": operator.gt,
}


@dataclass(frozen=True)
class Condition:
    """One test on a fact: ``key`` ``sign`` ``value``; ``~`` asks whether the text holds ``value``."""

    key: str
    sign: str
    value: str

    def holds(self, facts: Mapping[str, Any]) -> bool:
        """Whether the run has the fact and it passes; numbers are compared as numbers, anything else as text."""
        if self.key not in facts:
            return False
        fact = facts[self.key]
        if self.sign == "~":
            return self.value in str(fact)
        number, wanted = _number(fact), _number(self.value)
        if number is not None and wanted is not None:
            return _COMPARED[self.sign](number, wanted)
        return _COMPARED[self.sign](str(fact), self.value)


def condition(text: str) -> Condition:
    """The condition that ``text`` is, such as ``learn.alpha>0.3``; raises UsageError where it is none."""
    found = _TEST.match(text)
    if found is None:
        raise UsageError(
            f"--filter {text}: not a condition; write KEY, one of = != < <= > >= ~, and a value: 'learn.alpha>0.3'"
        )
    return Condition(*found.groups())


def run_facts(store: Store, record: Mapping[str, Any], *, whole: bool = True) -> dict[str, Any]:
    """All scalars that are known of the run ``record``: RECORDED, ``node.key`` of its configuration, ``stage.metric``.

    The configuration is that of the stages whose results are still stored; only RECORDED without ``whole``.
    """
    tagged = read_tags(store.home, str(record["run"]))
    known = {**record, "overrides": " ".join(record["overrides"]), "tags": " ".join(tagged.tags), "note": tagged.note}
    facts = {name: known[name] for name in RECORDED if name in known}
    for stage in record["stages"] if whole else ():
        for node, value in stage_parts(store, stage).get("config", {}).items():
            facts.update(flat(node, value))
    for stage in record["stages"] if whole else ():
        facts.update(flat(str(stage["name"]), stage["metrics"]))
    return facts


def stage_parts(store: Store, stage: Mapping[str, Any]) -> dict[str, Any]:
    """What the key of a recorded ``stage`` was made of; nothing where its result is no longer stored."""
    if not stage["key"]:
        return {}
    result = durable.read_sealed(store.result_path(str(stage["name"]), str(stage["key"])))
    return {} if result is None else dict(result["parts"])


def flat(name: str, value: Any) -> dict[str, Any]:
    """The scalars of nested mappings by dotted keys; a list of scalars counts as one text."""
    if isinstance(value, Mapping):
        return {key: one for part, inner in value.items() for key, one in flat(f"{name}.{part}", inner).items()}
    if isinstance(value, list):
        return {name: ",".join(str(one) for one in value)}
    return {} if value is None else {name: value}


def chosen_runs(
    runs: Sequence[dict[str, Any]], conditions: Sequence[Condition], sort: str | None
) -> list[dict[str, Any]]:
    """The facts of those ``runs`` on which all ``conditions`` hold, by ``sort`` where it is given, those without last.

    Raises UsageError where no run has a fact that is asked for.
    """
    require_known(runs, [*(one.key for one in conditions), *([sort] if sort else [])])
    found = [facts for facts in runs if all(one.holds(facts) for one in conditions)]
    if sort is None:
        return found
    numbers = [_number(facts[sort]) for facts in found if sort in facts]
    as_numbers = None not in numbers

    def place(facts: dict[str, Any]) -> Any:
        return _number(facts[sort]) if as_numbers else str(facts[sort])

    having = sorted((facts for facts in found if sort in facts), key=place)
    return [*having, *(facts for facts in found if sort not in facts)]


def require_known(runs: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> None:
    """Raises UsageError where one of ``keys`` is a fact of none of the ``runs``."""
    unknown = next((key for key in keys if not any(key in facts for facts in runs)), None)
    if runs and unknown is not None:
        from kendama_cli.schema.settings import nearest  # noqa: PLC0415 - only where there is something to say

        known = sorted({name for facts in runs for name in facts})
        raise UsageError(
            f"no run has '{unknown}': give a key of its configuration or STAGE.METRIC{nearest(unknown, known)}"
        )


def _number(value: Any) -> float | None:
    if isinstance(value, bool):
        return None
    try:
        return float(value)
    except (TypeError, ValueError):
        return None
