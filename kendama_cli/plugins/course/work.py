"""Names that a student's notebook defined, as the checks ask for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.schema.arrays import Array


class WrongAnswerError(Exception):
    """A task that is not solved, with the line that helps."""


class Work:
    """The names that the cells of a notebook defined, and the folder that it lies in."""

    def __init__(self, names: Mapping[str, Any], folder: Path) -> None:
        self._names = names
        self.folder = folder

    def value(self, name: str) -> Any:
        """Return the value of ``name``; WrongAnswerError if it is missing, or still to be filled in."""
        found = self._names.get(name)
        if found is None or found is ...:
            raise WrongAnswerError(f"'{name}' is not filled in yet")
        return found

    def number(self, name: str) -> float:
        """Return a finite number."""
        try:
            found = float(self.value(name))
        except (TypeError, ValueError):
            raise WrongAnswerError(f"'{name}' is {self.value(name)!r}; it has to be a number") from None
        if not np.isfinite(found):
            raise WrongAnswerError(f"'{name}' is {found}; it has to be finite")
        return found

    def choice(self, name: str, *allowed: str) -> str:
        """Return one of the words ``allowed``."""
        found = self.value(name)
        if found not in allowed:
            raise WrongAnswerError(f"'{name}' is {found!r}; allowed: {', '.join(map(repr, allowed))}")
        return str(found)

    def function(self, name: str) -> Callable[..., Any]:
        """Return a function of the student's, whose errors and missing answers become WrongAnswerError."""
        found = self.value(name)
        if not callable(found):
            raise WrongAnswerError(f"'{name}' is {found!r}; it has to be a function")

        def called(*arguments: Any, **options: Any) -> Any:
            try:
                answer = found(*arguments, **options)
            except Exception as error:
                raise WrongAnswerError(f"{name}() raised {type(error).__name__}: {error}") from error
            if answer is None or answer is ...:
                raise WrongAnswerError(f"{name}() gives nothing yet: fill it in, and return the result")
            return answer

        return called


def array_of(name: str, found: Any, shape: tuple[int, ...]) -> Array:
    """Return ``found`` as an array of this shape; WrongAnswerError if it is none or not finite."""
    try:
        made = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise WrongAnswerError(f"{name} is {type(found).__name__}; it has to be numbers of shape {shape}") from None
    if made.shape != shape:
        raise WrongAnswerError(f"{name} has shape {made.shape}; it has to be {shape}")
    if not np.isfinite(made).all():
        raise WrongAnswerError(f"{name} has values that are not finite")
    return made


def require_close(name: str, found: Any, wanted: Any, within: float, hint: str) -> None:
    """Raise WrongAnswerError, with ``hint``, if ``found`` is farther than ``within`` from ``wanted`` anywhere."""
    goal = np.asarray(wanted, dtype=np.float64)
    made = array_of(name, found, goal.shape)
    apart = np.abs(made - goal)
    if apart.size and apart.max() > within:
        at = np.unravel_index(int(apart.argmax()), apart.shape)
        where = f" at {tuple(int(i) for i in at)}" if apart.ndim else ""
        raise WrongAnswerError(f"{name} is {made[at]:.5g}{where}, expected {goal[at]:.5g}; {hint}")


def require(held: bool, message: str) -> None:
    """Raise WrongAnswerError with ``message`` unless ``held``."""
    if not held:
        raise WrongAnswerError(message)
