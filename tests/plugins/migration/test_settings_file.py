"""``kendama config --migrate``: a file of an older version by the names of today, its comments where they were."""

from __future__ import annotations

from pathlib import Path

import pytest

from kendama_cli.plugins.migration.renamed_text import new_override
from tests.cli.typed import kendama, refused

WHOLE = """# mine
learn:
  count: {cap: 30, frozen: 12}   # few
  learner: {kind: "lucky"}
adapt.eyes.rate_hz: 60  # slow
adapt: {catch: 'open', steering: {below_rim_m: "${transfer.catch.below_rim_m}"}}
safety: usual
scene:
  bodies: []
"""
WHOLE_NOW = """# mine
learn:
  count: {max_rollouts: 30, solved_streak: 12}   # few
  learner: {kind: "random_replay"}
adapt.sensor_model.rate_hz: 60  # slow
adapt: {catch: 'open_loop', correction: {below_rim_m: "${transfer.catch.below_rim_m}"}}
safety: default
scene:
  bodies: []
"""
PIPELINE = """overrides:
  - transfer=proof   # until it is
  - "adapt.catch=seen"
stages:
  learn:
    config: [learn, game, seed]
"""
GROUP = """defaults:
  - uncertainty: hard
eyes:
  sigma_m: [0.001, 0.002, 0.001]   # worse
  onset: {pull_m_s2: 5.0}
policy: {lasting: [9, 10]}
"""
PACKAGE = (
    "# @package learn\ndefaults:\n  - /safety: usual\n  - override /learn/learner: pump\ndecision:\n  longest_s: 0.2\n"
)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [
        ("whole.yaml", WHOLE, WHOLE_NOW),
        ("pipelines/mine.yaml", PIPELINE, PIPELINE.replace("proof", "until_solved").replace("seen", "visual")),
        (
            "conf/adapt/mine.yaml",
            GROUP,
            GROUP.replace("eyes", "sensor_model")
            .replace("pull_m_s2", "min_tension_m_s2")
            .replace("lasting", "stop_at"),
        ),
        (
            "conf/learn/task/mine.yaml",
            PACKAGE,
            PACKAGE.replace("usual", "default").replace("pump", "energy_pumping").replace("longest_s", "max_s"),
        ),
        ("of_today.yaml", WHOLE_NOW, WHOLE_NOW),
    ],
)
def test_names_change_and_all_else_stays(here, capsys, name, before, after):
    path = here / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(before)
    code, out, _ = kendama(capsys, "config", "--migrate", name)
    assert code == 0
    assert path.read_text() == after
    assert ("it has no name that changed" in out) is (before == after)


def test_each_name_is_reported(here, capsys):
    Path("one.yaml").write_text("learn: {count: {cap: 3}}\n")
    _, out, _ = kendama(capsys, "config", "--migrate", "one.yaml")
    assert out == "cap -> max_rollouts\none.yaml: 1 name rewritten\n"


@pytest.mark.parametrize("text", [None, "a: [1,", "a: &b [*b]"])
def test_what_is_no_yaml_is_refused_and_left(here, capsys, text):
    if text is not None:
        Path("no.yaml").write_text(text)
    assert "--migrate no.yaml: it cannot be read (" in refused(capsys, "config", "--migrate", "no.yaml")
    assert text is None or Path("no.yaml").read_text() == text


def test_an_override_is_renamed_with_its_values():
    assert new_override("adapt.catch=seen,open") == "adapt.catch=visual,open_loop"
    assert new_override("learn/learner=lucky,sarsa") == "learn/learner=random_replay,sarsa"
    assert new_override("+learn.count.cap=glob(*)") == "+learn.count.max_rollouts=glob(*)"
    assert new_override("seed=range(0,3)") == "seed=range(0,3)"
