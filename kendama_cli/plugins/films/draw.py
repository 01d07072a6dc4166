"""Boxes about the ball, drawn in a page: the work of ``camera train FILM`` and of ``camera track`` without boxes."""

from __future__ import annotations

import json
import os
import shlex
import sys
import threading
import time
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from kendama_cli.cli import render
from kendama_cli.errors import KendamaError, UsageError
from kendama_cli.plugins.films.drawn_boxes import DrawnBoxes, drawn_before, film_stills
from kendama_cli.plugins.films.swing_boxes import swing_boxes
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.plugins.shared.web.loopback import (
    NOT_FOUND,
    OWN_FILES,
    Answer,
    Asked,
    Listening,
    LoopbackServer,
    listen,
)

ASSETS = {"boxes.css": "text/css", "boxes.js": "text/javascript"}
STRANGER = "this address has expired or is not complete: open the one that kendama printed last"
FAREWELL_S = 0.5
"""Time for which the page may take its last answer."""


class BoxPage:
    """The page of boxes about a ``thing``; ``write`` writes them and gives the lines that say how to go on."""

    def __init__(
        self,
        listening: Listening,
        boxes: DrawnBoxes,
        about: dict[str, Any],
        write: Callable[[], list[str]],
        thing: str = "ball",
    ) -> None:
        self._boxes, self._about, self._write, self._thing = boxes, about, write, thing.encode()
        self._done = threading.Event()
        self._once = threading.Lock()
        self._lines: list[str] = []
        self._server = LoopbackServer(listening, self._answer, policy=OWN_FILES, stranger=STRANGER, free=("assets",))
        self.address = self._server.address

    def serve(self) -> list[str]:
        """Serve until the person has done; the lines that ``write`` gave. A KeyboardInterrupt goes through."""
        threading.Thread(target=lambda: self._server.serve_forever(0.1), daemon=True).start()
        try:
            while not self._done.wait(0.2):  # a wait without end would keep Ctrl-C
                pass
            time.sleep(FAREWELL_S)
        finally:
            self._server.shutdown()
            self._server.server_close()
        return self._lines

    def _answer(self, asked: Asked) -> Answer:
        head, _, rest = asked.part.partition("/")
        if asked.sent is not None:
            if asked.part == "box":
                return self._take(asked.sent)
            return self._finish() if asked.part == "done" else NOT_FOUND
        if head == "assets" and rest in ASSETS:
            return Answer(200, ASSETS[rest], self._read(rest))
        if head == "frame" and rest.isdecimal() and int(rest) in self._boxes.stills.jpeg:
            return Answer(200, "image/jpeg", self._boxes.stills.jpeg[int(rest)])
        if asked.part == "state":
            return self._state()
        return NOT_FOUND if asked.part else Answer(200, "text/html", self._read("boxes.html"))

    def _state(self) -> Answer:
        document = {**self._about, **self._boxes.document(), "missing": self._boxes.missing(), "lines": self._lines}
        return Answer(200, "application/json", json.dumps(document).encode())

    def _take(self, sent: bytes) -> Answer:
        try:
            message = json.loads(sent)
            box = message["box"]
            self._boxes.put(int(message["frame"]), None if box is None else [float(side) for side in box])
        except (ValueError, KeyError, TypeError) as wrong:
            return Answer(400, "text/plain", f"no box: {wrong}\n".encode())
        return self._state()

    def _finish(self) -> Answer:
        with self._once:
            if (missing := self._boxes.missing()) is not None:
                return Answer(409, "text/plain", f"{missing}\n".encode())
            if not self._done.is_set():
                try:
                    self._lines = self._write()
                except (KendamaError, OSError) as wrong:
                    return Answer(500, "text/plain", f"nothing written: {wrong}\n".encode())
                self._done.set()
            return self._state()

    def _read(self, name: str) -> bytes:
        """Return a file of the page, whose texts name the thing; no other word in it is 'ball'."""
        return (resources.files(__package__) / "page" / name).read_bytes().replace(b"ball", self._thing)


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
