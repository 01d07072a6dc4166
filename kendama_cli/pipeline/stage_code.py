"""The code of one stage: what its result depends on, as its declaration and its settings name it."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from typing import Any

from kendama_cli.errors import MissingPartError, brings
from kendama_cli.pipeline.catalogue import StageSpec
from kendama_cli.pipeline.code import Code, FileIndex, read_code
from kendama_cli.schema.registry import Variant, declared
from kendama_cli.schema.settings import chosen


def code_targets(spec: StageSpec, settings: Mapping[str, Any], schemas: Mapping[str, Any]) -> list[str]:
    """Return the code that a stage's result depends on: run, artifact, messages, settings, and the blocks that
    these choose.

    Not its chapter: what draws a result does not change it.
    """
    declaration = spec.declaration
    types = {*declaration.topics.values(), *(type(value) for value in settings.values())}
    blocks = [
        target
        for variant in _chosen(spec, settings, schemas)
        for target in (variant.makes, variant.settings, *_expanded(variant.packages))
    ]
    packages = _expanded(declaration.packages)
    return [declaration.run, declaration.returns, *packages, *(kind.__module__ for kind in types), *blocks]


def _expanded(packages: Sequence[str]) -> list[str]:
    """Return ``packages`` with all that an entry point group among them names."""
    return [target for one in packages for target in (declared(one).values() if _is_group(one) else (one,))]


def _is_group(package: str) -> bool:
    return package.startswith("kendama.")


def _chosen(spec: StageSpec, settings: Mapping[str, Any], schemas: Mapping[str, Any]) -> list[Variant]:
    found = [one for own, value in settings.items() for one in chosen(schemas[spec.config[own]], value)]
    return [registry.variant(kind) for registry, kind in found]


def missing_library(
    spec: StageSpec, settings: Mapping[str, Any], schemas: Mapping[str, Any]
) -> MissingPartError | None:
    """Return the error of a chosen block whose library is not installed; None where all are."""
    needed = [(one.kind, one.library) for one in _chosen(spec, settings, schemas) if one.library]
    absent = ((kind, name) for kind, name in needed if importlib.util.find_spec(name) is None)
    return next((MissingPartError(name, f"'{kind}' needs {name}; {brings(name)}") for kind, name in absent), None)


def stage_code(spec: StageSpec, settings: Mapping[str, Any], schemas: Mapping[str, Any], index: FileIndex) -> Code:
    """Return the code of a stage; see ``read_code``."""
    packages = [spec.declaration.packages, *(one.packages for one in _chosen(spec, settings, schemas))]
    named = not all(_is_group(one) for own in packages for one in own)
    return read_code(code_targets(spec, settings, schemas), index, is_named=named)
