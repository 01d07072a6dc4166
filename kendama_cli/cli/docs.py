"""``kendama docs``: the pages of docs/ as a site, built on this machine, without a network."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import Home
from kendama_cli.config.site import bundled_root, find_site
from kendama_cli.errors import KendamaError, MissingPartError, install_line


def docs(
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Folder to build in [docs/ in the home folder]."),
    ] = None,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open the first page in the browser.")] = True,
    home: Home = None,
) -> None:
    """Build the documentation as a site and open it; needs the extra 'docs', and no network."""
    import webbrowser

    pages = bundled_root() / "docs"
    try:
        import furo  # noqa: F401 - what conf.py names
        import myst_parser  # noqa: F401
        from sphinx.cmd.build import build_main
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("furo", "myst_parser", "sphinx"):
            raise
        message = f"'kendama docs' needs {error.name}: {install_line('docs')}; the pages lie as text in {pages}"
        raise MissingPartError(str(error.name), message) from None
    if output is None:
        from kendama_cli.store.home import claim

        output = find_site(home).home / "docs"
        claim(output.parent)
    site = output
    try:
        site.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise KendamaError(f"--output {site}: {error.strerror}; name a folder that can be written") from None
    if build_main(["-q", "-b", "html", "-d", str(site / ".doctrees"), str(pages), str(site)]):
        raise KendamaError(f"the pages in {pages} could not be built; the lines above say where")
    first = site / "index.html"
    render.text(str(first))
    if show:
        webbrowser.open(first.absolute().as_uri())
