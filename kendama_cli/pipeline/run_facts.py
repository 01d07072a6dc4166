"""Facts of a past run by dotted keys, to choose and to sort by: its record, configuration and metrics."""

from __future__ import annotations

import json
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.run_tags import read_tags
from kendama_cli.store import durable
from kendama_cli.store.store import Store

RECORDED = ("run", "pipeline", "started", "outcome", "sweep", "overrides", "tags", "note")
_TEST = re.compile(r"^\s*([A-Za-z0-9_.]+)\s*(<=|>=|!=|=|<|>|~)\s*(.*?)\s*$")
_PARTS, _CONFIG = b', "parts": {"stage": "', b', "config": '
"""The beginning of a key's parts, and of the configuration in them: within a text its quotes have backslashes."""
_DECODER = json.JSONDecoder()
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
        """Return True if the run has the fact and it passes; numbers are compared as numbers, anything else as text."""
        if self.key not in facts:
            return False
        fact = facts[self.key]
        if self.sign == "~":
            return self.value in str(fact)
        number, other = _number(fact), _number(self.value)
        if number is not None and other is not None:
            return _COMPARED[self.sign](number, other)
        return _COMPARED[self.sign](str(fact), self.value)


def condition(text: str) -> Condition:
    """Parse ``text``, such as ``learn.alpha>0.3``, as a condition; raises UsageError if it is none."""
    found = _TEST.match(text)
    if found is None:
        raise UsageError(
            f"--filter {text}: not a condition; write KEY, one of = != < <= > >= ~, and a value: 'learn.alpha>0.3'"
        )
    return Condition(*found.groups())


class FactReader:
    """Reader of facts of many runs, and no more: a result's configuration only where a key may stand in it."""

    def __init__(self, store: Store, keys: Sequence[str] = ()) -> None:
        """Choose the facts to read: ``keys`` beside RECORDED."""
        self._store = store
        self._keys = [key for key in dict.fromkeys(keys) if key not in RECORDED]
        self._nodes: dict[tuple[object, ...], frozenset[str]] = {}

    def facts(self, record: Mapping[str, Any]) -> dict[str, Any]:
        """Return RECORDED of a run and, of the keys that are asked for, those that it has.

        A key is ``node.key`` of the configuration of a stage whose result is still stored, or ``stage.metric``.
        """
        tagged = read_tags(self._store.home, str(record["run"]))
        known = {"sweep": "", **record, "overrides": " ".join(record["overrides"]), "tags": " ".join(tagged.tags)}
        facts = {name: value for name, value in {**known, "note": tagged.note}.items() if name in RECORDED}
        metrics = {str(stage["name"]): stage["metrics"] for stage in record["stages"]}
        for key in self._keys:
            value = _within(metrics, key)
            if value is None:
                configs = (_within(one, key) for one in self._configs(record, key))
                value = next((one for one in configs if one is not None), None)
            facts |= {} if value is None else {key: value}
        return facts

    def all_keys(self, record: Mapping[str, Any]) -> set[str]:
        """Return every key that ``facts`` could be asked for of a run."""
        stages = [(str(stage["name"]), stage) for stage in record["stages"]]
        facts = {key for name, stage in stages for key in flat(name, stage["metrics"])}
        configs = [stage_parts(self._store, stage).get("config", {}) for _, stage in stages]
        return {
            *RECORDED,
            *facts,
            *(key for one in configs for node, value in one.items() for key in flat(node, value)),
        }

    def _configs(self, record: Mapping[str, Any], key: str) -> Iterator[Mapping[str, Any]]:
        node = key.partition(".")[0]
        for stage in reversed(record["stages"]):
            kind = (record.get("pipeline"), stage["name"], str(record.get("versions")), record.get("started", "")[:10])
            if stage["key"] and node in self._nodes.get(kind, (node,)):
                config = stage_config(self._store, stage)
                self._nodes.setdefault(kind, frozenset(config))
                yield config


def _within(values: Mapping[str, Any], key: str) -> Any:
    """Return the scalar that nested ``values`` have at the dotted ``key``, as ``flat`` gives it; None for none."""
    name, rest = "", key
    while rest:  # names may have dots themselves
        part, _, rest = rest.partition(".")
        name = f"{name}.{part}" if name else part
        value = values.get(name)
        if isinstance(value, dict):
            return _within(value, rest) if rest else None
        if value is not None and not rest:
            return flat(name, value)[name]
    return None


def stage_config(store: Store, stage: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the configuration in the key of a recorded ``stage``; nothing where its result is no longer stored.

    It is a tenth of a result's record, the most of which is the code's digests, and alone is parsed.
    """
    path = store.result_path(str(stage["name"]), str(stage["key"]))
    body = durable.sealed_body(durable.read_file(path) or b"", str(path)) if stage["key"] else None
    at = -1 if body is None else body.find(_CONFIG, body.find(_PARTS))
    if body is None or at < 0 or _PARTS not in body:
        config: Mapping[str, Any] = stage_parts(store, stage).get("config", {})
        return config
    return dict(_DECODER.raw_decode(body[at + len(_CONFIG) :].decode())[0])


def stage_parts(store: Store, stage: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of the key of a recorded ``stage``; empty if its result is no longer stored."""
    if not stage["key"]:
        return {}
    result = durable.read_sealed(store.result_path(str(stage["name"]), str(stage["key"])))
    return {} if result is None else dict(result["parts"])


def flat(name: str, value: Any) -> dict[str, Any]:
    """Return the scalars of nested mappings by dotted keys; a list of scalars counts as one text."""
    if isinstance(value, Mapping):
        return {key: one for part, inner in value.items() for key, one in flat(f"{name}.{part}", inner).items()}
    if isinstance(value, list):
        return {name: ",".join(str(one) for one in value)}
    return {} if value is None else {name: value}


def in_order(runs: Sequence[dict[str, Any]], sort: str | None) -> list[dict[str, Any]]:
    """Return the facts of ``runs`` by ``sort`` where it is given, those without last."""
    if sort is None:
        return list(runs)
    numbers = [_number(facts[sort]) for facts in runs if sort in facts]
    as_numbers = None not in numbers

    def rank(facts: dict[str, Any]) -> Any:
        return _number(facts[sort]) if as_numbers else str(facts[sort])

    having = sorted((facts for facts in runs if sort in facts), key=rank)
    return [*having, *(facts for facts in runs if sort not in facts)]


def unknown_fact(key: str, known: Iterable[str]) -> UsageError:
    """Return the error for a key that is a fact of no run; ``known`` are those of one."""
    from kendama_cli.schema.hints import nearest  # noqa: PLC0415 - only where there is something to say
    from kendama_cli.schema.renames import new_fact, now_called  # noqa: PLC0415 - as below

    return UsageError(
        f"no run has '{key}'{now_called(key, new_fact(key))}: give a key of its configuration or STAGE.METRIC"
        f"{nearest(key, sorted(known))}"
    )


def _number(value: Any) -> float | None:
    if isinstance(value, bool):
        return None
    try:
        return float(value)
    except (TypeError, ValueError):
        return None
