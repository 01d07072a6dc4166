"""Boxes about the ball, drawn in a page: the work of ``camera train FILM`` and of ``camera track`` without boxes."""

from __future__ import annotations

import os
import shlex
import sys
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.errors import UsageError
from kendama_cli.plugins.films.box_page import BoxPage
from kendama_cli.plugins.films.drawn_boxes import DrawnBoxes, drawn_before
from kendama_cli.plugins.films.film_stills import film_stills
from kendama_cli.plugins.films.swing_boxes import swing_boxes
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.plugins.shared.web.listening import listen


@dataclass(frozen=True)
class PageOptions:
    """``port`` 0 takes a free one; ``show``: whether the browser is opened."""

    port: int
    show: bool


def draw_boxes(path: Path, folder: Path, options: PageOptions) -> None:
    """Serve a page on which boxes are drawn into stills of the film, and write them; Ctrl-C ends it with none written.

    Raises UsageError or InputError where the port is taken, or film or folder cannot serve.
    """
    command = f"kendama camera track {shlex.quote(str(path))} --train {shlex.quote(str(folder))}"
    try:
        _serve(path, folder, options, [f"{command} -o {shlex.quote(path.stem + '.csv')}"], render.text)
    except KeyboardInterrupt:
        render.note("ended; nothing was written")


def draw_ball_and_cup(path: Path, options: PageOptions) -> None:
    """Serve the page for the ball, then for the cup, and write their boxes beside the film, where capture=video finds
    them; Ctrl-C leaves what is written.

    Raises what ``draw_boxes`` raises.
    """
    try:
        for thing, folder in swing_boxes(path).items():
            run = [f"kendama run -p imitation capture=video capture.path={shlex.quote(str(path))}"]
            _serve(path, folder, options, run if thing == "cup" else [], render.text, thing)
    except KeyboardInterrupt:
        render.note("ended; the boxes of this page were not written")


def boxes_folder(path: Path) -> Path:
    """Return the folder for the boxes of a film for which none is named."""
    return Path(f"{path.stem}-boxes")


def boxes_for_track(path: Path) -> Path | None:
    """Return the folder of the boxes that somebody draws now; None without a terminal, or a browser that shows pages.

    Raises what ``draw_boxes`` raises, and KeyboardInterrupt with none written.
    """
    here = sys.platform in ("darwin", "win32") and "SSH_CONNECTION" not in os.environ
    if not (here or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))):
        return None  # Python would find a browser of text
    try:
        webbrowser.get()
    except webbrowser.Error:
        return None
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return None
    folder = boxes_folder(path)
    _serve(path, folder, PageOptions(0, show=True), [], render.note)  # stdout is the track's, as for --json
    return folder


def _serve(  # noqa: PLR0917 - what is drawn where, and what is said of it
    path: Path, folder: Path, options: PageOptions, then: list[str], say: Callable[[str], None], thing: str = "ball"
) -> None:
    """Serve the page until the boxes about the ``thing`` are written; its last lines, with ``then``, go to ``say``."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: it is a file; the boxes of a film are written into a folder")
    film = VideoFile(path)
    listening = listen("127.0.0.1", options.port)
    render.note(f"{path}: reading its frames")
    before = drawn_before(film, folder)
    boxes = DrawnBoxes(film_stills(film, before), before)

    def write() -> list[str]:
        images, drawn = boxes.write(film, folder)
        without = images - drawn
        return [f"{folder}: {drawn} boxes" + (f", and {without} images without the {thing}" if without else ""), *then]

    page = BoxPage(listening, boxes, {"film": path.name, "folder": str(folder)}, write, thing)
    say(page.address)
    render.note(f"draw boxes about the {thing} on that page; Ctrl-C ends without writing any")
    if options.show:  # a browser that does not return must not keep the page
        threading.Thread(target=webbrowser.open, args=(page.address,), daemon=True).start()
    for line in page.serve():
        say(line)
