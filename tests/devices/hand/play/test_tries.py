"""Tries as files: named, chosen, deleted, shown, and read by capture."""

import dataclasses
import datetime

import numpy as np
import pytest

from kendama_cli.devices.hand.open_hands import open_hands
from kendama_cli.devices.hand.play.settings import PlayCapture
from kendama_cli.devices.hand.play.tries import COLUMNS, TryFolder, plain_name, read_try
from kendama_cli.errors import InputError, UsageError
from kendama_cli.schema.settings import build
from tests.devices.hand.play.table_top import caught_swing
from tests.shipped_conf import plain

NOW = datetime.datetime(2026, 5, 4, 3, 2, 1, tzinfo=datetime.UTC)


@pytest.fixture(scope="module")
def samples():
    return caught_swing()[1]


@pytest.fixture
def folder(tmp_path):
    return TryFolder(tmp_path, "Änna B.", 5)


def test_a_try_is_kept_named_chosen_and_deleted(folder, samples):
    first = folder.keep("caught", "the real game", samples, NOW)
    second = folder.keep("missed", "the real game", samples, NOW + datetime.timedelta(seconds=9))
    assert [one.name for one in folder.tries()] == ["anna-b-001", "anna-b-002"] == [first.name, second.name]
    assert (first.chosen, second.chosen) == (True, False)
    assert np.abs(folder.samples("anna-b-001") - samples).max() < 1e-5
    folder.choose("anna-b-002", chosen=True)
    assert folder.rename("anna-b-001", "The best!") == "anna-b-the-best"
    assert [(one.name, one.chosen) for one in folder.tries()] == [("anna-b-the-best", True), ("anna-b-002", True)]
    folder.delete("anna-b-the-best")
    assert [one.name for one in folder.tries()] == ["anna-b-002"]
    assert folder.keep("missed", "", samples, NOW).name == "anna-b-003"


def test_nothing_is_overwritten_and_no_other_file_is_touched(folder, samples):
    for _ in range(2):
        folder.keep("caught", "", samples, NOW)
    with pytest.raises(UsageError, match="there is a try 'anna-b-002' already"):
        folder.rename("anna-b-001", "002")
    (folder.path / "notes.csv").write_text("mine\n")
    for wrong in ("notes", "../x", "", "anna-b-009"):
        with pytest.raises(UsageError, match="there is no try"):
            folder.delete(wrong)
    assert (folder.path / "notes.csv").exists()
    assert read_try(folder.path / "notes.csv") is None


def test_a_full_folder_says_so(folder, samples):
    for _ in range(5):
        folder.keep("missed", "", samples, NOW)
    with pytest.raises(UsageError, match="holds 5 tries, as many as it may: delete some"):
        folder.keep("missed", "", samples, NOW)


def test_a_file_changed_by_others_is_told(folder, samples):
    folder.keep("caught", "", samples, NOW)
    file = folder.path / "anna-b-001.csv"
    file.write_text(file.read_text() + "x,y\n")
    with pytest.raises(UsageError, match="has been changed"):
        folder.samples("anna-b-001")


@pytest.mark.parametrize("name", ["", "!?", "日本"])
def test_a_name_without_letters_is_refused(name):
    with pytest.raises(UsageError, match="has no letter or digit"):
        plain_name(name)


def capture(*paths, take="chosen"):
    usual, own = plain("capture", "file"), plain("capture", "play")
    below = {key: {**usual[key], **own[key]} for key in ("plausible", "rotation")}  # as Hydra merges them
    settings = build(PlayCapture, own | below | {"path": [str(path) for path in paths]})
    return open_hands(dataclasses.replace(settings, take=take))


def test_capture_takes_what_was_chosen(folder, samples):
    folder.keep("caught", "", samples, NOW)
    folder.keep("missed", "", samples, NOW)
    (folder.path / "notes.csv").write_text("mine\n")
    files = sorted(folder.path.glob("*.csv"))
    assert [hand.name for hand in capture(*files)] == ["anna-b-001"]
    assert [hand.name for hand in capture(*files, take="all")] == ["anna-b-001", "anna-b-002"]
    read = list(capture(*files)[0].samples())
    assert np.abs(np.array([one.rotation_wxyz for one in read]) - samples[:, 4:8]).max() < 1e-5
    assert read[-1].t_s == pytest.approx(samples[-1, 0], abs=1e-5)
    assert np.abs([one.position_m for one in read] - samples[:, 1:4]).max() < 1e-5
    assert COLUMNS[:4] == ("t_s", "x_m", "y_m", "z_m")


def test_capture_says_what_to_do_where_nothing_was_caught(folder, samples):
    folder.keep("missed", "", samples, NOW)
    with pytest.raises(InputError, match=r"1 tries, none of them chosen; catch the ball in 'kendama play'"):
        capture(*folder.path.glob("*.csv"))
