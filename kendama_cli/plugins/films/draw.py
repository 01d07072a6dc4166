"""Boxes about the ball, drawn in a page: the work of ``camera train FILM``."""

from __future__ import annotations

import shlex
import threading
import webbrowser
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.devices.camera.video import VideoFile
from kendama_cli.errors import UsageError
from kendama_cli.plugins.films.box_page import BoxPage
from kendama_cli.plugins.films.drawn_boxes import DrawnBoxes, drawn_before
from kendama_cli.plugins.films.film_stills import film_stills
from kendama_cli.system.listening import listen


@dataclass(frozen=True)
class PageOptions:
    """``port`` 0 takes a free one; ``show``: whether the browser is opened."""

    port: int
    show: bool


def draw_boxes(path: Path, folder: Path, options: PageOptions) -> None:
    """Serve a page on which boxes are drawn into stills of the film, and write them; Ctrl-C ends it with none written.

    Raises UsageError or InputError where the port is taken, or film or folder cannot serve.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"-o {folder}: it is a file; the boxes of a film are written into a folder")
    film = VideoFile(path)
    listening = listen("127.0.0.1", options.port)
    render.note(f"{path}: reading its frames")
    before = drawn_before(film, folder)
    boxes = DrawnBoxes(film_stills(film, before), before)

    def write() -> list[str]:
        images, drawn = boxes.write(film, folder)
        without = images - drawn
        command = f"kendama camera track {shlex.quote(str(path))} --train {shlex.quote(str(folder))}"
        return [
            f"{folder}: {drawn} boxes" + (f", and {without} images without the ball" if without else ""),
            f"{command} -o {shlex.quote(path.stem + '.csv')}",
        ]

    page = BoxPage(listening, boxes, {"film": path.name, "folder": str(folder)}, write)
    render.text(page.address)
    render.note("draw boxes about the ball on that page; Ctrl-C ends without writing any")
    if options.show:  # a browser that does not return must not keep the page
        threading.Thread(target=webbrowser.open, args=(page.address,), daemon=True).start()
    try:
        lines = page.serve()
    except KeyboardInterrupt:
        render.note("ended; nothing was written")
        return
    for line in lines:
        render.text(line)
