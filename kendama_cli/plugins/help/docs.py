"""``kendama docs``: the pages of docs/ as a site, without a network: bundled with a release, else built here."""

from __future__ import annotations

import importlib
import tempfile
import time
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import Home
from kendama_cli.config.site import bundled_root, find_site
from kendama_cli.errors import KendamaError, MissingPartError, install_line

BUNDLED = "site"
"""Folder of the bundled pages in which a release has them as a site; CONTRIBUTING.md says how it gets there."""


def docs(
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Build into this folder [docs/ in the home folder]."),
    ] = None,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open the first page in the browser.")] = True,
    home: Home = None,
) -> None:
    """Open the documentation as a site; from a checkout, build it first (extra 'docs', no network, about a minute).

    Example: kendama docs
    """
    pages = bundled_root() / "docs"
    first = pages / BUNDLED / "index.html"
    if output is not None:
        with tempfile.TemporaryDirectory() as doctrees:
            first = _built(pages, output, Path(doctrees))
    elif pages.parent.name != "bundled" or not first.is_file():
        from kendama_cli.store.home import claim

        site = find_site(home).home / "docs"
        claim(site.parent)
        first = _built(pages, site, site / ".doctrees")
    render.text(str(first))
    if show:
        webbrowser.open(first.absolute().as_uri())


NEEDED = ("furo", "gymnasium", "myst_parser", "sphinx")
"""Libraries that conf.py and the pages name."""


def _built(pages: Path, site: Path, doctrees: Path) -> Path:
    """Build the site and return the path of its first page."""
    try:
        for name in NEEDED:
            importlib.import_module(name)
        from sphinx.cmd.build import build_main
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in NEEDED:
            raise
        message = f"'kendama docs' needs {error.name}: {install_line('docs')}; the pages lie as text in {pages}"
        raise MissingPartError(str(error.name), message) from None
    try:
        site.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise KendamaError(f"--output {site}: {error.strerror}; name a folder that can be written") from None
    render.note("building the site: about a minute the first time")
    start_s = time.monotonic()
    if build_main(["-q", "-b", "html", "-d", str(doctrees), str(pages), str(site)]):
        raise KendamaError(f"the pages in {pages} could not be built; the lines above say where")
    render.note(f"built in {time.monotonic() - start_s:.0f} s")
    return site / "index.html"
