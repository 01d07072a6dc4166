"""Laws compiled by numba as they stand in plain Python, cached until a source that they rest on changes."""

from __future__ import annotations

import builtins
import dis
import functools
import hashlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar

import numba
import numpy as np
from numba import boolean, float64, int64, types
from numba.core import caching

__all__ = [
    "NONE", "PAIR", "READ", "READ_2D", "WRITE", "WRITE_2D", "Array", "boolean", "compiled", "compiled_as", "float64",
    "int64", "records",
]  # fmt: skip

F = TypeVar("F", bound=Callable[..., Any])
Array = Any
"""A numpy array of float64; compiled code takes no finer annotation."""

_numba: Any = numba
_types: Any = types
_caching: Any = caching
NONE, PAIR = _types.void, _types.UniTuple(float64, 2)
READ, READ_2D = (_types.Array(float64, axes, "A", readonly=True) for axes in (1, 2))
"""An array of any layout that is only read."""
WRITE, WRITE_2D = float64[::1], float64[:, ::1]

_OURS = __name__.partition(".")[0]
_made: dict[Any, Any] = {}


def compiled(function: F) -> F:
    """Return ``function`` compiled, together with every plain function of ours that it calls.

    So a law stands once, in plain Python, and a kernel that calls it has that very law. numba's cache of a function
    would notice a change of its own file only; this one notices a change of any file of ours that the function, what it
    calls, and the types that it takes stand in, and of any constant. Raises NameError for a name that is not yet bound:
    a kernel stands below what it calls.
    """
    made: F = _compile(function, None)
    return made


def compiled_as(signature: Any) -> Callable[[F], F]:
    """Return what compiles a function for the types of ``signature`` alone, at once.

    It is for whatever arrays come: others would be compiled anew, in seconds, for every mixture of them.
    """
    return lambda function: _compile(function, signature)


def records(array: Array) -> Array:
    """Return ``array`` of records so that a function can read their fields where numba compiles nothing, too."""
    return array.view(np.recarray) if _numba.config.DISABLE_JIT else array


def _compile(function: Any, signature: Any) -> Any:
    if _numba.config.DISABLE_JIT or not isinstance(function, FunctionType):
        return function
    if function not in _made:
        made = _numba.njit(error_model="numpy")(_linked(function))
        _keep(made, _stamp(function))
        if signature is not None:
            made.compile(signature)
            made.disable_compile()
        _made[function] = made
    return _made[function]


def _keep(made: Any, stamp: str) -> None:
    """Let numba keep what it makes as long as ``stamp`` is the same: it would look at one file alone."""
    made.enable_caching()
    cache = made._cache
    cache._cache_file = _caching.IndexDataCacheFile(cache.cache_path, cache._impl.filename_base, stamp)


def _linked(function: FunctionType) -> Any:
    """Return ``function`` with the compiled forms of the plain functions of ours that it calls."""
    used = dict(_globals(function))
    calls = {name: _compile(value, None) for name, value in used.items() if _is_our_function(value)}
    if not calls:
        return function
    linked: Any = FunctionType(
        function.__code__, {**function.__globals__, **calls}, function.__name__, function.__defaults__
    )
    functools.update_wrapper(linked, function, updated=())
    return linked


def _stamp(function: FunctionType) -> str:
    """Return a digest of all that decides what ``function`` compiles to but its argument types."""
    found: dict[Any, str] = {}
    _gather(function, found)
    return hashlib.sha256("\n".join(sorted(set(found.values()))).encode()).hexdigest()


def _gather(value: Any, found: dict[Any, str]) -> None:
    """Put the digests of the sources under ``value``, a function or a class of ours, into ``found``."""
    value = getattr(value, "py_func", value)
    if value in found:
        return
    found[value] = _digest(sys.modules[value.__module__])
    if isinstance(value, FunctionType):
        for name, used in _globals(value):
            if isinstance(used, ModuleType):
                found[name] = _digest(used) if _is_ours(used.__name__) else used.__name__
            elif isinstance(used, type | FunctionType) or hasattr(used, "py_func"):
                if _is_ours(used.__module__):
                    _gather(used, found)
            else:
                found[value, name] = f"{value.__module__}.{name} = {used!r}"
    known = vars(sys.modules[value.__module__])
    for name in re.findall(r"\w+", " ".join(map(str, value.__annotations__.values()))):
        if isinstance(known.get(name), type) and _is_ours(known[name].__module__):
            _gather(known[name], found)


def _globals(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Yield each global name that ``function`` reads and its value."""
    known = function.__globals__
    for name in _global_names(function.__code__):
        if name in known:
            yield name, known[name]
        elif not hasattr(builtins, name):
            raise NameError(f"{function.__module__}.{function.__qualname__} stands above '{name}', which it uses")


@functools.cache
def _global_names(code: CodeType) -> tuple[str, ...]:
    inner = [name for one in code.co_consts if isinstance(one, CodeType) for name in _global_names(one)]
    return *{step.argval: None for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL"}, *inner


def _is_our_function(value: Any) -> bool:
    return isinstance(value, FunctionType) and _is_ours(value.__module__)


def _is_ours(module: str) -> bool:
    return module.partition(".")[0] == _OURS


@functools.cache
def _digest(module: ModuleType) -> str:
    path = str(module.__file__)
    return f"{module.__name__} {hashlib.sha256(Path(path).read_bytes()).hexdigest()}"
