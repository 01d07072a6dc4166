"""Pipelines by name: which stages, what each needs, which configuration feeds it; nothing here imports a stage."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.errors import ConfigError, MissingPartError, UsageError
from kendama_cli.schema.declaration import STAGES, StageDeclaration, find_stage, stage_names
from kendama_cli.schema.hints import listed, nearest
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.registry import comes_with, resolve


@dataclass(frozen=True)
class StageSpec:
    """One entry of a pipeline: which stage, which artifacts it needs and which configuration nodes feed it.

    ``needs`` and ``config`` map the stage's own names to the pipeline's stages and nodes; ``seeded`` stages draw
    random numbers, and the top-level seed enters their key.
    """

    name: str
    declaration: StageDeclaration
    needs: Mapping[str, str]
    config: Mapping[str, str]
    seeded: bool


@dataclass(frozen=True)
class Pipeline:
    """A declared pipeline: stages in an order in which each comes after what it needs, and its own overrides."""

    name: str
    overrides: tuple[str, ...]
    stages: tuple[StageSpec, ...]

    def stage(self, name: str, option: str) -> StageSpec:
        """Return the stage called ``name``; raises UsageError naming ``option`` otherwise."""
        for spec in self.stages:
            if spec.name == name:
                return spec
        names = [spec.name for spec in self.stages]
        problem = f"{option} {name}: pipeline '{self.name}' has no such stage"
        raise UsageError(listed(problem, nearest(name, names, f"{option} "), names, "it has"))

    def giving(self, artifact: type) -> StageSpec:
        """Return the first stage that declares ``artifact`` as its output; raises UsageError if none does."""
        for spec in self.stages:
            if resolve(spec.declaration.returns, f"stage '{spec.name}'") is artifact:
                return spec
        given = ", ".join(f"{spec.name} a {spec.declaration.returns.partition(':')[2]}" for spec in self.stages)
        raise UsageError(
            f"pipeline '{self.name}' has no stage that returns a {artifact.__name__} ({given}); name another with -p"
        )

    def until(self, name: str | None) -> Pipeline:
        """Return the part of the pipeline that ends with ``name``: that stage and all it needs; the whole for None."""
        if name is None:
            return self
        chosen_names = {self.stage(name, "--until").name}
        for spec in reversed(self.stages):
            if spec.name in chosen_names:
                chosen_names |= set(spec.needs.values())
        return Pipeline(self.name, self.overrides, tuple(spec for spec in self.stages if spec.name in chosen_names))


def pipeline_names(folders: Sequence[Path]) -> list[str]:
    """Return the names of all pipelines on the search path."""
    return sorted({file.stem for folder in folders for file in folder.glob("*.yaml") if file.is_file()})


def load_pipeline(name: str, folders: Sequence[Path]) -> Pipeline:
    """Return the pipeline ``name``, or the one in the YAML file that ``name`` points to.

    Raises UsageError where there is none, ConfigError where its declaration is wrong.
    """
    given = Path(name)
    candidates = [given] if given.suffix in (".yaml", ".yml") else [folder / f"{name}.yaml" for folder in folders]
    for path in candidates:
        if path.is_file():
            return _parse(given.stem, path)
    from kendama_cli.schema.renames import now_called, renamed  # noqa: PLC0415 - a table that is read in errors alone

    known = pipeline_names(folders)
    hint = now_called(name, new) if (new := renamed("pipeline", "pipelines", name)) else nearest(name, known, "-p ")
    raise UsageError(listed(f"no pipeline '{name}'", hint, known, "there are"))


def _parse(name: str, path: Path) -> Pipeline:
    try:
        document = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError(str(path), f"{path}: not a pipeline: {' '.join(str(error).split())}") from error
    if not isinstance(document, dict) or not isinstance(document.get("stages"), dict) or not document["stages"]:
        raise ConfigError(str(path), f"{path}: a pipeline needs 'stages:' with at least one stage")
    for key in document:
        if key not in ("stages", "overrides"):
            raise ConfigError(str(path), f"{path}: unknown key '{key}'; allowed: overrides, stages")
    specs = {entry: _spec(path, str(entry), body or {}) for entry, body in document["stages"].items()}
    return Pipeline(name, _strings(path, "overrides", document.get("overrides") or []), _sorted(path, specs))


def _spec(path: Path, name: str, body: Any) -> StageSpec:
    if not re.fullmatch(r"[\w-]+", name):  # it becomes the name of files and folders
        raise ConfigError(name, f"{path}: stage '{name}' has a name with other signs than letters, digits, _ and -")
    if not isinstance(body, dict):
        raise ConfigError(name, f"{path}: stage '{name}' must be a group of keys, not {body!r}")
    for key in body:
        if key not in ("stage", "needs", "config"):
            raise ConfigError(name, f"{path}: stage '{name}' has an unknown key '{key}'; allowed: config, needs, stage")
    chosen = str(body.get("stage", name))
    declaration = find_stage(chosen)
    if declaration is None:
        known = stage_names()
        if line := comes_with(f"{path}: stage '{chosen}'", STAGES, chosen):
            raise MissingPartError(chosen, line)
        raise ConfigError(
            name,
            f"{path}: no stage '{chosen}'; there are {', '.join(known)}{nearest(chosen, known)} (another comes with a "
            f"package that declares it in the entry point group {STAGES})",
        )
    config = _mapping(path, name, "config", body.get("config") or [])
    seeded = config.pop("seed", None) is not None
    return StageSpec(name, declaration, _mapping(path, name, "needs", body.get("needs") or []), config, seeded)


def _mapping(path: Path, stage: str, key: str, value: Any) -> dict[str, str]:
    if isinstance(value, dict):
        return {str(own): str(theirs) for own, theirs in value.items()}
    return {name: name for name in _strings(path, f"{stage}.{key}", value)}


def _strings(path: Path, key: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise ConfigError(key, f"{path}: '{key}' must be a list of names, not {value!r}")
    return tuple(value)


def _sorted(path: Path, specs: Mapping[str, StageSpec]) -> tuple[StageSpec, ...]:
    placed: dict[str, StageSpec] = {}
    waiting = dict(specs)
    while waiting:
        for name, spec in waiting.items():
            for needed in spec.needs.values():
                if needed not in specs:
                    hint = nearest(needed, specs)
                    raise ConfigError(
                        name, f"{path}: stage '{name}' needs '{needed}', which is not in this pipeline{hint}"
                    )
            if all(needed in placed for needed in spec.needs.values()):
                placed[name] = waiting.pop(name)
                break
        else:
            raise ConfigError(str(path), f"{path}: these stages need each other in a circle: {', '.join(waiting)}")
    return tuple(placed.values())
