"""The shipped configuration files as plain values, with what their defaults and conf/config.yaml add to them."""

from __future__ import annotations

import copy
import functools
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.schema.settings import build_value

CONF = Path(__file__).resolve().parents[1] / "conf"


def configured(schema: Any, group: str, name: str) -> Any:
    """The settings that ``group=name`` gives, of type ``schema``; a robot's path is made absolute."""
    document = plain(group, name)
    if group == "robot":
        document["path"] = str(CONF.parent / document["path"])
    return build_value(schema, document, group)


def plain(group: str, name: str) -> dict[str, Any]:
    """The node that ``group=name`` gives: ``conf/GROUP/NAME.yaml`` with its defaults, and the default subgroups."""
    return copy.deepcopy(_read(group, name))


@functools.cache
def _read(group: str, name: str) -> dict[str, Any]:
    text = (CONF / group / f"{name}.yaml").read_text()
    own: dict[str, Any] = yaml.safe_load(text)
    values: dict[str, Any] = {}
    for entry in own.pop("defaults", []):
        if isinstance(entry, str):
            values |= {} if entry == "_self_" else plain(group, entry)
            continue
        for key, choice in entry.items():
            values |= _below(group, key, choice)
    for entry in _defaults():
        for path, choice in entry.items() if isinstance(entry, dict) else ():
            if path.startswith(f"{group}/"):
                values |= _below(group, path.removeprefix(f"{group}/"), choice)
    made = values | own
    for entry in _defaults():
        for path, choice in entry.items() if isinstance(entry, dict) else ():
            header = _header(path, choice)
            if header.startswith(f"# @package {group}."):  # a node below this group's, set by a group beside it
                made[header.removeprefix(f"# @package {group}.")].update(plain(path, choice))
    return made


def _header(group: str, choice: str | None) -> str:
    file = CONF / group / f"{choice}.yaml"
    return file.read_text().splitlines()[0] if file.is_file() else ""


@functools.cache
def _defaults() -> list[Any]:
    return list(yaml.safe_load((CONF / "config.yaml").read_text())["defaults"])


def _below(group: str, key: str, choice: str) -> dict[str, Any]:
    """What a subgroup adds to its group: a key of its name, or keys beside it where the file's header says so."""
    made = plain(f"{group}/{key}", choice)
    return made if _header(f"{group}/{key}", choice) == f"# @package {group}" else {key: made}
