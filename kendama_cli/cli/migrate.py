"""Work of ``kendama config --migrate`` and ``kendama cache migrate``: old names are rewritten, and told."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.config.migrate import migrate_file
from kendama_cli.config.site import Site
from kendama_cli.schema.units import count_of


def migrate_settings(site: Site, path: Path) -> None:
    """Rewrite a file of settings in its place, and tell each name that changed."""
    changed = migrate_file(site, path)
    for old, new in dict.fromkeys(changed):
        render.text(f"{old} -> {new}")
    render.text(
        f"{path}: {count_of(len(changed), 'name')} rewritten" if changed else f"{path}: it has no name that changed"
    )
