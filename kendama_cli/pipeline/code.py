"""The digest of a stage's code: of ours every module that it imports, of a stranger's part every file.

A module of ours counts by its syntax tree, with the data files and compiled modules beside it. Of another package, of
its distribution, and of whatever packages it imports that are not installed as libraries are, every file counts.
"""

from __future__ import annotations

import functools
import importlib.machinery
import importlib.util
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.code_syntax import read_syntax
from kendama_cli.schema.public_names import at_home
from kendama_cli.schema.registry import distribution_of
from kendama_cli.store import durable

PACKAGE = "kendama_cli"
LIBRARIES = ("site-packages", "dist-packages")
"""Folders of what is installed; a package elsewhere is being worked on."""
NOT_INSTALLED = " (not installed)"
DISTRIBUTION = " (distribution)"
UNCOUNTED = (".pyc", ".pyo", ".pth", "~")
SETTLED_S = 2.0
"""A file changed more recently than this could change again within one tick of its time stamp: not indexed."""


class FileIndex:
    """Facts about files (digests, imports), remembered by size, time and inode; a cache that may be deleted."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[str, Any] = durable.read_index(path) or {}
        self._changed = False
        self.read: dict[str, list[int]] = {}
        """State of every file that facts were read, at that time."""
        self._names: dict[str, list[str]] = {}

    def facts(self, file: Path, kind: str, compute: Any) -> Any:
        """Return ``compute(file)``, remembered while the file stays the same."""
        status = file.stat()
        stamp = [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]
        self.read[str(file)] = stamp
        name = f"{kind}:{file}"
        known = self._known.get(name)
        if known is not None and known[0] == stamp:
            return known[1]
        made = compute(file)
        if time.time() - max(status.st_mtime, status.st_ctime) > SETTLED_S:
            self._known[name] = [stamp, made]
            self._changed = True
        return made

    @property
    def folders(self) -> list[str]:
        """The folders of code that there are."""
        return [folder for folder, names in self._names.items() if names]

    def names(self, folder: Path) -> list[str]:
        """Return the names in a folder of code as they were when first read, but hidden and compiled ones."""
        found = self._names.get(str(folder))
        if found is None:
            names = sorted(os.listdir(folder)) if folder.is_dir() else []
            found = [
                name for name in names if not name.startswith((".", "__pycache__")) and not name.endswith(UNCOUNTED)
            ]
            self._names[str(folder)] = found
        return found

    def save(self) -> None:
        """Keep what was learned for the next invocation."""
        if self._changed:
            durable.write_index(self._path, self._known)
            self._changed = False


@dataclass
class Code:
    """Code of a stage: the digest of each file by its path, and imports that cannot be followed."""

    digests: dict[str, str] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)
    """Imports that cannot be followed, each with its file and line; with one, a result cannot be known again."""


def code_digests(targets: Sequence[str], index: FileIndex) -> dict[str, str]:
    """Return the digest of each file of the code that ``targets`` need; see ``read_code``."""
    return read_code(targets, index).digests


def read_code(targets: Sequence[str], index: FileIndex, *, is_named: bool = False) -> Code:
    """Return the code that ``targets`` need, each of which is a module, or ``module:name``.

    ``is_named``: a declaration names what is imported by computed names. Raises UsageError where a target's module
    cannot be found.
    """
    reading = _Reading(index, {target.partition(":")[0].partition(".")[0] for target in targets}, is_named=is_named)
    for module in sorted({target.partition(":")[0] for target in targets}):
        if not reading.has(module):
            raise UsageError(f"module '{module}' is not installed; check the entry point or declaration that names it")
        reading.follow(module)
    reading.code.digests = dict(sorted(reading.code.digests.items()))
    return reading.code


def code_digest(location: str, index: FileIndex) -> str | None:
    """Return the digest of one file by its ``location`` as ``code_digests`` names it; None where it is not here."""
    if location.endswith(NOT_INSTALLED):
        return "" if _Package(location.removesuffix(NOT_INSTALLED)).is_absent else None
    top, _, inside = location.partition("/")
    if top.endswith(DISTRIBUTION):
        distribution = distribution_of(top.removesuffix(DISTRIBUTION))
        files = [] if distribution is None else [Path(str(distribution.locate_file(inside)))]
    else:
        package = _Package(top.removesuffix(".py"))
        files = [folder / inside for folder in package.folders] if inside else [package.file] if package.file else []
    return next((_digest(location, file, index) for file in files if file.is_file()), None)


class _Package:
    """A top-level module or package, where it is; nothing is imported."""

    def __init__(self, name: str) -> None:
        try:
            spec = importlib.util.find_spec(name) if name not in sys.builtin_module_names else None
        except (ImportError, ValueError):
            spec = None
        self.name = name
        self.file = Path(spec.origin) if spec is not None and spec.has_location and spec.origin else None
        within = None if spec is None else spec.submodule_search_locations
        self.is_lone = within is None
        beside = [] if self.file is None else [self.file.parent]
        self.folders = beside if within is None else [Path(one) for one in within]
        """Those of a package, of which a namespace may have several; that of a lone module."""
        is_standard = name in sys.stdlib_module_names
        self.is_absent = not is_standard and not self.folders
        self.is_library = is_standard or any(part in LIBRARIES for folder in self.folders for part in folder.parts)

    def module(self, name: str, index: FileIndex) -> Path | None:
        """Return the file of the module ``name`` in it, or the folder of a part without ``__init__.py``."""
        inside = name.split(".")[1:]
        if self.is_lone:
            return None if inside else self.file
        for folder in self.folders:
            parent, last = folder.joinpath(*inside[:-1]), inside[-1] if inside else ""
            names = index.names(parent) if last else []
            within = index.names(parent / last) if last in names or not last else []
            if "__init__.py" in within:
                return parent / last / "__init__.py"
            compiled = [one for one in names if one.startswith(f"{last}.") and one.endswith((".so", ".pyd"))]
            found = [f"{last}.py"] if f"{last}.py" in names else compiled or [last] * bool(within)
            if found:
                return parent / found[0]
        return None

    def files(self, index: FileIndex) -> Iterator[tuple[str, Path]]:
        """Yield every file of it by its path; of a lone module, itself and the files beside it that are no code."""
        if self.is_lone:
            assert self.file is not None
            yield f"{self.name}.py", self.file
            if not self.is_library:  # there stand others' files
                yield from ((f"{self.name}/{file.name}", file) for file in _data_beside(self.file, index))
            return
        seen: set[str] = set()
        waiting = [(self.name, folder) for folder in self.folders]
        while waiting:
            location, folder = waiting.pop()
            if (real := os.path.realpath(folder)) in seen:  # a link to a folder that holds it
                continue
            seen.add(real)
            for name in index.names(folder):
                if (inner := folder / name).is_dir():
                    waiting.append((f"{location}/{name}", inner))
                elif inner.is_file():
                    yield f"{location}/{name}", inner


class _Reading:
    """The code that is found by following imports."""

    def __init__(self, index: FileIndex, targets: set[str], *, is_named: bool) -> None:
        self.code = Code()
        self._index, self._targets, self._is_named = index, targets, is_named
        self._packages: dict[str, _Package] = {}
        self._seen: set[str] = set()
        self._counted: set[str] = set()

    def has(self, module: str) -> bool:
        """Return True if there is such a module."""
        return self._package(module).module(module, self._index) is not None

    def follow(self, module: str) -> None:
        """Count ``module`` and all that it imports."""
        waiting = [module]
        while waiting:
            name = waiting.pop()
            if name in self._seen:
                continue
            self._seen.add(name)
            package = self._package(name)
            file = package.module(name, self._index)
            if package.name == PACKAGE:
                self._count_ours(name, file)
            elif package.name not in self._counted:
                self._count_theirs(package)
            parents = name.split(".")[:-1]
            waiting += [".".join(parents[: i + 1]) for i in range(len(parents))]
            if file is not None and file.suffix == ".py":
                _, imports, computed = _syntax(name, file, self._index)
                waiting += at_home([one[0] for one in imports if self._is_followed(name, *one)])
                if package.name != PACKAGE and not self._is_named:
                    self._doubt(name, computed, "a module by a computed name: name its package in the declaration")

    def _package(self, module: str) -> _Package:
        top = module.partition(".")[0]
        if top not in self._packages:
            self._packages[top] = _Package(top)
        return self._packages[top]

    def _is_followed(self, importer: str, module: str, line: int, may_be_absent: bool) -> bool:
        package, is_ours = self._package(module), importer.partition(".")[0] == PACKAGE
        if package.name == PACKAGE:
            return True
        if is_ours or (package.is_library and package.name not in self._targets):
            return False  # its version stands beside the result
        if package.is_absent and may_be_absent:
            self.code.digests[package.name + NOT_INSTALLED] = ""
        elif package.module(module, self._index) is None and not may_be_absent:
            self._doubt(importer, [line], f"'{module}', which cannot be found")
        return not package.is_absent

    def _doubt(self, importer: str, lines: Sequence[int], what: str) -> None:
        self.code.unknown += [f"{importer} (line {line}) imports {what}" for line in lines]

    def _count_ours(self, name: str, file: Path | None) -> None:
        if file is not None and file.suffix == ".py":
            folder = "/".join(name.split(".") if file.name == "__init__.py" else name.split(".")[:-1])
            for one in (file, *_data_beside(file, self._index)):
                self._count(f"{folder}/{one.name}", one)

    def _count_theirs(self, package: _Package) -> None:
        self._counted.add(package.name)
        for location, file in package.files(self._index):
            self._count(location, file)
        distribution = distribution_of(package.name) if package.name in self._targets else None
        if distribution is None or distribution.read_text("RECORD") is None:
            return
        for one in distribution.files or ():
            file, location = Path(str(distribution.locate_file(one))), one.as_posix()
            if any(part.startswith("__editable__") or part in ("bin", "Scripts", "__pycache__") for part in one.parts):
                continue  # they hold paths of this machine
            if one.parts[0].endswith(".dist-info") or one.name.endswith(UNCOUNTED) or not file.is_file():
                continue
            if location not in self.code.digests:
                self._count(f"{package.name}{DISTRIBUTION}/{location}", file)

    def _count(self, location: str, file: Path) -> None:
        if location not in self.code.digests:
            self.code.digests[location] = _digest(location, file, self._index)


def _data_beside(module: Path, index: FileIndex) -> list[Path]:
    """Return the files beside a module that are no Python."""
    names = (name for name in index.names(module.parent) if not name.endswith(".py"))
    return [file for file in (module.parent / name for name in names) if file.is_file()]


def _digest(location: str, file: Path, index: FileIndex) -> str:
    if file.suffix != ".py":
        return str(index.facts(file, "content", durable.file_sha256))
    return str(_syntax(location.removesuffix(".py").removesuffix("/__init__").replace("/", "."), file, index)[0])


def _syntax(name: str, file: Path, index: FileIndex) -> Any:
    is_ours = name.partition(".")[0] == PACKAGE
    return index.facts(file, f"syntax {name}", functools.partial(read_syntax, name=name, is_ours=is_ours))
