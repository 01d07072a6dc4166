"""Parts that are chosen by name: ours and other projects' come through the same entry points.

An entry point's name is what configuration says (``kind:``, or a stage's name), its value ``module:OBJECT`` is a
declaration that imports nothing heavy. What does the work is named there as a string and imported where it is used.
Standard library only.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from kendama_cli.errors import ConfigError, KendamaError, MissingPartError, brings


@dataclass(frozen=True)
class Variant:
    """One variant of a block: a frozen dataclass of settings with a field ``kind``, and what makes the block of them.

    ``settings`` and ``makes`` are ``module:name``. The block's ``interface.py`` says how ``makes`` is called and what
    it returns. ``packages`` are further ones whose code counts, imported by computed names or installed as libraries
    are; or entry point groups. ``needs`` is what must stand beside the computer, for ``kendama doctor``; ``library``
    a module that not everybody has, without which no run begins.
    """

    kind: str
    settings: str
    makes: str
    packages: tuple[str, ...] = ()
    needs: str = ""
    library: str = ""


class ChosenSettings(Protocol):
    """Settings of any variant of a block, beside fields of its own."""

    @property
    def kind(self) -> str:
        """The name under which the variant is registered."""


class Registry:
    """The variants of one kind of block, by the ``kind`` that configuration chooses."""

    def __init__(self, group: str, block: str) -> None:
        """Set the entry point ``group``, and ``block``, the name of one of its variants in messages."""
        self.group, self.block = group, block

    def kinds(self) -> list[str]:
        """Return the variants there are, sorted."""
        return sorted(declared(self.group))

    def variant(self, kind: str) -> Variant:
        """Return the declaration of ``kind``; raises ConfigError where its entry point names something else."""
        found = resolve(declared(self.group)[kind], f"{self.block} '{kind}'")
        if not isinstance(found, Variant) or found.kind != kind:
            raise ConfigError(
                "kind",
                f"entry point '{kind}' of group {self.group} names {found!r}; it must name a Variant of kind '{kind}'",
            )
        return found

    def settings(self, kind: str) -> type:
        """Return the settings' dataclass of ``kind``."""
        found = resolve(self.variant(kind).settings, f"{self.block} '{kind}'")
        assert isinstance(found, type)
        return found

    def maker(self, kind: str) -> Any:
        """Return what makes the block from its settings, imported."""
        return resolve(self.variant(kind).makes, f"{self.block} '{kind}'")


@functools.cache
def _entry_points() -> Mapping[str, Sequence[tuple[str, str]]]:
    """Return name and value of every installed entry point by group, read once for all groups.

    The files are those that ``importlib.metadata`` reads, which takes longer to import than the command line's help
    takes otherwise; it is used where a package may lie in an archive. A package found twice counts where it is first.
    """
    if any(folder and os.path.isfile(folder) for folder in sys.path):
        import importlib.metadata  # noqa: PLC0415

        found = importlib.metadata.entry_points()
        return {group: [(point.name, point.value) for point in found.select(group=group)] for group in found.groups}
    points: dict[str, list[tuple[str, str]]] = {}
    seen: set[str] = set()
    for folder in sys.path:
        for info in sorted(_installed(folder or ".")):
            distribution = os.path.basename(info).partition("-")[0].lower().replace("_", "-").replace(".", "-")
            if distribution not in seen:
                seen.add(distribution)
                _read_points(info, points)
    return points


def _installed(folder: str) -> Iterator[str]:
    with contextlib.suppress(OSError):  # one that is not there, or that this user may not read
        yield from (one.path for one in os.scandir(folder) if one.name.endswith((".dist-info", ".egg-info")))


def _read_points(info: str, points: dict[str, list[tuple[str, str]]]) -> None:
    try:
        with open(os.path.join(info, "entry_points.txt"), encoding="utf-8") as file:
            lines = [line.strip() for line in file]
    except OSError:  # most packages have none
        return
    group = ""
    for line in lines:
        if line.startswith("["):
            group = line.strip("[]").strip()
        elif line and not line.startswith("#"):
            name, _, value = line.partition("=")
            points.setdefault(group, []).append((name.strip(), value.strip()))


def distribution_of(package: str) -> Any:
    """Return the ``Distribution`` whose entry points name modules of ``package``; None where there is none."""
    import importlib.metadata  # noqa: PLC0415 - slow to import, and only packages of others need it

    known = importlib.metadata.entry_points()
    points = (point for group in groups() for point in known.select(group=group))
    return next((one.dist for one in points if one.value.partition(":")[0].partition(".")[0] == package), None)


def groups() -> list[str]:
    """Return the entry point groups by which packages bring parts, sorted."""
    return sorted(group for group in _entry_points() if group.startswith("kendama."))


@functools.cache
def declared(group: str) -> Mapping[str, str]:
    """Return ``module:object`` by name of the entry points of ``group``; raises ConfigError for one declared twice."""
    found: dict[str, str] = {}
    for name, value in _entry_points().get(group, ()):
        if found.setdefault(name, value) != value:
            raise ConfigError(
                name,
                f"two packages declare '{name}' in entry point group {group}: {found[name]} and {value}; "
                "uninstall one of them",
            )
    return found


def resolve(target: str, what: str) -> Any:
    """Return the object that ``module:name`` names, imported; raises MissingPartError naming ``what`` where it
    is not.
    """
    module, _, name = target.partition(":")
    try:
        imported = importlib.import_module(module)
    except KendamaError:
        raise
    except ModuleNotFoundError as error:
        raise MissingPartError(
            target,
            f"{what} needs module '{error.name}', which is not installed ({target}); {brings(error.name or '')}",
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


TABLE = Path(__file__).with_name("parts.json")
"""``part: {entry point group: [names]}`` of what kendama can be installed without; read where something is missing."""


def missing_part(group: str, name: str) -> str | None:
    """Return the part of kendama that brings ``name`` of the entry point group ``group``; None where no part does."""
    parts = json.loads(TABLE.read_text(encoding="utf-8"))
    return next((part for part, brought in parts.items() if name in brought.get(group, ())), None)


def comes_with(what: str, group: str, name: str) -> str | None:
    """Return the line that says which part brings ``what``, the entry point ``name`` of ``group``, and how to get it.

    None where no part of kendama does.
    """
    part = missing_part(group, name)
    line = f"{what} comes with the part {part}, which this installation lacks; install the whole of kendama-cli"
    return None if part is None else line


def brought(what: str, group: str, name: str) -> Any:
    """Return the object that the entry point ``name`` of ``group`` names, imported.

    Raises MissingPartError with the part that brings ``what`` where there is none.
    """
    if name not in declared(group):
        raise MissingPartError(name, comes_with(what, group, name) or f"no installed package brings {what}")
    return resolve(declared(group)[name], what)
