"""Names of an older version are refused in one line that has the name of today."""

from __future__ import annotations

import pytest

from tests.cli.typed import refused


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ("plan", "learn.count.cap=3"),
            "unknown key 'learn.count.cap'; since 0.3 it is called 'learn.count.max_rollouts'",
        ),
        (
            ("plan", "adapt.eyes.onset.pull_m_s2=3"),
            "'adapt.eyes.onset.pull_m_s2'; since 0.3 it is called 'adapt.sensor_model.onset.min_tension_m_s2'",
        ),
        (
            ("plan", "adapt.catch=seen"),
            "'adapt.catch' is 'seen'; since 0.3 it is called 'visual'; allowed: visual, open_loop",
        ),
        (("plan", "learn/learner=lucky"), "since 0.3 it is called 'random_replay'"),
        (("plan", "safety=usual"), "'safety' is 'usual'; since 0.3 it is called 'default'; allowed: default"),
        (("plan", "-p", "toy"), "; since 0.3 it is called 'measurement'"),
        (("sweep", "transfer=proof", "seed=1,2"), "; since 0.3 it is called 'until_solved'"),
        (("sweep", "adapt.catch=seen,open"), "; since 0.3 it is called 'visual'"),
        (("sweep", "learn.count.cap=1,2"), "; since 0.3 it is called 'learn.count.max_rollouts'"),
        (("camera", "teach", "x"), "No such command 'teach'; since 0.3 it is called 'train'"),
        (("camera", "track", "x", "--teach", "y"), "No such option: --teach; since 0.3 it is called '--train'"),
        (("report", "--film", "a.mp4"), "No such option: --film; since 0.3 it is called '--video'"),
        (("referee",), "No such command 'referee'; since 0.3 it is called 'cross-check'"),
        (("setup", "toy"), "No such command 'toy'; since 0.3 it is called 'kendama'"),
    ],
    ids=lambda part: " ".join(part) if isinstance(part, tuple) else "",
)
def test_an_old_name_is_refused_with_the_new_one(capsys, tmp_path, monkeypatch, words, line):
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "home"))
    assert line in refused(capsys, *words)
