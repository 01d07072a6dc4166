"""Facts of settings as a reader needs them: each key's sentence, type and bounds, read from its declaration."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from kendama_cli.schema.settings import registry_of, variants


@dataclass(frozen=True)
class SettingFact:
    """One setting: its dotted ``key``, the ``kind`` of the group that it is of (None: any), field and annotation."""

    key: str
    kind: str | None
    group: type
    field: Any
    hint: Any


def sentence(field: Any) -> str:
    """Return the declared meaning of a setting as a sentence."""
    doc = str(field.metadata.get("doc", ""))
    return f"{doc[:1].upper()}{doc[1:].rstrip('.')}." if doc else ""


def setting_facts(key: str, annotation: Any, kind: str | None = None) -> Iterator[SettingFact]:
    """Yield every setting at and below the node ``key``, those of each kind of a group too."""
    kinds = variants(annotation)
    if kind is None and has_kind(kinds):
        for name, one in kinds.items():
            yield from setting_facts(key, one, name)
        return
    root = next(iter(kinds.values()))
    for path, field, hint in setting_fields(root, key):
        inner = listed_items(hint)
        if has_kind(variants(hint)) or inner is not None:
            yield from setting_facts(path if inner is None else f"{path}[]", inner or hint)
        else:
            yield SettingFact(path, kind, root, field, hint)


def setting_fields(schema: type, key: str) -> Iterator[tuple[str, Any, Any]]:
    """Yield the dotted keys below ``schema``, those of nested dataclasses too, each with its field and annotation."""
    hints = typing.get_type_hints(schema, include_extras=True)
    for field in dataclasses.fields(schema):
        if field.name == "kind":
            continue
        path, hint = f"{key}.{field.name}", hints[field.name]
        if dataclasses.is_dataclass(hint) and isinstance(hint, type) and not has_kind({"": hint}):
            yield from setting_fields(hint, path)
        else:
            yield path, field, hint


def listed_items(hint: Any) -> type | None:
    """Return the dataclass of which ``hint`` is a list; None for any other."""
    members = typing.get_args(hint) if typing.get_origin(hint) is tuple else ()
    first = members[0] if members else None
    return first if isinstance(first, type) and dataclasses.is_dataclass(first) else None


def has_kind(kinds: Mapping[str, type]) -> bool:
    """Return True if all ``kinds`` are told apart by a field ``kind``."""
    return bool(kinds) and all("kind" in typing.get_type_hints(one) for one in kinds.values())


def allowed_values(facts: Mapping[str, Any], hint: Any) -> str:
    """Return the type and the bounds of a setting in words."""
    signs = {"above": ">", "at_least": "≥", "below": "<", "at_most": "≤"}
    bounds = [f"{sign} {facts[name]:g}" for name, sign in signs.items() if name in facts]
    return ", ".join([_type(hint), *bounds])


def _type(hint: Any) -> str:
    if registry_of(hint) is not None or variants(hint):
        return "a group with `kind`" if has_kind(variants(hint)) else "a group"
    if typing.get_origin(hint) is typing.Annotated:
        return _type(typing.get_args(hint)[0])
    if typing.get_origin(hint) is typing.Literal:
        return ", ".join(f"`{one}`" for one in typing.get_args(hint))
    if typing.get_origin(hint) is tuple:
        members = [one for one in typing.get_args(hint) if one is not Ellipsis]
        return f"list of {_type(members[0])}"
    if typing.get_args(hint):
        return " or ".join(dict.fromkeys(_type(one) for one in typing.get_args(hint)))
    return {bool: "true or false", int: "whole number", float: "number", str: "text", type(None): "null"}.get(
        hint, getattr(hint, "__name__", str(hint))
    )
