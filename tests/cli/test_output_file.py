"""Where a command is to write: refused in one line before any film is read."""

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
        ([*TRACK, "-o", "none/track.csv"], "-o none/track.csv: there is no folder none; make it, or name another one"),
        ([*TRACK, "-o", "folder"], "-o folder: it is a folder; name a file in it, such as folder/output.csv"),
        ([*TRACK, "-o", "file/track.csv"], "-o file/track.csv: file is no folder; name a folder that is there"),
        ([*TRACK, "-o", "track.xls"], "a track is a CSV or an MCAP log; name it track.csv or track.mcap"),
        ([*TRACK, "--overlay", "seen.avi"], "--overlay seen.avi: it is written as WebM; name it seen.webm"),
        ([*TRACK, "--overlay", "none/seen.webm"], "--overlay none/seen.webm: there is no folder none"),
        ([*TRACK, "--calibration", "c.yaml", "--readout", "none/r.yaml"], "--readout none/r.yaml: there is no folder"),
        ([*TRACK, "--calibration", "c.yaml", "--readout", "r.txt"], "a calibration is YAML; name it r.yaml"),
        (["camera", "detect", "nowhere", "-o", "none/found.csv"], "-o none/found.csv: there is no folder none"),
        (["camera", "detect", "nowhere", "-o", "found.json"], "sightings are a CSV; name it found.csv"),
        (["camera", "teach", "folder", "-o", "ball.json"], "a taught ball is a NumPy archive; name it ball.npz"),
        (["camera", "calibrate", "nowhere", "-o", "none/c.yaml"], "there is no folder none"),
        (["camera", "calibrate", "nowhere", "-o", "c.json"], "a calibration is YAML; name it c.yaml"),
        (["camera", "colour", "no.png@1,2", "--radius-px", "5", "-o", "c.txt"], "a learned colour is JSON"),
        (["camera", "board", "-o", "board.jpg"], "a picture is a PNG; name it board.png"),
        (["camera", "marker", "-o", "none/marker.pdf"], "there is no folder none"),
        (["camera", "blink", "-o", "blink.txt"], "a page is HTML; name it blink.html"),
        (["camera", "brightness", "-o", "none/seen.csv"], "there is no folder none"),
        (["camera", "latency", "no.csv", "no.csv", "-o", "none/setup.yaml"], "there is no folder none"),
        (["log", "layout", "no.mcap", "-o", "none/all.json"], "there is no folder none"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_first(here, capsys, words, message):
    (here / "folder").mkdir()
    (here / "file").write_text("")
    line = refused(capsys, *words)
    assert message in line
    assert "--home" not in line
    assert sorted(path.name for path in here.iterdir()) == ["file", "folder"]


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
