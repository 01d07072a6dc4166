"""Input files that the configuration names: found on the data search path, digested for the key."""

from __future__ import annotations

import csv
import dataclasses
import difflib
import functools
import glob
import importlib.metadata
import os
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from kendama_cli.errors import ConfigError, MissingPartError, UsageError, install_line
from kendama_cli.pipeline.artifact_place import log_path
from kendama_cli.pipeline.code import FileIndex
from kendama_cli.pipeline.nodes import Remembered
from kendama_cli.schema.hints import listed
from kendama_cli.schema.listed_file import listed_file
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.registry import resolve
from kendama_cli.schema.settings import input_fields
from kendama_cli.store import durable

PACKAGE = "package://"
ROBOTS = "example-robot-data"
"""The distribution of robot descriptions that the extra ``robots`` brings."""
BAG_FACTS = "metadata.yaml"
"""What names the files of a ROS 2 bag, in their folder: it stands for the bag."""


def resolve_files(settings: Any, key: str, roots: Sequence[Path], home: Path | None = None) -> Any:
    """Return ``settings`` with every ``file`` field as absolute paths of existing files, globs expanded and sorted.

    A relative path is looked for below each of ``roots`` in turn, package://example-robot-data/... where that package
    is installed; MissingPartError says how to get it. A log may be named RUN/STAGE of ``home``. Raises ConfigError that
    names the key, the value and the folders searched.
    """
    if not dataclasses.is_dataclass(settings) or isinstance(settings, type):
        return settings
    changed: dict[str, Any] = {}
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        path = f"{key}.{field.name}"
        if not field.metadata.get("file"):
            changed[field.name] = resolve_files(value, path, roots, home)
        elif isinstance(value, str):
            several = "tuple" in str(field.type)
            if home is not None and field.metadata.get("log"):
                value = _logged(value, path, roots, home)
            found = _find(value, path, roots, several=several, facts=field.metadata)
            changed[field.name] = found if several or len(found) > 1 else found[0]
        elif value is not None:
            changed[field.name] = tuple(name for item in value for name in _find(item, path, roots, several=True))
    return dataclasses.replace(settings, **changed)


def at_places(settings: Any, locations: Mapping[str, str]) -> Any:
    """Return ``settings`` with the path of every input file as ``locations`` has it, by the path there was."""
    if not locations or not dataclasses.is_dataclass(settings) or isinstance(settings, type):
        return settings
    changed = {}
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if not field.metadata.get("file"):
            changed[field.name] = at_places(value, locations)
        elif isinstance(value, str):
            changed[field.name] = locations.get(value, value)
        elif value is not None:
            changed[field.name] = tuple(locations.get(one, one) for one in value)
    return dataclasses.replace(settings, **changed)


def describe(settings: Any, index: FileIndex) -> Any:
    """Return ``settings`` as plain data for a key: files by name and content digest instead of by path."""
    if dataclasses.is_dataclass(settings) and not isinstance(settings, type):
        return {
            field.name: _contents(getattr(settings, field.name), field.metadata, index)
            if field.metadata.get("file")
            else describe(getattr(settings, field.name), index)
            for field in dataclasses.fields(settings)
        }
    if isinstance(settings, tuple):
        return [describe(item, index) for item in settings]
    return settings


def file_contents(settings: Any, index: FileIndex) -> dict[str, dict[str, str]]:
    """Return every input file below ``settings`` by its path: its content's ``sha256``, and ``beside``, who named it.

    A file that a table lists stands beside that table; any other beside itself.
    """
    found = {}
    for _, value, facts in input_fields(settings):
        for one in map(Path, value):
            for path in (one, *_with(one, index, facts)):
                digest = str(index.facts(path, "content", durable.file_sha256))
                found[str(path)] = {"sha256": digest, "beside": str(one)}
    return found


def read_files(settings: Mapping[str, Mapping[str, Any]], known: Remembered) -> tuple[str, ...]:
    """Return what ``read_by`` of the settings' classes says of their files; raises InputError for a bad one."""
    lines: list[str] = []
    for value in (value for own in settings.values() for value in own.values()):
        if reader := getattr(type(value), "read_by", None):
            lines += known.once("read", (value,), functools.partial(resolve(reader, type(value).__name__), value))
    return tuple(dict.fromkeys(lines))


def _contents(value: str | tuple[str, ...] | None, facts: Mapping[str, Any], index: FileIndex) -> list[str]:
    given = [Path(path) for path in ([] if value is None else [value] if isinstance(value, str) else value)]
    rest = [path for one in given for path in _with(one, index, facts)]
    # the name counts beside the content: demonstrations are called by their files, or their bags
    named = [(f"{one.parent.name}/" if one.name == BAG_FACTS else "", one) for one in (*given, *rest)]
    return [f"{bag}{one.name} {index.facts(one, 'content', durable.file_sha256)}" for bag, one in named]


def _with(path: Path, index: FileIndex, facts: Mapping[str, Any]) -> list[Path]:
    """Return the files that belong to ``path``: the rest of its bag, the images that it lists, or what it brings."""
    if brings := facts.get("brings"):
        return list(resolve(brings, str(path))(path))
    if path.name == BAG_FACTS:
        for name in index.facts(path, "bag", _bag_files):
            listed_file(path, name, "relative_file_paths")  # the reader follows it
        names = sorted(one.name for one in path.parent.iterdir() if one.is_file() and one != path)
        return [listed_file(path, name, "beside it") for name in names]
    return _images(path, index) if facts.get("lists_images") else []


def _bag_files(path: Path) -> list[str]:
    """Return the files that a bag says it has; who reads the bag says what is wrong with it."""
    try:
        facts = load_yaml(path.read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        return [str(name) for name in facts["relative_file_paths"]]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _images(table: Path, index: FileIndex) -> list[Path]:
    """Return the files that a list of images names and that there are; raises InputError for one beyond its folder."""
    if table.suffix != ".csv":
        return []
    return [
        path
        for name, line in index.facts(table, "images", _listed)
        if os.path.isfile(path := listed_file(table, name, f"row {line}"))
    ]


def _listed(path: Path) -> list[tuple[str, int]]:
    """Return each name in a table's column ``file`` with the first line that has it."""
    names: dict[str, int] = {}
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = csv.DictReader(stream)
            for row in rows if "file" in (rows.fieldnames or ()) else ():
                names.setdefault(row["file"] or "", rows.line_num)
    except (UnicodeDecodeError, csv.Error):
        return []  # who reads the table says what is wrong with it
    return list(names.items())


def _logged(place: str, key: str, roots: Sequence[Path], home: Path) -> str:
    """Return the file of the log that ``place`` names as RUN/STAGE, or ``place`` where it is the path of a file."""
    if place.endswith(".mcap") or any((root / place).is_file() for root in roots):
        return place
    try:
        if "/" not in place:
            raise UsageError(f"name the stage too: {key}={place}/STAGE")
        return str(log_path(home, place).resolve())
    except UsageError as error:
        raise ConfigError(key, f"{key}: '{place}' is no log: {error}") from None


def _find(
    pattern: str, key: str, roots: Sequence[Path], *, several: bool, facts: Mapping[str, Any] = MappingProxyType({})
) -> tuple[str, ...]:
    expanded = Path(os.path.expanduser(_in_package(pattern, key) if pattern.startswith(PACKAGE) else pattern))
    for root in [Path("/")] if expanded.is_absolute() else roots:
        plain = root / expanded
        if (one := _file_or_bag(plain)) is not None:
            return (str(one.resolve()),)
        if plain.is_dir() and (choose := facts.get("in_folder")):
            return (_meant(resolve(choose, key)(plain), pattern, key),)
        if plain.is_dir():
            bag = any(plain.glob("*.db3*")) or any(plain.glob("*.mcap*"))
            no_bag = f" (a ROS 2 bag without its {BAG_FACTS}: 'ros2 bag reindex' makes it)" if bag else ""
            raise ConfigError(
                key, f"{key}: '{pattern}' is a folder{no_bag}; {_in_folder(plain, pattern, key, several=several)}"
            )
        found = sorted(str(one) for name in glob.glob(str(plain), recursive=True) if (one := _file_or_bag(Path(name))))
        for name in found:
            if not durable.is_text(name):
                raise ConfigError(key, f"{key}: the file name {name!a} is not UTF-8 text; rename the file")
        if found:
            return tuple(str(Path(name).resolve()) for name in found)
    made_by = facts.get("made_by")
    remedy = f"; {made_by}" if made_by else _nearest_file(expanded, key, roots)
    problem = f"{key}: no such file '{pattern}'"
    places = [str(root) for root in roots]
    raise ConfigError(key, problem + remedy if expanded.is_absolute() else listed(problem, remedy, places, "looked in"))


def _meant(files: Sequence[Path], pattern: str, key: str) -> str:
    """Return the one file that is meant by a folder; raises ConfigError where there are others, or none."""
    if len(files) == 1:
        return str(files[0].resolve())
    types = "; type " + " or ".join(shlex.quote(f"{key}={Path(pattern) / one.name}") for one in files)
    raise ConfigError(key, f"{key}: '{pattern}' has {len(files)} such files{types if files else ''}")


def _in_folder(folder: Path, pattern: str, key: str, *, several: bool) -> str:
    """Return what to type for a folder where a file is asked for."""
    endings = Counter(path.suffix for path in folder.iterdir() if path.is_file() and path.suffix)
    if several:
        ending = endings.most_common(1)[0][0] if endings and not endings[".csv"] else ".csv"
        return f"type {shlex.quote(f'{key}={pattern.rstrip(chr(47))}/*{ending}')} for all files in it"
    return f"name a file in it: {key}={pattern.rstrip('/')}/FILE"


def _nearest_file(wanted: Path, key: str, roots: Sequence[Path]) -> str:
    """Return what to type for a file that is not there: the one of the nearest name, else where to look."""
    for root in roots:  # the first is the current folder
        folder = root / wanted.parent
        if not folder.is_dir():
            return f"; there is no folder '{wanted.parent}'" if str(wanted.parent) != "." else ""
        names = sorted(path.name for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
        close = difflib.get_close_matches(wanted.name, names, n=1, cutoff=0.6)
        if close:
            return f", did you mean {shlex.quote(f'{key}={wanted.parent / close[0]}')}?"
        alike = [name for name in names if wanted.suffix and name.endswith(wanted.suffix)]
        if alike:
            return f"; there {'is' if len(alike) == 1 else 'are'} {', '.join(alike[:5])}{', ...' if alike[5:] else ''}"
        break
    return ""


def _file_or_bag(path: Path) -> Path | None:
    """Return the file ``path``, or the file that represents the ROS 2 bag in the folder ``path``; None if it is
    neither.
    """
    return next((one for one in (path, path / BAG_FACTS) if one.is_file()), None)


def _in_package(pattern: str, key: str) -> str:
    package, _, inside = pattern.removeprefix(PACKAGE).partition("/")
    if package != ROBOTS:
        raise ConfigError(key, f"{key}: '{pattern}' is in the package '{package}'; allowed: {PACKAGE}{ROBOTS}/...")
    try:
        installed = importlib.metadata.distribution(ROBOTS)
    except importlib.metadata.PackageNotFoundError:
        message = f"{key}: '{pattern}' needs the package {ROBOTS}: {install_line('robots')}"
        raise MissingPartError(ROBOTS, message) from None
    # the wheel keeps its files below cmeel's own prefix
    return str(installed.locate_file(f"cmeel.prefix/share/{ROBOTS}/robots/{inside}"))
