"""``kendama play``: a person plays in the browser, and what is kept are demonstrations."""

from __future__ import annotations

import re
import socket
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import ConfigDir, Home, Overrides
from kendama_cli.config.site import find_site
from kendama_cli.errors import MissingPartError, install_line

if TYPE_CHECKING:
    from kendama_cli.plugins.teleoperation.play.joined import Joining

SECTION = "Teach"
"""Part of ``kendama --help`` in which these commands stand."""

LOOPBACK = ("127.0.0.1", "::1", "localhost")
EVERYWHERE = ("0.0.0.0", "::")


def play(
    overrides: Overrides = None,
    host: Annotated[str, typer.Option(help="Address to listen on; loopback unless you say otherwise.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="TCP port; 0 takes a free one.")] = 0,
    phone: Annotated[
        bool, typer.Option("--phone", help="Let phones in your network join over HTTPS: their sensors carry the cup.")
    ] = False,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open the page in the browser.")] = True,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Play in the browser: swings are simulated, caught and kept, and 'kendama run capture=play' learns from them.

    Example: kendama play
    """
    import webbrowser

    from kendama_cli.config.compose import composed
    from kendama_cli.pipeline.nodes import build_settings
    from kendama_cli.plugins.shared.web.loopback import listen, own_address
    from kendama_cli.plugins.teleoperation.play.capture import doubt_of

    # before all that takes seconds to import
    phones = listen(EVERYWHERE[0] if host in LOOPBACK else host, port) if phone else None
    host, port = (LOOPBACK[0], 0) if phone else (host, port)
    listening = listen(host, port)
    try:
        from kendama_cli.plugins.teleoperation.play.server import Opened, PlayServer  # dartpy, starlette
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in ("starlette", "uvicorn", "websockets"):
            raise
        message = f"'kendama play' needs {error.name}: {install_line('phone' if phone else 'play')}"
        raise MissingPartError(str(error.name), message) from None
    asked = overrides or []
    taker = [] if any(one.startswith("capture=") for one in asked) else ["capture=play"]
    settings = build_settings(composed(find_site(home, config_dir), [*taker, *asked]))
    folder = Path(settings["play"].folder).expanduser().absolute()
    doubt, joining = partial(doubt_of, settings["capture"]), None if phones is None else _joining(phones)
    server = PlayServer(settings["game"], settings["play"], folder, doubt=doubt, tell=render.note, joining=joining)

    def ready(opened: Opened) -> None:
        address = opened.address
        if host in EVERYWHERE:
            address = re.sub(r"//[^/]*:", f"//{own_address()}:", address, count=1)
        render.text(address)
        if host not in LOOPBACK:
            render.note(
                f"open to the network, unencrypted: whoever can reach port {opened.port} of this machine and has the "
                f"address above can play, and see, rename and delete the tries of every player in {folder}"
            )
        if opened.joining:
            render.note(_invitation(opened.joining, opened.code, opened.fingerprint))
        render.note(f"tries are kept in {folder}; Ctrl-C ends the game")
        if show and host in LOOPBACK:
            webbrowser.open(address)

    try:
        server.serve(listening, host, ready)
    except KeyboardInterrupt:  # the way to end it
        render.note("ended; 'kendama run capture=play' goes on with what was kept")


def _invitation(address: str, code: str, fingerprint: str) -> str:
    """Return the lines that say that the network can reach this machine, and how phones do."""
    return (
        f"open to your network on purpose, over HTTPS: phones join at {address}\n{code}"
        "whoever has that address can play, and see, rename and delete all tries; a phone warns of the certificate, "
        f"which this command made for itself (SHA-256 {fingerprint})"
    )


def _joining(listening: socket.socket) -> Joining:
    """Return how phones join; raises MissingPartError where that part or its libraries are not installed."""
    from kendama_cli.plugins.shared.web.loopback import own_address
    from kendama_cli.plugins.teleoperation.play.joined import JOINS, Joining
    from kendama_cli.schema.registry import declared, resolve

    if "phone" not in declared(JOINS):
        raise MissingPartError("phone", "'kendama play --phone' needs the part 'phone', which is not installed")
    try:
        join = resolve(declared(JOINS)["phone"], "'kendama play --phone'")()
    except MissingPartError as error:
        if not isinstance(error.__cause__, ModuleNotFoundError):
            raise
        message = f"'kendama play --phone' needs {error.__cause__.name}: {install_line('phone')}"
        raise MissingPartError(str(error.__cause__.name), message) from None
    return Joining(join, listening, (own_address(), socket.gethostname(), LOOPBACK[0]))
