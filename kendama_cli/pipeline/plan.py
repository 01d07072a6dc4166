"""Plan of a pipeline: the stages that would run and why, their keys, and the differences from last time."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

from kendama_cli.errors import ConfigError, MissingPartError, UsageError
from kendama_cli.pipeline.catalogue import Pipeline, StageSpec
from kendama_cli.pipeline.code import Code, FileIndex
from kendama_cli.pipeline.inputs import describe, file_contents, read_files, resolve_files
from kendama_cli.pipeline.nodes import Remembered, node_schemas
from kendama_cli.pipeline.stage_code import missing_library, stage_code
from kendama_cli.schema.declaration import KINDS, Kind
from kendama_cli.schema.hints import nearest
from kendama_cli.store import durable
from kendama_cli.store.home import check_names, keep_latest, read_latest
from kendama_cli.store.store import Store, StoredResult, key_of

WHERE = ("executor", "store")
"""Nodes of the configuration that enter no key."""
NEVER_RAN = ("never ran",)
FEW_FILES, SHOWN_VALUES, SHOWN_CHARACTERS = 3, 12, 200
"""So much of a value that changed is shown as a reason."""
FORCED = ("forced",)
"""Why a stage runs that the user asked to have made anew."""


@dataclass(frozen=True)
class StagePlan:
    """One stage: key and parts where its inputs are known, its stored result, or the reasons why it runs.

    A result that was recorded has a reason too: why it stays, and how it is recorded anew.
    """

    spec: StageSpec
    key: str | None
    parts: Mapping[str, Any]
    result: StoredResult | None
    reasons: tuple[str, ...]


class Planner:
    """Keys and reasons for the stages of one pipeline under one configuration."""

    def __init__(
        self,
        store: Store,
        pipeline: Pipeline,
        settings: Mapping[str, Any],
        roots: tuple[Path, ...],
        known: Remembered | None = None,
    ) -> None:
        """Find every stage's configuration and input files; raises ConfigError, UsageError or InputError otherwise.

        Planners of one command share by ``known`` what is found of the same settings.
        """
        check_names(store.home)
        known = known or Remembered()
        self.store, self.pipeline = store, pipeline
        self.index = known.once("index", (), lambda: FileIndex(store.home / "index" / "files.json"))
        self.settings: dict[str, dict[str, Any]] = {}
        for spec in pipeline.stages:
            for node in spec.config.values():
                if node in WHERE:
                    raise ConfigError(
                        node,
                        f"pipeline '{pipeline.name}': stage '{spec.name}' reads node '{node}', which says where the "
                        "work is done and must change no result; take it out of the stage's config",
                    )
                if node not in settings:
                    raise ConfigError(
                        node,
                        f"pipeline '{pipeline.name}': stage '{spec.name}' reads node '{node}', which the configuration "
                        f"does not have{nearest(node, settings)}",
                    )
            found = partial(resolve_files, roots=roots, home=store.home)
            self.settings[spec.name] = {
                own: known.once("files", (settings[node],), partial(found, settings[node], node))
                for own, node in spec.config.items()
            }
        self.read_lines = read_files(self.settings, known)
        self.seed = int(settings["seed"])
        self._config = {
            spec.name: {
                own: known.once("config", (value,), partial(describe, value, self.index))
                for own, value in self.settings[spec.name].items()
            }
            for spec in pipeline.stages
        }
        self._kinds: dict[str, Kind] = {}
        self._code: dict[str, Code] = {}
        self.missing: dict[str, MissingPartError | None] = {}
        schemas, _ = known.once("schemas", (), node_schemas)
        for spec in pipeline.stages:
            name, own = spec.name, self.settings[spec.name]
            of = tuple(own.values())
            self._kinds[name] = known.once(f"kind {name}", of, partial(kind_of, spec, own))
            self._code[name] = known.once(f"code {name}", of, partial(stage_code, spec, own, schemas, self.index))
            self.missing[name] = known.once(f"missing {name}", of, partial(missing_library, spec, own, schemas))
        self.index.save()

    def kind(self, stage: str) -> Kind:
        """Return the stage's kind under these settings: it computes, records, or moves hardware that may be real."""
        return self._kinds[stage]

    def is_cached(self, stage: str) -> bool:
        """Return True if a result of the stage can be known again: it moves nothing, and all of its code is known."""
        kind = self.kind(stage)
        return kind == "records" or (kind == "computes" and not self._code[stage].unknown)

    def files(self, stage: str) -> dict[str, dict[str, str]]:
        """Return every input file of the stage by its path: its content's digest, and the file that named it."""
        return {
            path: facts
            for value in self.settings[stage].values()
            for path, facts in file_contents(value, self.index).items()
        }

    def parts(self, spec: StageSpec, inputs: Mapping[str, str]) -> dict[str, Any]:
        """Return the parts of the key of ``spec``, given the digests of its inputs by its own names for them."""
        recording = self.kind(spec.name) == "records"
        return {
            "stage": spec.declaration.run,
            "returns": spec.declaration.returns,
            "config": {**self._config[spec.name], **({"seed": self.seed} if spec.seeded else {})},
            "inputs": dict(inputs),
            # another version of the code is no reason to have a person swing again
            "code": {} if recording else self._code[spec.name].digests,
        }

    def plan(self, forced: frozenset[str] = frozenset()) -> list[StagePlan]:
        """Return every stage with its state, as if no other run were active."""
        plans: dict[str, StagePlan] = {}
        for spec in self.pipeline.stages:
            waiting = [needed for needed in spec.needs.values() if plans[needed].result is None]
            if waiting:
                reasons = (*self._reasons(spec, self.parts(spec, {}), inputs_known=False),)
                changed = tuple(f"input {needed} changed" for needed in waiting)
                never = reasons == NEVER_RAN
                plans[spec.name] = StagePlan(spec, None, {}, None, reasons if never else (*changed, *reasons))
                continue
            inputs = {own: str(_result(plans[needed]).content_digest) for own, needed in spec.needs.items()}
            plans[spec.name] = self.look_up(spec, inputs, forced=spec.name in forced)
        return list(plans.values())

    def look_up(self, spec: StageSpec, inputs: Mapping[str, str], *, forced: bool = False) -> StagePlan:
        """Return the state of one stage whose inputs are known."""
        parts = self.parts(spec, inputs)
        key = key_of(parts)
        if forced:
            return StagePlan(spec, key, parts, None, FORCED)
        if self.kind(spec.name) == "moves":
            return StagePlan(spec, key, parts, None, ("moves hardware: every run is a new attempt",))
        if not self.is_cached(spec.name):
            return StagePlan(spec, key, parts, None, (f"never cached: {self._code[spec.name].unknown[0]}",))
        result = self.store.find(spec.name, key)
        if result is not None:
            kept = (f"recorded before; --force {spec.name} records anew",) if self.kind(spec.name) == "records" else ()
            return StagePlan(spec, key, parts, result, kept)
        if durable.exists(self.store.result_path(spec.name, key)):
            return StagePlan(spec, key, parts, None, ("stored artifact damaged or missing",))
        reasons = self._reasons(spec, parts, inputs_known=True)
        if any(path.suffix == ".ckpt" for path in durable.listed(self.store.checkpoint_folder(spec.name, key))):
            reasons = [*(reason for reason in reasons if reason not in NEVER_RAN), "resumes from its last checkpoint"]
        return StagePlan(spec, key, parts, None, tuple(reasons))

    def remember(self, plan: StagePlan) -> None:
        """Make this key the one that the next plan compares with."""
        keep_latest(self.store.home, self.pipeline.name, plan.spec.name, plan.key, plan.parts)

    def _reasons(self, spec: StageSpec, parts: Mapping[str, Any], *, inputs_known: bool) -> list[str]:
        latest = read_latest(self.store.home, self.pipeline.name, spec.name)
        if latest is None:
            return list(NEVER_RAN)
        before = latest["parts"]
        reasons = [
            f"config {key} {_changed(old, new)}"
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
        named = ((part, before.get(part), parts[part]) for part in ("stage", "returns"))
        reasons += [f"{part} {old} -> {new}" for part, old, new in named if old != new]
        return reasons or (["did not finish last time"] if inputs_known else [])


def made_since(planner: Planner, plan: StagePlan) -> StagePlan | None:
    """Return ``plan`` with the result that another run has computed since it was looked up; None if there is none.

    What was forced, or moves hardware, is to be made here whatever others have made.
    """
    if plan.key is None or plan.reasons == FORCED or not planner.is_cached(plan.spec.name):
        return None
    result = planner.store.find(plan.spec.name, plan.key)
    return None if result is None else dataclasses.replace(plan, result=result)


def check_forced(pipeline: Pipeline, forced: list[str]) -> frozenset[str]:
    """Return ``forced`` as a set; raises UsageError for a stage that the pipeline does not have."""
    return frozenset(pipeline.stage(name, "--force").name for name in forced)


def check_ready(planner: Planner, *, armed: bool) -> None:
    """Raise UsageError where a stage would move hardware and ``--arm`` was not given, MissingPartError where one that
    would run lacks a library.
    """
    moving = [spec.name for spec in planner.pipeline.stages if planner.kind(spec.name) == "moves"]
    if moving and not armed:
        raise UsageError(f"stage '{moving[0]}' would move real hardware; clear its surroundings and add --arm")
    lacking = {name: error for name, error in planner.missing.items() if error is not None}
    for plan in planner.plan() if lacking else ():
        if plan.result is None and plan.spec.name in lacking:
            raise lacking[plan.spec.name]


def kind_of(spec: StageSpec, settings: Mapping[str, Any]) -> Kind:
    """Return the kind of a stage under ``settings``; raises ConfigError if that is more than it declares."""
    kind: Kind = "computes"
    for own, value in settings.items():
        for attribute, doing in (("live", "records"), ("moves", "moves")):
            if not getattr(type(value), attribute, False):
                continue
            kind = max(kind, cast(Kind, doing), key=KINDS.index)
            if KINDS.index(kind) > KINDS.index(spec.declaration.kind):
                raise ConfigError(
                    spec.config[own],
                    f"stage '{spec.name}' declares that it {spec.declaration.kind}, but its settings "
                    f"'{spec.config[own]}' are of a device for one that {doing}; choose others (or declare "
                    f'kind="{doing}" where the stage is yours)',
                )
    return kind


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


def _changed(old: Any, new: Any) -> str:
    """Return the change of one value in a few words; of many files their number."""
    if max(map(_files, (old, new))) <= FEW_FILES:
        return f"{_show(old)} -> {_show(new)}"
    if _files(old) != _files(new):
        return " -> ".join(f"{count} file{'' if count == 1 else 's'}" for count in map(_files, (old, new)))
    others = [one for before, one in zip(old, new, strict=True) if before != one]
    return f"{len(others)} of {len(new)} files, {_show(others[0])} first"


def _files(value: Any) -> int:
    """Return the number of input files in a value of the configuration; 0 for another value."""
    several = value if isinstance(value, list) else [value]
    return len(several) if all(_is_file(one) for one in several) else 0


def _is_file(value: Any) -> bool:
    name, _, digest = str(value).rpartition(" ")
    return len(digest) == 64 and bool(name)


def _show(value: Any) -> str:
    if isinstance(value, list):
        text = "[" + ", ".join(map(_show, value[:SHOWN_VALUES])) + (", ...]" if len(value) > SHOWN_VALUES else "]")
    elif _is_file(value):
        name, _, digest = str(value).rpartition(" ")
        text = f"{name}@{digest[:8]}"
    else:
        text = str(value)
    return text if len(text) <= SHOWN_CHARACTERS else f"{text[:SHOWN_CHARACTERS]}..."
