"""Output files of commands: an unusable one is refused in one line before any film is read."""

import os
from pathlib import Path

import pytest

from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.errors import StoreError, UsageError
from tests.cli.typed import refused

TRACK = ["camera", "track", "nowhere.mp4"]
"""Were the film looked at first, its error would be told."""


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([*TRACK, "-o", "folder"], "-o folder: it is a folder; name a file in it, such as folder/output.csv"),
        ([*TRACK, "-o", "file/track.csv"], "-o file/track.csv: file is no folder; name another one"),
        ([*TRACK, "-o", "track.xls"], "a track is a CSV; name it track.csv"),
        ([*TRACK, "--overlay", "seen.avi"], "--overlay seen.avi: it is written as WebM; name it seen.webm"),
        (
            [*TRACK, "--overlay", "file/in/seen.webm"],
            "--overlay file/in/seen.webm: file is no folder; name another one",
        ),
        (["camera", "detect", "nowhere", "-o", "file/found.csv"], "-o file/found.csv: file is no folder"),
        (["camera", "calibrate", "nowhere", "-o", "file/c.yaml"], "file is no folder"),
        (["camera", "marker", "-o", "file/marker.pdf"], "file is no folder"),
        (["camera", "brightness", "-o", "file/seen.csv"], "file is no folder"),
        (["camera", "latency", "no.csv", "no.csv", "-o", "file/setup.yaml"], "file is no folder"),
        (["log", "layout", "no.mcap", "-o", "file/all.json"], "file is no folder"),
        (["camera", "detect", "nowhere", "-o", "found.json"], "sightings are a CSV; name it found.csv"),
        (["camera", "train", "folder", "-o", "ball.json"], "a trained ball is a NumPy archive; name it ball.npz"),
        (["camera", "calibrate", "nowhere", "-o", "c.json"], "a calibration is YAML; name it c.yaml"),
        (["camera", "colour", "no.png@1,2", "--radius-px", "5", "-o", "c.txt"], "a learned colour is JSON"),
        (["camera", "board", "-o", "board.jpg"], "a board is a PDF or a PNG; name it board.pdf or board.png"),
        (["camera", "blink", "-o", "blink.txt"], "a page is HTML; name it blink.html"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_first(here, capsys, words, message):
    (here / "folder").mkdir()
    (here / "file").write_text("")
    line = refused(capsys, *words)
    assert message in line
    assert "--home" not in line
    assert sorted(path.name for path in here.iterdir()) == ["file", "folder"]


def test_folders_that_are_not_there_are_made_when_the_file_is_written(tmp_path):
    output = tmp_path / "some" / "where" / "track.csv"
    refuse_output(output, "a track is a CSV", ".csv")
    assert not list(tmp_path.iterdir())
    write_output(output, b"t_s")
    assert output.read_bytes() == b"t_s"


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="no folder here takes no file whoever asks")
def test_a_folder_that_takes_no_file_is_told():
    with pytest.raises(UsageError, match=r"-o /proc/track.csv: the folder /proc takes no file \(.+\); name another"):
        refuse_output(Path("/proc/track.csv"))


def test_a_full_disk_names_the_option_that_was_meant(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(StoreError, match=r"the disk is full; free some space or choose another folder with -o$"):
        write_output(tmp_path / "track.csv", b"t_s")
