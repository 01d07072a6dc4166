"""kendama run --watch: a page on loopback that says how far the run is, from its log as it is written."""

from __future__ import annotations

import json
import re
import socket
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.cli.progress import PlainLines
from kendama_cli.pipeline.context import WorkerContext
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.plugins.shared.web.loopback import listen
from kendama_cli.plugins.watch.drawing import Drawing
from kendama_cli.plugins.watch.server import LivePage
from kendama_cli.plugins.watch.status import RunStatus
from kendama_cli.report.figure import Figure, Panel
from kendama_cli.report.source import StageLog
from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.store.checkpoint import CheckpointFolder
from kendama_cli.store.store import Store
from tests.chromium import CHROMIUM, browser
from tests.toy_project import ToyProject, artifact_bytes


@dataclass(frozen=True)
class NumberMessage:
    value: float


@dataclass(frozen=True)
class DiceSettings:
    sides: int


def figures(log: StageLog) -> list[Figure]:
    """The chapter of the stage below."""
    shown = f"{len(log.table('/dice/number', NumberMessage))} numbers, {log.setting('sides'):.0f} sides"
    return [Figure("What was thrown.", (Panel("Numbers", shown),))]


TOPICS = {"/dice/number": NumberMessage}
DICE = StageDeclaration("dice", "Thrown dice", "", "", "", {}, TOPICS, chapter="tests.plugins.watch.test_watch:figures")


class Running:
    """A stage that runs in this process, as far as a test lets it, and the page of its run."""

    def __init__(self, home: Path) -> None:
        store = Store(home)
        pipeline = SimpleNamespace(stages=[SimpleNamespace(name="dice", declaration=DICE)])
        settings = {"dice": {"toy": DiceSettings(6)}}
        self.record = RunRecord(home, "00007-abcdef", "games", ["seed=3"], "today")
        self.planner = cast(Any, SimpleNamespace(store=store, pipeline=pipeline, settings=settings))
        self.status = RunStatus(self.record, cast(Any, pipeline), PlainLines(), lambda: None)
        folder = CheckpointFolder(store.checkpoint_folder("dice", "key"))
        self.stage = WorkerContext(seed=1, checkpoints=folder, topics=TOPICS, emit=self._heard)
        self._thrown = 0

    def throw(self, count: int) -> None:
        """Log ``count`` numbers and save a checkpoint."""
        for _ in range(count):
            self._thrown += 1
            self.stage.log.write("/dice/number", 0.1 * self._thrown, NumberMessage(3.0))
        self.stage.checkpoint(lambda: {"thrown": np.array(self._thrown)}, force=True)
        self.stage.progress(self._thrown, self._thrown, last_m=3.0)

    def _heard(self, event: Any) -> None:
        self.status.stage_progress("dice", event["done"], 20, event["figures"])


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    made = Running(tmp_path)
    made.status.stage_starts("dice", "key", ("never ran",))
    yield made
    made.stage.close()


def got(address: str) -> str:
    with urllib.request.urlopen(address, timeout=60) as answer:
        assert answer.headers["Cache-Control"] == "no-store"
        assert "frame-ancestors 'self'" in answer.headers["Content-Security-Policy"]
        return str(answer.read().decode())


def test_the_chapter_is_drawn_from_the_log_as_it_grows(running: Running) -> None:
    drawing = Drawing(running.status, running.planner)
    drawing.draw()
    assert drawing.pages["chapters"].number == 0, "there is no checkpoint yet"
    for count, shown in ((5, "5 numbers, 6 sides"), (30000, "30005 numbers, 6 sides")):
        running.throw(count)
        drawing.draw()
        assert shown in drawing.pages["chapters"].page.decode()
    drawing.draw()
    assert drawing.pages["chapters"].number == 2, "nothing is drawn again where the log has no more"


def test_the_page_says_how_far_the_stages_are(running: Running) -> None:
    running.throw(4)
    (stage,) = running.status.document()["stages"]
    assert (stage["title"], stage["state"], stage["done"], stage["total"]) == ("Thrown dice", "runs", 4, 20)
    assert stage["figures"] == [["last", "3 m"]]
    running.status.stage_ends(StageOutcome("dice", "dice", "key", "failed", 1.5, None, {}, "the die is lost"))
    (stage,) = running.status.document()["stages"]
    assert (stage["state"], stage["note"], stage["seconds"]) == ("failed", "the die is lost", 1.5)


def test_only_who_has_the_token_is_served_and_the_last_state_is_waited_for(running: Running) -> None:
    listening = listen("127.0.0.1", 0)
    page = LivePage(listening, running.status, running.planner)
    base, token = page.address.split("?token=")
    with page:
        for wrong, code in (
            (f"{base}state", 403),
            (f"{base}?token={token[:-1]}", 403),
            (f"{base}x?token={token}", 404),
        ):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(wrong, timeout=60)
            assert refused.value.code == code
        framed = got(page.address)
        assert "default-src 'none'; script-src 'sha256-" in framed
        assert "connect-src 'self'; frame-src 'self'" in framed
        state = json.loads(got(f"{base}state?token={token}"))
        assert (state["run"], state["overrides"], state["outcome"]) == ("00007-abcdef", ["seed=3"], "running")
        assert got(f"{base}state?token={token}&seen={state['version']}") == "", "nothing new"
        running.record.outcome = "done"
    assert running.status.document()["outcome"] == "done"
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(page.address, timeout=60)


@pytest.mark.skipif(CHROMIUM is None, reason="needs the program chromium (Debian: apt-get install chromium)")
def test_a_browser_shows_what_is_logged_while_the_run_continues(running: Running, tmp_path: Path) -> None:
    shown = "(document.querySelector('[data-part=chapters] iframe')?.contentDocument?.body?.textContent ?? '')"
    with browser(tmp_path / "profile") as chromium:
        with LivePage(listen("127.0.0.1", 0), running.status, running.planner) as page:
            tab = chromium.open(page.address)
            tab.value("window.sameOne = true")
            for count, total in ((5, 5), (7, 12)):
                running.throw(count)
                tab.wait(f"{shown}.includes('{total} numbers, 6 sides')")
                tab.wait(f"document.querySelector('.stages tbody').textContent.includes('{total} of 20')")
            assert tab.value("document.querySelectorAll('[data-part=chapters] iframe').length") == 1
            running.record.outcome = "done"
        tab.wait("document.querySelector('.notice').textContent.includes('kendama report 00007-abcdef')")
        assert tab.value("document.title") == "kendama: the run is done"
        assert tab.value("window.sameOne"), "it was loaded again"
        assert tab.said == []


def test_a_run_is_the_same_with_its_page_and_reports_the_address(toy: ToyProject, tmp_path: Path) -> None:
    done = toy.kendama("run", "-p", "toy", "--json", "--watch", "--no-show")
    assert re.search(r"^watch the run: http://127\.0\.0\.1:\d+/\?token=\S{20,}$", done.stderr, re.MULTILINE)
    alone = ToyProject(tmp_path / "alone", alone=True).run_json()
    assert artifact_bytes(json.loads(done.stdout)) == artifact_bytes(alone)
    assert "http" not in toy.kendama("run", "-p", "toy", "--watch", "--no-show").stderr, "there is nothing to compute"


def test_a_taken_port_is_one_line(toy: ToyProject) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = toy.kendama("run", "-p", "toy", "--watch", "--port", str(port), expect=2)
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"kendama: cannot listen on 127.0.0.1:{port} (")
    assert line.endswith("choose another --port, or 0 for a free one")
