"""Tries as files: named, chosen, deleted, shown, and read by capture."""

import dataclasses
import datetime
import os
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import InputError, UsageError
from kendama_cli.plugins.teleoperation.play.capture import doubt_of
from kendama_cli.plugins.teleoperation.play.settings import PlayCapture
from kendama_cli.plugins.teleoperation.play.tries import COLUMNS, Try, TryFolder, check_folder, plain_name, read_try
from kendama_cli.schema.settings import build
from tests.plugins.teleoperation.play.table_top import caught_swing
from tests.shipped_conf import plain

NOW = datetime.datetime(2026, 5, 4, 3, 2, 1, tzinfo=datetime.UTC)


@pytest.fixture(scope="module")
def samples():
    return caught_swing()[1]


@pytest.fixture
def folder(tmp_path):
    return TryFolder(tmp_path, "Änna B.", 5, lambda file: doubt_of(settings(), file))


def settings(*paths, take="chosen"):
    usual, own = plain("capture", "file"), plain("capture", "play")
    below = {key: {**usual[key], **own[key]} for key in ("plausible", "rotation")}  # as Hydra merges them
    made = build(PlayCapture, own | below | ({"path": [str(path) for path in paths]} if paths else {}))
    return dataclasses.replace(made, take=take)


def keep(folder, outcome, conditions, samples, now, *, note=""):
    began = now.isoformat(timespec="milliseconds")
    return folder.keep(Try("", outcome, False, began, float(samples[-1, 0]), conditions, note), samples)


def test_a_try_is_kept_named_chosen_and_deleted(folder, samples):
    first = keep(folder, "caught", "the real game", samples, NOW)
    second = keep(folder, "missed", "the real game", samples, NOW + datetime.timedelta(seconds=9))
    assert [one.name for one in folder.tries()] == ["anna-b-001", "anna-b-002"] == [first.name, second.name]
    assert (first.chosen, second.chosen) == (True, False)
    assert np.abs(folder.samples("anna-b-001") - samples).max() < 1e-5
    folder.choose("anna-b-002", chosen=True)
    assert folder.rename("anna-b-001", "The best!") == "anna-b-the-best"
    assert [(one.name, one.chosen) for one in folder.tries()] == [("anna-b-the-best", True), ("anna-b-002", True)]
    folder.delete("anna-b-the-best")
    assert [one.name for one in folder.tries()] == ["anna-b-002"]
    assert keep(folder, "missed", "", samples, NOW).name == "anna-b-003"


def test_nothing_is_overwritten_and_no_other_file_is_touched(folder, samples):
    for _ in range(2):
        keep(folder, "caught", "", samples, NOW)
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
        keep(folder, "missed", "", samples, NOW)
    with pytest.raises(UsageError, match="holds 5 tries, as many as it may: delete some"):
        keep(folder, "missed", "", samples, NOW)


def test_a_file_changed_by_others_is_told(folder, samples):
    keep(folder, "caught", "", samples, NOW)
    file = folder.path / "anna-b-001.csv"
    file.write_text(file.read_text() + "x,y\n")
    with pytest.raises(UsageError, match="has been changed"):
        folder.samples("anna-b-001")


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("日本", "日本"),
        ("Анна Б.", "анна-б"),
        ("हिन्दी", "हिन्दी"),
        ("محمد", "محمد"),
        ("Søren", "søren"),
        ("Ärzte/..", "arzte"),
        ("ก้อง", "ก้อง"),
        ("한글", "한글"),
        ("٣", "٣"),
        ("../../etc", "etc"),
        ("a\u202eb\ud800c\0d", "a-b-c-d"),
        ("字" * 60, "字" * 26),
    ],
)
def test_a_name_in_any_script_is_a_name_of_files(name, plain, tmp_path, samples):
    assert plain_name(name) == plain_name(plain) == plain
    folder = TryFolder(tmp_path, name, 5, lambda _: None)
    kept = keep(folder, "caught", "", samples, NOW)
    assert folder.rename(kept.name, "字" * 60) == f"{plain}-{'字' * 26}"
    folder.choose(f"{plain}-{'字' * 26}", chosen=False)
    assert [one.chosen for one in folder.tries()] == [False]
    assert folder.path.parent == tmp_path


@pytest.mark.parametrize("name", ["", "!?", "\ud800", "🎉", "\u0301"])
def test_a_name_without_letters_is_refused(name):
    with pytest.raises(UsageError, match="has no letter or digit"):
        plain_name(name)


def capture(*paths, take="chosen"):
    return open_demonstrators(settings(*paths, take=take))


def test_capture_takes_what_was_chosen(folder, samples):
    keep(folder, "caught", "", samples, NOW)
    keep(folder, "missed", "", samples, NOW)
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
    keep(folder, "missed", "", samples, NOW)
    with pytest.raises(InputError, match=r"tries: 1, none of them chosen; catch the ball in 'kendama play'"):
        capture(*folder.path.glob("*.csv"))


def jumping(samples):
    """A swing during which the cup is 0.3 m elsewhere for a sample."""
    made = samples.copy()
    made[len(made) // 2, 1] += 0.3
    return made


def test_a_caught_try_that_capture_would_refuse_is_not_marked_for_the_robot_and_says_why(folder, samples):
    made = keep(folder, "caught", "", jumping(samples), NOW)
    assert not made.chosen
    assert made.note.startswith("not for the robot: line ")
    assert [one.note for one in folder.tries()] == [made.note]
    with pytest.raises(UsageError, match=r"'anna-b-001' is not for the robot: .* jumps by 0\.3"):
        folder.choose("anna-b-001", chosen=True)
    with pytest.raises(InputError, match=r"anna-b-001\.csv.*jumps by"):  # and so says capture
        capture(*folder.path.glob("*.csv"), take="all")


def test_one_bad_try_is_left_out_aloud_and_the_others_are_taken(folder, samples):
    for _ in range(3):
        keep(folder, "caught", "", samples, NOW)
    files = sorted(folder.path.glob("*.csv"))
    lines = files[0].read_text().splitlines()
    files[0].write_text("\n".join(lines[:100]) + "\n1.0,half a ro")
    hands = capture(*files)
    assert [hand.name for hand in hands] == ["anna-b-002", "anna-b-003"]
    assert len(hands[0].warnings) == 1
    assert f"left out: {files[0]}, line 101" in hands[0].warnings[0]


def test_why_a_try_was_interrupted_is_kept_with_it(folder, samples):
    keep(folder, "interrupted", "the real game", samples, NOW, note="the page\nwas closed")
    folder.rename("anna-b-001", "2")
    folder.choose("anna-b-2", chosen=True)
    assert [(one.note, one.chosen) for one in folder.tries()] == [("the page was closed", True)]
    assert np.abs(folder.samples("anna-b-2") - samples).max() < 1e-5


def test_a_try_of_the_version_before_is_read(folder, samples):
    keep(folder, "caught", "the real game", samples, NOW)
    file = folder.path / "anna-b-001.csv"
    file.write_text(file.read_text().replace("# origin: person\n", ""))
    assert file.read_text().splitlines()[6].startswith("t_s,")  # title, five facts, names: as version 0.2.0 wrote it
    assert len(folder.samples("anna-b-001")) == len(samples)
    assert folder.tries()[0].chosen


def test_a_folder_that_cannot_hold_tries_is_told_before_the_first(tmp_path, folder, samples):
    check_folder(tmp_path / "new" / "plays")
    assert list((tmp_path / "new" / "plays").iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match=r"cannot be kept in .*file/plays: Not a directory; make it writable, or set"):
        check_folder(tmp_path / "file" / "plays")
    with pytest.raises(UsageError, match=r"tries cannot be kept in /proc/plays"):
        check_folder(Path("/proc/plays"))
    folder.check()
    for _ in range(5):
        keep(folder, "missed", "", samples, NOW)
    with pytest.raises(UsageError, match="holds 5 tries"):
        folder.check()


def test_a_pipe_among_the_tries_is_not_waited_for(folder, samples):
    keep(folder, "missed", "", samples, NOW)
    os.mkfifo(folder.path / "pipe.csv")
    assert len(folder.tries()) == 1
