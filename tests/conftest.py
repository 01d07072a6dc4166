"""Fixtures that every test may use."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import sys
from collections.abc import Generator
from pathlib import Path

import hypothesis
import pytest
import typer.main

from kendama_cli.system.interpreters import one_thread
from tests import alone, first_imports, once
from tests.documented_package import wheel_of
from tests.toy_project import ToyProject

# before any worker imports numpy: threads that wait for each other take twice the computation, and longer
os.environ.update(one_thread())

# a process that writes no bytecode rewrites the asserts of 600 files, as would each of the workers
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# started as a shell's background job, this process ignores Ctrl-C, and so would all that it starts
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # and as a service it ignores the end of its terminal

# how long an example takes says how busy this machine is, and nothing of what is tested
hypothesis.settings.register_profile("suite", deadline=None)
hypothesis.settings.load_profile("suite")

# made from the signatures of all commands, which takes as long as most commands that tests carry out in this process
typer.main.get_command = functools.cache(typer.main.get_command)

LONGEST_FIRST = (
    "test_whole_game.py",
    "faults/test_interruptions.py",
    "plugins/cluster/test_cluster.py",
    "docs/test_commands.py",
    "stages/test_transfer.py",
    "stages/test_adapt.py",
    "plugins/teleoperation/play/test_server.py",
    "plugins/course/test_course_command.py",
    "plugins/calibration/test_setup_commands.py",
    "cli/test_usage.py",
    "config/test_compose.py",
    "plugins/mocap/test_layout.py",
    "report/replay/test_browser.py",
    "plugins/publication/test_video.py",
    "plugins/interact/test_stage.py",
    "plugin/test_documented_parts.py",
    "plugins/calibration/test_board.py",
    "pipeline/test_sweep.py",
    "properties/test_bombs.py",
    "faults/test_one_line.py",
    "faults/test_twin_process.py",
    "pipeline/test_cache.py",
    "plugins/teleoperation/haptic/test_device.py",
    "plugins/help/test_site.py",
    "plugins/course/test_exercises.py",
    "control/test_camera_observer.py",
    "plugins/publication/test_export.py",
    "report/test_page.py",
    "robot_model/placement/test_placement_search.py",
    "plugins/teleoperation/play/test_browser.py",
    "stages/test_predict.py",
    "plugins/identification/test_friction_stage.py",
    "report/test_browser.py",
    "plugins/offline/test_offline.py",
    "plugins/phone/test_live_browser.py",
    "plugins/calibration/test_stereo_calibration.py",
    "pipeline/test_kinds.py",
    "stages/test_placed.py",
    "vision/prediction/test_catch_pose.py",
    "plugins/calibration/test_calibration.py",
    "stages/test_learn.py",
    "faults/test_mutated_inputs.py",
    "plugins/films/test_detect.py",
    "plugins/interact/test_task_world.py",
    "plugins/calibration/test_log_predict.py",
    "pipeline/test_own_stage.py",
    "api/test_examples.py",
    "log/test_writer.py",
    "cli/test_wheel.py",
    "plugins/calibration/test_flight_calibration.py",
    "plugins/cluster/test_shared.py",
)
"""Files of half a minute or so, by their time: begun last, one of them would keep one core busy and the others idle.

While the whole game has the numerical code compiled, the other workers begin with files that need little of it: each
would compile the same once more. The chain of joints is compiled by the search for a placement, long before other files
need it.
"""

RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "data"


def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: for a third of their time tests wait for processes that they started."""
    return (os.cpu_count() or 1) + 2


def pytest_sessionstart(session: pytest.Session) -> None:
    """In a worker, share what is composed; in one of the whole suite, what is compiled too."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        alone.begin()
        once.share_compositions(alone.shared_folder() / "composed")
    whole = [(session.config.rootpath / name).resolve() for name in session.config.args] == [Path(__file__).parent]
    if whole and "PYTEST_XDIST_WORKER" in os.environ:
        first_imports.import_in_turn(alone.shared_folder())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that take longest, end with those of real time in the same order; the others keep theirs."""
    place = {Path(__file__).parent / name: i for i, name in enumerate(LONGEST_FIRST)}
    realtime = {item.path for item in items if item.get_closest_marker("realtime")}
    items.sort(key=lambda item: (item.path in realtime, place.get(item.path, len(place))))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Run tests of real time beside each other only."""
    with alone.turn() if item.get_closest_marker("realtime") else contextlib.nullcontext():
        return (yield)


def pytest_sessionfinish() -> None:
    """Remove the locks of this run's workers; in a worker there are none."""
    alone.forget()


@pytest.fixture
def toy(tmp_path: Path) -> ToyProject:
    """A project with stages and a first configuration file of its own, in an otherwise empty folder."""
    return ToyProject(tmp_path, alone=True)


@pytest.fixture
def toy_beside_ours(tmp_path: Path) -> ToyProject:
    """The same project, whose configuration stands beside all of ours: composing it takes half a second more."""
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


@pytest.fixture(scope="session")
def wheel() -> Path:
    """The wheel of this package, built once for all of pytest's processes."""
    root = Path(__file__).resolve().parents[1]
    return next(once.made_once("wheel", lambda folder: wheel_of(root, folder)).glob("*.whl"))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder that a command is typed in; its home is beneath it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "store"))
    return tmp_path
