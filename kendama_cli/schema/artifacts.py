"""Conversion of frozen dataclasses to plain data and arrays, and back by their declared types alone.

An artifact holds frozen dataclasses, numpy arrays, tuples, mappings, numbers, strings, truth values and None, and
unions of these that can be distinguished: scalars by their type, dataclasses by the names of their fields or by a field
annotated with a Literal. Nothing in the data names a type.
"""

from __future__ import annotations

import dataclasses
import math
import re
import types
import typing
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np

from kendama_cli.errors import StageError
from kendama_cli.schema.registry import resolve

SCALARS: tuple[type, ...] = (bool, int, float, str)
HOLDS = "frozen dataclasses, arrays, tuples, mappings, numbers, strings, truth values and None"


def artifact_type(target: str, what: str) -> type:
    """Return the artifact's dataclass that ``module:name`` names.

    Raises MissingPartError where there is none, StageError where its fields are of types that cannot be stored.
    """
    found = resolve(target, what)
    if not _is_record(found):
        raise StageError(f"{what} declares that it returns {target}, which is no frozen dataclass; make it one")
    problem = _undeclarable(found, "", set())
    if problem:
        raise StageError(f"{what} declares that it returns {target}, {problem}")
    assert isinstance(found, type)
    return found


def to_plain(declared: Any, value: Any) -> tuple[Any, dict[str, np.ndarray]]:
    """Return ``value`` as JSON data and the arrays that it names by path; raises ValueError naming what is unfit."""
    arrays: dict[str, np.ndarray] = {}
    return _flatten(declared, value, "", arrays), arrays


def from_plain(declared: Any, body: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    """Return what ``to_plain`` was given; raises ValueError, KeyError or TypeError for other data."""
    return _restore(declared, body, arrays)


def type_name(annotation: Any) -> str:
    """Return an annotation as a person would write it, without modules."""
    if isinstance(annotation, type) and not typing.get_args(annotation):
        return annotation.__name__
    return re.sub(r"\b(?:[A-Za-z_]\w*\.)+", "", str(annotation))


def _flatten(annotation: Any, value: Any, path: str, arrays: dict[str, np.ndarray]) -> Any:
    member = _member_of(annotation, value)
    if member is None:
        subject = f"its '{path}' is" if path else "it is"
        raise ValueError(f"{subject} a {type(value).__name__}, declared {type_name(annotation)}")
    if member is type(None):
        return None
    if _is_record(member):
        hints = typing.get_type_hints(member, include_extras=True)
        return {
            field.name: _flatten(hints[field.name], getattr(value, field.name), _join(path, field.name), arrays)
            for field in dataclasses.fields(member)
        }
    if _is_array(member):
        arrays[path] = value
        return {"array": path}
    if _is_mapping(member):
        kinds = typing.get_args(member)
        pairs = [(_flatten(kinds[0], key, _join(path, "key"), arrays), key) for key in value]
        pairs.sort(key=lambda pair: repr(pair[0]))
        return {
            "mapping": [
                [key, _flatten(kinds[1], value[own], _join(path, str(i)), arrays)] for i, (key, own) in enumerate(pairs)
            ]
        }
    if typing.get_origin(member) is tuple:
        kinds = _items(member, len(value))
        return [
            _flatten(kind, item, _join(path, str(i)), arrays)
            for i, (kind, item) in enumerate(zip(kinds, value, strict=True))
        ]
    return _scalar(member, value)


def _scalar(member: Any, value: Any) -> Any:
    plain = value.item() if isinstance(value, np.generic) else value
    if member is float:
        plain = float(plain)
        # JSON has no words for these
        return plain if math.isfinite(plain) else {"float": repr(plain)}
    return plain


def _restore(annotation: Any, body: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    member = _member_for(annotation, body)
    if _is_record(member):
        hints = typing.get_type_hints(member, include_extras=True)
        fields = {field.name for field in dataclasses.fields(member)}
        if set(body) != fields:
            raise ValueError(f"a {type_name(member)} has the fields {', '.join(sorted(fields))}, not {sorted(body)}")
        return member(**{name: _restore(hints[name], item, arrays) for name, item in body.items()})
    if _is_array(member):
        return arrays[body["array"]]
    if _is_mapping(member):
        key, item = typing.get_args(member)
        return {_restore(key, own, arrays): _restore(item, value, arrays) for own, value in body["mapping"]}
    if typing.get_origin(member) is tuple:
        kinds = _items(member, len(body))
        return tuple(_restore(kind, item, arrays) for kind, item in zip(kinds, body, strict=True))
    return _restore_scalar(member, body)


def _restore_scalar(member: Any, body: Any) -> Any:
    if member is type(None):
        return None
    if member is float and isinstance(body, dict):
        return float(body["float"])
    if not _scalar_fits(member, body):
        raise ValueError(f"{body!r} is no {type_name(member)}")
    return body


def _members(annotation: Any) -> tuple[Any, ...]:
    """Return the members of a union, of one type itself; without what Annotated adds, and what an alias stands for."""
    alias, arguments = typing.get_origin(annotation) or annotation, typing.get_args(annotation)
    if hasattr(alias, "__value__"):  # of a ``type`` statement, as numpy's NDArray is one from 2.5 on
        return _members(alias.__value__[arguments] if arguments else alias.__value__)
    if typing.get_origin(annotation) is Annotated:
        return _members(typing.get_args(annotation)[0])
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return tuple(one for member in typing.get_args(annotation) for one in _members(member))
    return (type(None),) if annotation is None else (annotation,)


def _member_of(annotation: Any, value: Any) -> Any:
    """Return the member of the union ``annotation`` that ``value`` is of; None where it is of none."""
    members = _members(annotation)
    fitting = [member for member in members if _fits(member, value)]
    if not fitting and float in members and _fits(int, value):
        return float  # a whole number where a number is declared
    return fitting[0] if fitting else None


def _fits(member: Any, value: Any) -> bool:
    if _is_record(member):
        return type(value) is member
    if _is_array(member):
        return isinstance(value, np.ndarray) and _dtype_fits(member, value.dtype)
    if _is_mapping(member):
        return isinstance(value, Mapping)
    if typing.get_origin(member) is tuple:
        return isinstance(value, tuple) and len(_items(member, len(value))) == len(value)
    return _scalar_fits(member, value.item() if isinstance(value, np.generic) else value)


def _scalar_fits(member: Any, value: Any) -> bool:
    if typing.get_origin(member) is Literal:
        return any(type(value) is type(choice) and value == choice for choice in typing.get_args(member))
    return type(value) is member


def _member_for(annotation: Any, body: Any) -> Any:
    """Return the member of the union ``annotation`` that the plain ``body`` was made from."""
    members = _members(annotation)
    if len(members) == 1:
        return members[0]
    found = [member for member in members if _may_be(member, body)]
    if not found:
        raise ValueError(f"{body!r} is none of {', '.join(map(type_name, members))}")
    return found[0]


def _may_be(member: Any, body: Any) -> bool:
    if isinstance(body, dict):
        if set(body) != _keys(member):
            return False
        return all(body[name] in choices for name, choices in _literals(member).items())
    if isinstance(body, list):
        return typing.get_origin(member) is tuple
    return _scalar_fits(member, body)


def _undeclarable(annotation: Any, path: str, seen: set[Any]) -> str:
    """Return why an annotation cannot be stored; empty where it can."""
    members = _members(annotation)
    where = f"whose field '{path}'" if path else "which"
    for i, member in enumerate(members):
        for other in members[:i]:
            if _alike(member, other):
                return (
                    f"{where} may be a {type_name(other)} or a {type_name(member)}: these cannot be distinguished; "
                    "give both a field 'kind' annotated with a Literal"
                )
    for member in members:
        problem = _undeclarable_member(member, path, seen, where)
        if problem:
            return problem
    return ""


def _undeclarable_member(member: Any, path: str, seen: set[Any], where: str) -> str:
    if _is_record(member):
        if member in seen:
            return ""
        seen.add(member)
        hints = typing.get_type_hints(member, include_extras=True)
        fields = dataclasses.fields(member)
        inner = [(hints[field.name], field.name) for field in fields]
        if not all(field.init for field in fields):
            return f"{where} has fields that its constructor does not take"
    elif _is_mapping(member) and len(typing.get_args(member)) == 2:
        key, item = typing.get_args(member)
        if not all(one in SCALARS or typing.get_origin(one) is Literal for one in _members(key)):
            return f"{where} has keys of type {type_name(key)}; allowed: numbers and strings"
        inner = [(item, "*")]
    elif typing.get_origin(member) is tuple:
        inner = [(item, "*") for item in typing.get_args(member) if item is not Ellipsis]
    elif member in SCALARS or member is type(None) or _is_array(member) or typing.get_origin(member) is Literal:
        inner = []
    else:
        return f"{where} is declared {type_name(member)}; an artifact holds {HOLDS}"
    found = (_undeclarable(annotation, _join(path, name), seen) for annotation, name in inner)
    return next((problem for problem in found if problem), "")


def _alike(one: Any, other: Any) -> bool:
    """Return True if two members of a union leave the same data behind."""
    if typing.get_origin(one) is tuple and typing.get_origin(other) is tuple:
        return True
    keys = _keys(one)
    if not keys or keys != _keys(other):
        return False
    first, second = _literals(one), _literals(other)
    return not any(name in second and not set(first[name]) & set(second[name]) for name in first)


def _keys(member: Any) -> set[str]:
    """Return the keys of the JSON object that a member becomes; empty where it becomes none."""
    if _is_record(member):
        return {field.name for field in dataclasses.fields(member)}
    if _is_array(member):
        return {"array"}
    if _is_mapping(member):
        return {"mapping"}
    return {"float"} if member is float else set()


def _literals(member: Any) -> dict[str, tuple[Any, ...]]:
    """Return the choices of a dataclass's Literal fields."""
    if not _is_record(member):
        return {}
    hints = typing.get_type_hints(member)
    return {name: typing.get_args(hint) for name, hint in hints.items() if typing.get_origin(hint) is Literal}


def _is_record(annotation: Any) -> bool:
    if not (isinstance(annotation, type) and dataclasses.is_dataclass(annotation)):
        return False
    return bool(vars(annotation)["__dataclass_params__"].frozen)


def _is_array(annotation: Any) -> bool:
    return annotation is np.ndarray or typing.get_origin(annotation) is np.ndarray


def _is_mapping(annotation: Any) -> bool:
    origin = typing.get_origin(annotation)
    return isinstance(origin, type) and issubclass(origin, Mapping)


def _dtype_fits(annotation: Any, dtype: np.dtype[Any]) -> bool:
    if dtype.hasobject:  # would need pickle
        return False
    declared = typing.get_args(typing.get_args(annotation)[1])[0] if typing.get_args(annotation) else np.generic
    return not isinstance(declared, type) or issubclass(dtype.type, declared)


def _items(annotation: Any, n: int) -> tuple[Any, ...]:
    """Return the types of the n items of a tuple."""
    members = typing.get_args(annotation)
    return members[:1] * n if members[1:] == (Ellipsis,) else members


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
