"""Fixtures that every test may use."""

from __future__ import annotations

import signal
from collections.abc import Generator
from pathlib import Path

import pytest

from tests import alone
from tests.toy_project import ToyProject

# started as a shell's background job, this process ignores Ctrl-C, and so would all that it starts
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # and as a service it ignores the end of its terminal

LONGEST_FIRST = (
    "test_whole_game.py",
    "stages/test_transfer.py",
    "stages/test_adapt.py",
    "stages/test_identify.py",
    "stages/test_interact.py",
    "simulation/placement/test_placement_search.py",
    "pipeline/test_unchanged.py",
    "pipeline/test_sweep.py",
    "faults/test_interruptions.py",
    "cli/test_usage.py",
    "pipeline/test_cache.py",
    "pipeline/test_own_stage.py",
    "docs/test_commands.py",
    "cli/test_camera_seeing.py",
    "cli/test_camera.py",
    "config/test_composition_index.py",
    "report/test_browser.py",
    "report/test_page.py",
    "cli/test_place.py",
    "plugin/test_documented_parts.py",
    "plugin/test_wheel_of_parts.py",
    "game/test_games.py",
    "game/test_state_prediction.py",
    "cli/test_robot_twin.py",
)
"""Files of a minute or so each, by their time: begun last, one of them would keep one core busy and the others idle."""

RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "data"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take longest, end with those whose tests run alone; the others keep their order."""
    place = {Path(__file__).parent / name: i for i, name in enumerate(LONGEST_FIRST)}
    place.update({item.path: len(place) + 1 for item in items if item.get_closest_marker("realtime")})
    middle = len(LONGEST_FIRST)
    items.sort(key=lambda item: place.get(item.path, middle))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Run tests of real time alone."""
    with alone.turn(alone=item.get_closest_marker("realtime") is not None):
        return (yield)


def pytest_sessionfinish() -> None:
    """Remove the locks of this run's workers; in a worker there are none."""
    alone.forget()


@pytest.fixture
def toy(tmp_path: Path) -> ToyProject:
    """A project with stages of its own, in an otherwise empty folder."""
    return ToyProject(tmp_path)


@pytest.fixture(params=["0", "1"], ids=["linux", "portable"])
def each_way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Locks and processes by Linux's own means and by the portable ones, in turn; whether they are portable."""
    monkeypatch.setenv("KENDAMA_PORTABLE", request.param)
    return bool(request.param == "1")


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings beside the repository; the test is skipped where it is absent."""
    if not RECORDINGS.is_dir():
        pytest.skip(f"real recordings are not at {RECORDINGS}")
    return RECORDINGS
