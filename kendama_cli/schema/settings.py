"""Declaration of settings, and their construction from plain configuration.

Settings are frozen dataclasses without defaults: the values live in ``conf/`` alone. ``setting()`` declares what a
field means and allows; ``build()`` turns nested dicts into the dataclass and names the key of whatever does not fit.
Standard library only: the command line reads settings before anything heavy is imported.
"""

from __future__ import annotations

import dataclasses
import math
import operator
import re
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, Literal, TypeVar

from kendama_cli.errors import ConfigError, MissingPartError
from kendama_cli.schema.hints import listed, unknown_key, value_hint
from kendama_cli.schema.registry import Registry, comes_with

T = TypeVar("T")


def setting(
    doc: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    file: bool = False,
    lists_images: bool = False,
    made_by: str | None = None,
    in_folder: str | None = None,
    brings: str | None = None,
    log: bool = False,
    absent: Any = ...,
) -> Any:
    """Declare one field: its meaning with the unit, its range, and whether it names input files.

    A ``file`` field enters a stage's key by the content of the files, never by their path; where one is a table that
    ``lists_images``, the images in its column ``file`` do too. ``made_by`` says what makes such files, for where there
    are none. ``in_folder`` and ``brings`` name functions (``module:function``) of a path: the files of a folder that
    may be meant, and further files that a file reads, for the key. A ``log`` may be called RUN/STAGE. ``absent`` is
    what a file or code from before there was this field means.
    """
    facts: dict[str, object] = {"doc": doc, "above": above, "at_least": at_least, "below": below, "at_most": at_most}
    facts |= {"file": file, "lists_images": lists_images, "made_by": made_by}
    facts |= {"in_folder": in_folder, "brings": brings, "log": log}
    metadata = {name: value for name, value in facts.items() if value is not None and value is not False}
    if absent is ...:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=absent, kw_only=True, metadata={**metadata, "absent": absent})


def build(schema: type[T], data: Any, key: str = "") -> T:
    """Build the dataclass ``schema`` from nested plain ``data``; ``key`` is where ``data`` stands.

    Raises ConfigError, naming the dotted key, for an unknown or missing key, a wrong type or a value out of range.
    """
    if not isinstance(data, Mapping):
        raise ConfigError(key, f"'{key}' must be a group of keys, not {data!r}")
    hints = typing.get_type_hints(schema, include_extras=True)
    fields = {field.name: field for field in dataclasses.fields(schema)}  # type: ignore[arg-type]
    for name in data:
        if name not in fields:
            raise unknown_key(_join(key, str(name)), fields)
    values = {}
    for name, field in fields.items():
        path = _join(key, name)
        if name not in data and "absent" in field.metadata:
            values[name] = field.metadata["absent"]
            continue
        if name not in data:
            raise ConfigError(path, f"missing key '{path}': {field.metadata.get('doc', 'it has no value in conf/')}")
        values[name] = _value(hints[name], data[name], path, field.metadata)
    try:
        return schema(**values)
    except ConfigError as error:  # a rule across fields knows its own names, not where it stands
        full = _join(key, error.key)
        raise ConfigError(full, str(error).replace(f"'{error.key}'", f"'{full}'")) from None


def build_value(annotation: Any, data: Any, key: str) -> Any:
    """Build as ``build`` does, for any annotation that a field may have.

    A dataclass; a union of them distinguished by ``kind``; a Registry, or ``Annotated[Protocol, REGISTRY]``, whose
    variants other packages add: it builds the dataclass for the ``kind`` in ``data``.
    """
    return _value(annotation, data, key, {})


def variants(annotation: Any) -> dict[str, type]:
    """Return the dataclasses that ``annotation`` allows by their ``kind``: of a registry, a union, or one dataclass.

    Empty for anything else. A registry imports the settings of all its variants for this.
    """
    return {kind: schema() for kind, schema in _choices(annotation).items()}


def _choices(annotation: Any) -> dict[str, Callable[[], type]]:
    """Return the getter of the dataclass by kind: a registry's variant is imported only when it is chosen."""
    registry = registry_of(annotation)
    if registry is not None:
        return {kind: partial(registry.settings, kind) for kind in registry.kinds()}
    if _is_union(annotation):
        return {kind: schema for member in typing.get_args(annotation) for kind, schema in _choices(member).items()}
    if not (dataclasses.is_dataclass(annotation) and isinstance(annotation, type)):
        return {}
    kind = typing.get_type_hints(annotation).get("kind")
    names = typing.get_args(kind) or (annotation.__name__,)
    return {str(name): partial(_same, annotation) for name in names}


def registry_of(annotation: Any) -> Registry | None:
    """Return the registry that ``annotation`` is, or is annotated with; None for any other."""
    members = annotation.__metadata__ if typing.get_origin(annotation) is Annotated else (annotation,)
    return next((member for member in members if isinstance(member, Registry)), None)


def _same(schema: type) -> type:
    return schema


def input_files(settings: Any, key: str = "") -> dict[str, tuple[str, ...]]:
    """Return the values of every ``file`` field below ``settings`` by dotted key."""
    return {path: values for path, values, _ in input_fields(settings, key)}


def input_fields(settings: Any, key: str = "") -> list[tuple[str, tuple[str, ...], Mapping[str, Any]]]:
    """Return the dotted key, the values and the declaration of every ``file`` field below ``settings``."""
    found: list[tuple[str, tuple[str, ...], Mapping[str, Any]]] = []
    if not dataclasses.is_dataclass(settings):
        return found
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        path = _join(key, field.name)
        if not field.metadata.get("file"):
            found += input_fields(value, path)
        else:
            values = () if value is None else (value,) if isinstance(value, str) else tuple(value)
            found.append((path, values, field.metadata))
    return found


def chosen(annotation: Any, value: Any) -> list[tuple[Registry, str]]:
    """Return every registered variant that ``value``, built by ``annotation``, names: its registry and kind."""
    registry = registry_of(annotation)
    if registry is not None:
        return [(registry, value.kind), *_chosen_within(value)]
    if typing.get_origin(annotation) is Annotated:
        return chosen(typing.get_args(annotation)[0], value)
    if isinstance(value, tuple):
        members = typing.get_args(annotation)
        item = members[0] if members else Any
        return [found for one in value for found in chosen(item, one)]
    if value is not None and _is_union(annotation):
        registries = [member for member in typing.get_args(annotation) if registry_of(member) is not None]
        return chosen(registries[0], value) if registries else _chosen_within(value)
    return _chosen_within(value)


def _chosen_within(value: Any) -> list[tuple[Registry, str]]:
    if not dataclasses.is_dataclass(value):
        return []
    hints = typing.get_type_hints(type(value), include_extras=True)
    fields = dataclasses.fields(value)
    return [found for field in fields for found in chosen(hints[field.name], getattr(value, field.name))]


def _join(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


def _is_union(annotation: Any) -> bool:
    return typing.get_origin(annotation) in (typing.Union, types.UnionType)


def _value(annotation: Any, value: Any, key: str, facts: Mapping[str, Any]) -> Any:
    registry = registry_of(annotation)
    if registry is not None:
        return _variant(_choices(annotation), value, key, (registry,))
    if typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    if _is_union(annotation):
        return _union(annotation, value, key, facts)
    origin = typing.get_origin(annotation)
    if origin is Literal:
        choices = typing.get_args(annotation)
        # True == 1 in Python, so the types count too
        if not any(type(value) is type(choice) and value == choice for choice in choices):
            names = [str(choice) for choice in choices]
            raise ConfigError(key, listed(f"'{key}' is {value!r}", value_hint(key, value, names), names))
        return value
    if origin is tuple:
        return _tuple(annotation, value, key, facts)
    if dataclasses.is_dataclass(annotation):
        return build(typing.cast(type, annotation), value, key)
    return _scalar(annotation, value, key, facts)


def _union(annotation: Any, value: Any, key: str, facts: Mapping[str, Any]) -> Any:
    members = typing.get_args(annotation)
    if value is None and type(None) in members:
        return None
    if len(some := [member for member in members if member is not type(None)]) == 1:
        return _value(some[0], value, key, facts)
    choices = _choices(annotation)
    if choices:
        return _variant(choices, value, key, [one for one in map(registry_of, members) if one is not None])
    errors = []
    for member in members:
        if member is type(None):
            continue
        try:
            return _value(member, value, key, facts)
        except ConfigError as error:
            errors.append(error)
    raise errors[0]


def _variant(choices: Mapping[str, Callable[[], type]], value: Any, key: str, registries: Sequence[Registry]) -> Any:
    kind = value.get("kind") if isinstance(value, Mapping) else value
    if not isinstance(kind, str) or kind not in choices:
        for registry in registries:
            if line := comes_with(f"{key}={kind}", registry.group, str(kind)):
                raise MissingPartError(str(kind), line)
        hint = value_hint(key, kind, choices, f"{key}.kind")
        raise ConfigError(key, listed(f"'{key}.kind' is {kind!r}", hint, sorted(choices)))
    return build(choices[kind](), value, key)


def _tuple(annotation: Any, value: Any, key: str, facts: Mapping[str, Any]) -> tuple[Any, ...]:
    members = typing.get_args(annotation)
    if isinstance(value, str) or not isinstance(value, (list, tuple)):
        raise ConfigError(key, f"'{key}' must be a list like [a, b], not {value!r}")
    if len(members) == 2 and members[1] is Ellipsis:
        members = (members[0],) * len(value)
    elif len(members) != len(value):
        raise ConfigError(key, f"'{key}' must have {len(members)} values, not {len(value)}")
    return tuple(
        _value(member, item, f"{key}[{i}]", facts) for i, (member, item) in enumerate(zip(members, value, strict=True))
    )


def _scalar(annotation: Any, value: Any, key: str, facts: Mapping[str, Any]) -> Any:
    expected = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}.get(annotation)
    if expected is None:
        raise TypeError(f"{key}: settings cannot hold {annotation!r}")
    fits = isinstance(value, annotation) and not (annotation is int and isinstance(value, bool))
    if annotation is float and isinstance(value, int) and not isinstance(value, bool):
        value, fits = _as_float(value, key), True
    if not fits:
        problem = f"'{key}' must be {expected}{_range(facts)}, not {value!r}"
        raise ConfigError(key, problem + _as_typed(annotation, value, key))
    if annotation in (int, float):
        _check_range(value, key, facts)
    return value


WORDS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
NUMBER = re.compile(r"([+-]?\d+)[.,]?(\d*)\s*([^\d\s.,:-]*)")


def _as_typed(annotation: Any, value: Any, key: str) -> str:
    """Return the line to type for a value that reads like one of the type ``annotation``."""
    text = str(value).strip()
    if annotation is bool and text.lower() in WORDS:
        return f"; type {key}={str(WORDS[text.lower()]).lower()}"
    found = NUMBER.fullmatch(text)
    if annotation in (int, float) and found and not (annotation is int and found[2].strip("0")):
        number = found[1] if annotation is int or not found[2] else f"{found[1]}.{found[2]}"
        return f"; type {key}={number}" + (", without a unit" if found[3] else "")
    return f"; 'kendama explain {key}' tells what it is"


def _as_float(value: int, key: str) -> float:
    try:
        return float(value)
    except OverflowError:
        raise ConfigError(key, f"'{key}' is a number of {value.bit_length()} bits; allowed: up to 1.8e308") from None


def _check_range(value: float, key: str, facts: Mapping[str, Any]) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(key, f"'{key}' must be a finite number, not {value!r}")
    rules = (("above", operator.gt), ("at_least", operator.ge), ("below", operator.lt), ("at_most", operator.le))
    for name, holds in rules:
        if name in facts and not holds(value, facts[name]):
            raise ConfigError(key, f"'{key}' is {value!r}; allowed:{_range(facts)}")


def _range(facts: Mapping[str, Any]) -> str:
    """Return the bounds of a number in words after a space; empty where it has none."""
    words = {"above": "above", "at_least": "at least", "below": "below", "at_most": "at most"}
    bounds = " and ".join(f"{text} {facts[fact]}" for fact, text in words.items() if fact in facts)
    return f" {bounds}" if bounds else ""
