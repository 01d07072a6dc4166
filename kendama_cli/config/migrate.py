"""Files of settings by the names of today: what an older version read is rewritten in its place.

Only names change. Comments, order, spaces and quotes stay, as each name is replaced where it stands in the text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

from kendama_cli.config.site import Site
from kendama_cli.errors import UsageError
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.renames import new_key, new_override, renamed
from kendama_cli.store import durable

_PACKAGE = re.compile(r"^#\s*@package\s+(\S+)", re.MULTILINE)
_INTERPOLATION = re.compile(r"\$\{([\w.]+)\}")


@dataclass(frozen=True)
class _Edit:
    """One name in the text, from ``start`` to ``end``, and the one that takes its place."""

    start: int
    end: int
    new: str


def migrate_file(site: Site, path: Path) -> list[tuple[str, str]]:
    """Rewrite a YAML of settings, of a pipeline or of overrides; return each old name with its new one.

    A file in a group of a ``conf`` folder has keys of that group. Raises UsageError for what is no YAML of keys.
    """
    try:
        text = path.read_text(encoding="utf-8")
        load_yaml(text)
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except (OSError, ValueError, yaml.YAMLError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise UsageError(f"--migrate {path}: it cannot be read ({reason}); name a YAML file of settings") from None
    edits = sorted(_edits(node, _prefix(site, path, text)), key=lambda edit: edit.start)
    made, at = "", 0
    for edit in edits:
        made, at = made + text[at : edit.start] + edit.new, edit.end
    if edits:
        durable.write_file(path, (made + text[at:]).encode(), option="--migrate")
    return [(text[edit.start : edit.end], edit.new) for edit in edits]


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
