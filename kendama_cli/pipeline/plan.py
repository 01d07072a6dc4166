"""Which stages of a pipeline would run, and why: keys, what they are made of, and how they differ from last time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.errors import ConfigError, UsageError
from kendama_cli.pipeline.catalogue import Pipeline, StageSpec
from kendama_cli.pipeline.code import FileIndex, code_digests
from kendama_cli.pipeline.inputs import describe, resolve_files
from kendama_cli.schema.registry import makers_below
from kendama_cli.schema.settings import nearest
from kendama_cli.store import durable
from kendama_cli.store.store import Store, StoredResult


@dataclass(frozen=True)
class StagePlan:
    """One stage: key and parts where its inputs are known, its stored result, or the reasons why it runs."""

    spec: StageSpec
    key: str | None
    parts: Mapping[str, Any]
    result: StoredResult | None
    reasons: tuple[str, ...]


class Planner:
    """Keys and reasons for the stages of one pipeline under one configuration."""

    def __init__(self, store: Store, pipeline: Pipeline, settings: Mapping[str, Any], roots: tuple[Path, ...]) -> None:
        """Find every stage's configuration and input files; raises ConfigError or UsageError otherwise."""
        self.store = store
        self.pipeline = pipeline
        self._index = FileIndex(store.home / "index" / "files.json")
        self.settings: dict[str, dict[str, Any]] = {}
        for spec in pipeline.stages:
            for node in spec.config.values():
                if node not in settings:
                    raise ConfigError(
                        node,
                        f"pipeline '{pipeline.name}': stage '{spec.name}' reads node '{node}', which the configuration "
                        f"does not have{nearest(node, settings)}",
                    )
            self.settings[spec.name] = {
                own: resolve_files(settings[node], node, roots) for own, node in spec.config.items()
            }
        self.seed = int(settings["seed"])
        self._config = {
            spec.name: {own: describe(value, self._index) for own, value in self.settings[spec.name].items()}
            for spec in pipeline.stages
        }
        self._code = {spec.name: self._code_of(spec) for spec in pipeline.stages}
        self._index.save()

    def _code_of(self, spec: StageSpec) -> dict[str, str]:
        """The code of the stage, and of the registered parts that its settings choose."""
        digests = code_digests(spec.target, self._index)
        for target in sorted({made for value in self.settings[spec.name].values() for made in makers_below(value)}):
            digests |= code_digests(target, self._index)
        return dict(sorted(digests.items()))

    def moves(self, stage: str) -> bool:
        """Whether the stage moves real hardware: then no cached result stands in for it."""
        return any(getattr(type(value), "moves", False) for value in self.settings[stage].values())

    def parts(self, spec: StageSpec, inputs: Mapping[str, str]) -> dict[str, Any]:
        """What the key of ``spec`` is made of, given the digests of its inputs by its own names for them."""
        return {
            "stage": spec.target,
            "config": {**self._config[spec.name], **({"seed": self.seed} if spec.seeded else {})},
            "inputs": dict(inputs),
            "code": self._code[spec.name],
        }

    def plan(self, forced: frozenset[str] = frozenset()) -> list[StagePlan]:
        """Every stage with its state, as if nothing else were going on."""
        plans: dict[str, StagePlan] = {}
        for spec in self.pipeline.stages:
            waiting = [needed for needed in spec.needs.values() if plans[needed].result is None]
            if waiting:
                reasons = (*self._reasons(spec, self.parts(spec, {}), inputs_known=False),)
                changed = tuple(f"input {needed} changed" for needed in waiting)
                never = reasons == ("never ran",)
                plans[spec.name] = StagePlan(spec, None, {}, None, reasons if never else (*changed, *reasons))
                continue
            inputs = {own: str(_result(plans[needed]).content_digest) for own, needed in spec.needs.items()}
            plans[spec.name] = self.look_up(spec, inputs, forced=spec.name in forced)
        return list(plans.values())

    def look_up(self, spec: StageSpec, inputs: Mapping[str, str], *, forced: bool = False) -> StagePlan:
        """The state of one stage whose inputs are known."""
        parts = self.parts(spec, inputs)
        key = durable.sha256(durable.canonical_json(parts))[:40]
        if forced:
            return StagePlan(spec, key, parts, None, ("forced",))
        if self.moves(spec.name):
            return StagePlan(spec, key, parts, None, ("moves hardware: every run is a new attempt",))
        result = self.store.find(spec.name, key)
        if result is not None:
            return StagePlan(spec, key, parts, result, ())
        if self.store.result_path(spec.name, key).exists():
            return StagePlan(spec, key, parts, None, ("stored artifact damaged or missing",))
        reasons = self._reasons(spec, parts, inputs_known=True)
        if any(self.store.checkpoint_folder(spec.name, key).glob("*.ckpt")):
            reasons = [*(reason for reason in reasons if reason != "never ran"), "goes on from its last checkpoint"]
        return StagePlan(spec, key, parts, None, tuple(reasons))

    def remember(self, plan: StagePlan) -> None:
        """Make this key the one that the next plan compares with."""
        path = self._latest_path(plan.spec.name)
        record = {"key": plan.key, "parts": plan.parts}
        if durable.read_index(path) != record:
            durable.write_index(path, record)

    def _latest_path(self, stage: str) -> Path:
        return self.store.home / "index" / "latest" / self.pipeline.name / f"{stage}.json"

    def _reasons(self, spec: StageSpec, parts: Mapping[str, Any], *, inputs_known: bool) -> list[str]:
        latest = durable.read_index(self._latest_path(spec.name))
        if latest is None:
            return ["never ran"]
        before = latest["parts"]
        reasons = [
            f"config {key} {_show(old)} -> {_show(new)}"
            for key, old, new in _differences(
                _renamed(before["config"], spec.config), _renamed(parts["config"], spec.config)
            )
        ]
        if inputs_known:
            reasons += [
                f"input {spec.needs.get(own, own)} changed"
                for own in sorted({*before["inputs"], *parts["inputs"]})
                if before["inputs"].get(own) != parts["inputs"].get(own)
            ]
        reasons += [f"code {file} changed" for file, _, _ in _differences(before["code"], parts["code"])]
        if before["stage"] != parts["stage"]:
            reasons.append(f"stage {before['stage']} -> {parts['stage']}")
        return reasons or (["did not finish last time"] if inputs_known else [])


def check_forced(pipeline: Pipeline, forced: list[str]) -> frozenset[str]:
    """``forced`` as a set; raises UsageError for a stage that the pipeline does not have."""
    return frozenset(pipeline.stage(name, "--force").name for name in forced)


def check_armed(planner: Planner, *, armed: bool) -> None:
    """Raise UsageError where a stage would move hardware and ``--arm`` was not given."""
    moving = [spec.name for spec in planner.pipeline.stages if planner.moves(spec.name)]
    if moving and not armed:
        raise UsageError(f"stage '{moving[0]}' would move real hardware; clear its surroundings and add --arm")


def _result(plan: StagePlan) -> StoredResult:
    assert plan.result is not None
    return plan.result


def _renamed(config: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    return {names.get(own, own): value for own, value in config.items()}


def _differences(before: Any, after: Any, prefix: str = "") -> list[tuple[str, Any, Any]]:
    if isinstance(before, Mapping) and isinstance(after, Mapping):
        return [
            item
            for name in sorted({*before, *after})
            for item in _differences(before.get(name), after.get(name), f"{prefix}.{name}" if prefix else str(name))
        ]
    return [] if before == after else [(prefix, before, after)]


def _show(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_show(item) for item in value) + "]"
    text = str(value)
    name, _, digest = text.rpartition(" ")
    return f"{name}@{digest[:8]}" if len(digest) == 64 and name else text
