"""Overrides and files of settings by the names of today: comments, order and quotes stay."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from kendama_cli.config.site import Site
from kendama_cli.errors import UsageError
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.renames import new_key, new_value, renamed
from kendama_cli.store import durable

_INTERPOLATION = re.compile(r"\$\{([\w.]+)\}")
_PACKAGE = re.compile(r"^#\s*@package\s+(\S+)", re.MULTILINE)


@dataclass(frozen=True)
class _Edit:
    """One name in the text, from ``start`` to ``end``, and its replacement."""

    start: int
    end: int
    new: str


def renamed_yaml(text: str, key: str) -> tuple[str, list[tuple[str, str]]]:
    """Return YAML whose values stand at the dotted ``key`` by the names of today, and each old name with its new one.

    Raises ValueError, in one line, for anything but plain YAML.
    """
    load_yaml(text)
    edits = sorted(_edits(yaml.compose(text, Loader=yaml.SafeLoader), key), key=lambda edit: edit.start)
    made, at = "", 0
    for edit in edits:
        made, at = made + text[at : edit.start] + edit.new, edit.end
    return made + text[at:], [(text[edit.start : edit.end], edit.new) for edit in edits]


def _edits(node: yaml.Node | None, key: str) -> Iterator[_Edit]:
    if isinstance(node, yaml.MappingNode):
        for name, value in node.value:
            yield from _pair(name, value, key)
    elif isinstance(node, yaml.SequenceNode):
        for one in node.value:
            yield from _edits(one, key)
    elif isinstance(node, yaml.ScalarNode):
        yield from _scalar(node, key)


def _pair(name: yaml.Node, value: yaml.Node, key: str) -> Iterator[_Edit]:
    """Yield the edits of one key and what it holds; a key may have dots, and in a list of defaults slashes."""
    written = str(name.value)
    word = written.removeprefix("override ").removeprefix("/")
    absolute = word != written.removeprefix("override ")
    before = "" if absolute or not key else f"{key}."
    new = new_key(before + word.replace("/", ".")).removeprefix(before)
    if new != word.replace("/", "."):
        yield _replaced(name, written.replace(word, new.replace(".", "/") if "/" in word else new))
    yield from _edits(value, before + new if new not in ("defaults", "overrides") else key)


def _scalar(node: yaml.ScalarNode, key: str) -> Iterator[_Edit]:
    text = str(node.value)
    new = renamed("value", key, text)
    if new is None:
        new = _INTERPOLATION.sub(lambda found: f"${{{new_key(found.group(1))}}}", text)
        new = new_override(new) if "=" in new else new
    if new != text:
        yield _replaced(node, new)


def _replaced(node: yaml.Node, new: str) -> _Edit:
    quote = getattr(node, "style", None)
    quote = quote if quote in ("'", '"') else ""
    return _Edit(node.start_mark.index + len(quote), node.end_mark.index - len(quote), new)


def new_override(text: str) -> str:
    """Return an override such as ``adapt.eyes.rate_hz=60`` by the names of today; what cannot be read stays."""
    found = re.match(r"^([+~]{0,2})([\w./\[\]]+)(@[\w.]+)?(=|$)(.*)$", text, re.DOTALL)
    if found is None:
        return text
    sign, written, package, equals, value = found.groups()
    # a group's choice and a key are told apart by slashes alone
    key = new_key(written.replace("/", "."))
    shown = key.replace(".", "/") if "/" in written else key
    if value[:1] in ("[", "{"):
        with contextlib.suppress(ValueError):  # Hydra's grammar has more than YAML: as it is written
            value = renamed_yaml(value, key)[0]
    else:
        value = ",".join(str(new_value(key, word)) for word in value.split(","))
    return f"{sign}{shown}{package or ''}{equals}{value}"


def migrate_file(site: Site, path: Path) -> list[tuple[str, str]]:
    """Rewrite a YAML of settings, of a pipeline or of overrides; return each old name with its new one.

    A file in a group of a ``conf`` folder has keys of that group. Raises UsageError for what is no YAML of keys.
    """
    try:
        text = path.read_text(encoding="utf-8")
        made, changed = renamed_yaml(text, _prefix(site, path, text))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise UsageError(f"--migrate {path}: it cannot be read ({reason}); name a YAML file of settings") from None
    if changed:
        durable.write_file(path, made.encode(), option="--migrate")
    return changed


def _prefix(site: Site, path: Path, text: str) -> str:
    """Return the dotted key below which the file's keys stand; empty for those of a whole configuration."""
    if package := _PACKAGE.search(text):
        named = package.group(1)
        return "" if named in ("_global_", "_group_") else new_key(named)
    folder = path.resolve().parent
    roots = [root.resolve() for root in site.conf_folders]
    inside = next((folder.relative_to(root) for root in roots if folder.is_relative_to(root)), None)
    if inside is None:  # a conf folder that is not in use
        parts = folder.parts
        inside = Path(*parts[parts.index("conf") + 1 :]) if "conf" in parts else Path()
    return new_key(".".join(inside.parts))
