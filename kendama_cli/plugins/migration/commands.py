"""``kendama cache migrate``, and the work of ``kendama config --migrate``."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.cli.options import Home
from kendama_cli.config.site import Site, find_site
from kendama_cli.schema.units import count_of


def cache_migrate(home: Home = None) -> None:
    """Rewrite a home of an older version by today's names; every recording and run is kept.

    Example: kendama cache migrate
    """
    from kendama_cli.plugins.migration.home import migrate_home  # noqa: PLC0415 - MCAP
    from kendama_cli.store.store import Store  # noqa: PLC0415

    place = find_site(home).home
    done = migrate_home(Store(place))
    render.text(f"{place}: {done.results} results ({done.recordings} recordings) and {done.runs} runs rewritten")


def migrate_settings(site: Site, path: Path) -> None:
    """Rewrite a file of settings in its place, and tell each name that changed."""
    from kendama_cli.plugins.migration.renamed_text import migrate_file  # noqa: PLC0415 - YAML

    changed = migrate_file(site, path)
    for old, new in dict.fromkeys(changed):
        render.text(f"{old} -> {new}")
    told = f"{count_of(len(changed), 'name')} rewritten" if changed else "it has no name that changed"
    render.text(f"{path}: {told}")
