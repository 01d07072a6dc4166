"""The file of configuration in which a value stands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from kendama_cli.config.site import Site
from kendama_cli.schema.plain_yaml import load_yaml


def file_of(site: Site, key: str, value: Any) -> Path | None:
    """Return the file that gives ``key`` its ``value`` in the default configuration; None if it is not found.

    The files of the default choices come first, then the others of the same groups.
    """
    for path, inside in _candidates(site, key.split(".")):
        node: Any = _content(path)
        for part in inside:
            node = node.get(part) if isinstance(node, Mapping) else None
        if node == value and inside:
            return path
    return None


def _candidates(site: Site, parts: list[str]) -> Iterator[tuple[Path, list[str]]]:
    for depth in range(len(parts) - 1, -1, -1):
        for folder in site.conf_folders:
            group = folder.joinpath(*parts[:depth])
            files = [folder / "config.yaml"] if not depth else sorted(group.glob("*.yaml"))
            chosen = _chosen(folder, parts[:depth])
            for path in sorted(files, key=lambda path: path.stem != chosen):
                yield path, parts[depth:]


def _chosen(folder: Path, group: list[str]) -> str | None:
    """Return the choice of ``group`` in the lists of defaults above it."""
    for depth in range(len(group)):
        for path in sorted(folder.joinpath(*group[:depth]).glob("*.yaml")):
            for entry in _content(path).get("defaults", ()):
                if isinstance(entry, Mapping) and (name := entry.get("/".join(group[depth:]))):
                    return str(name)
    return None


def _content(path: Path) -> Mapping[str, Any]:
    try:
        found = load_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, Mapping) else {}
