"""Parts that are chosen by name: ours and other projects' come through the same entry points.

An entry point's name is what configuration says (``kind:``, or a stage's name), its value ``module:OBJECT`` is a
declaration that imports nothing heavy. What does the work is named there as a string and imported where it is used.
Standard library only.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kendama_cli.errors import ConfigError, KendamaError, MissingPartError


@dataclass(frozen=True)
class Variant:
    """One variant of a block: a frozen dataclass of settings with a field ``kind``, and what makes the block of them.

    ``settings`` and ``makes`` are ``module:name``. The block's ``interface.py`` says how ``makes`` is called and what
    it gives. ``packages`` are further ones whose code counts, imported by computed names or installed as libraries are.
    ``needs`` is what must stand beside the computer, for ``kendama doctor``.
    """

    kind: str
    settings: str
    makes: str
    packages: tuple[str, ...] = ()
    needs: str = ""


class Registry:
    """The variants of one kind of block, by the ``kind`` that configuration chooses."""

    def __init__(self, group: str, block: str) -> None:
        """``group`` is the entry point group, ``block`` what one of its variants is called in messages."""
        self.group, self.block = group, block

    def kinds(self) -> list[str]:
        """The variants there are, sorted."""
        return sorted(declared(self.group))

    def variant(self, kind: str) -> Variant:
        """The declaration of ``kind``; raises ConfigError where its entry point names something else."""
        found = resolve(declared(self.group)[kind], f"{self.block} '{kind}'")
        if not isinstance(found, Variant) or found.kind != kind:
            raise ConfigError(
                "kind",
                f"entry point '{kind}' of group {self.group} names {found!r}; it must name a Variant of kind '{kind}'",
            )
        return found

    def settings(self, kind: str) -> type:
        """The settings' dataclass of ``kind``."""
        found = resolve(self.variant(kind).settings, f"{self.block} '{kind}'")
        assert isinstance(found, type)
        return found

    def maker(self, kind: str) -> Any:
        """What makes the block from its settings, imported."""
        return resolve(self.variant(kind).makes, f"{self.block} '{kind}'")


@functools.cache
def _entry_points() -> Any:
    """Those of every installed package, read once for all groups; what has ``select`` differs between Pythons."""
    import importlib.metadata  # noqa: PLC0415 - slow to import, and a run with nothing to do needs none of it

    return importlib.metadata.entry_points()


def distribution_of(package: str) -> Any:
    """Return the ``Distribution`` whose entry points name modules of ``package``; None where there is none."""
    points = (point for group in groups() for point in _entry_points().select(group=group))
    return next((one.dist for one in points if one.value.partition(":")[0].partition(".")[0] == package), None)


def groups() -> list[str]:
    """Return the entry point groups by which packages bring parts, sorted."""
    return sorted(group for group in _entry_points().groups if group.startswith("kendama."))


@functools.cache
def declared(group: str) -> Mapping[str, str]:
    """``module:object`` by name, for every entry point of ``group``; raises ConfigError for a name declared twice."""
    found: dict[str, str] = {}
    for point in _entry_points().select(group=group):
        if found.setdefault(point.name, point.value) != point.value:
            raise ConfigError(
                point.name,
                f"two packages declare '{point.name}' in entry point group {group}: {found[point.name]} and "
                f"{point.value}; uninstall one of them",
            )
    return found


def resolve(target: str, what: str) -> Any:
    """The object that ``module:name`` names, imported; raises MissingPartError naming ``what`` where it is not."""
    module, _, name = target.partition(":")
    try:
        imported = importlib.import_module(module)
    except KendamaError:
        raise
    except ModuleNotFoundError as error:
        raise MissingPartError(
            target, f"{what} needs module '{error.name}', which is not installed ({target})"
        ) from error
    except Exception as error:  # of a library in a version that does not fit, or of a part that is broken
        raise MissingPartError(
            target, f"{what} cannot be imported ({type(error).__name__}: {error}); 'kendama doctor' says what is broken"
        ) from error
    try:
        return getattr(imported, name)
    except AttributeError as error:
        raise MissingPartError(
            target, f"{what}: module '{module}' has no '{name}'; mend the entry point that names it"
        ) from error
