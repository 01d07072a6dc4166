"""The report: everything that was asked for is there, from the logs alone, byte for byte the same."""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import pytest

from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import McapLog
from kendama_cli.report.page import make_report
from kendama_cli.report.replay.page_part import scripts
from kendama_cli.schema.declaration import find_stage
from kendama_cli.schema.messages import codec, kind_of
from tests.log.made_logs import MemoryFile, all_topics, memory_log

VOID = {"meta", "link", "input", "br"}


class _Balance(HTMLParser):
    """Collects ids and the tags that are left open."""

    def __init__(self):
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_the_made_up_run_has_every_topic(logs):
    written = {topic for path in logs.values() for topic in LogFile(path, topics=()).topics}
    assert {topic.replace("*", "left") for topic in all_topics()} <= written


def _made_elsewhere(run_folder, seed, **environment):
    """The page as a process of its own makes it, with other hashes and another time zone."""
    made = subprocess.run(
        [sys.executable, "-m", "tests.report.synthetic_run", str(run_folder)],
        check=True,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONIOENCODING": "utf-8", "TZ": f"UTC+{seed}", **environment},
    )
    return made.stdout.decode()


@pytest.mark.slow
def test_two_processes_make_the_same_bytes(page, run_folder):
    assert _made_elsewhere(run_folder, "1") == page


@pytest.mark.slow
def test_a_style_of_the_users_own_changes_nothing(page, run_folder, tmp_path):
    (tmp_path / "matplotlibrc").write_text("font.size: 20\nlines.linewidth: 9\nsvg.fonttype: path\n")
    assert _made_elsewhere(run_folder, "2", MATPLOTLIBRC=str(tmp_path)) == page


def test_the_page_asks_nothing_of_the_network(page):
    three, player = scripts()
    assert page.count(three) == page.count(player) == 1
    assert not re.search(r"""fetch|import\s*\(|https?:""", player)
    marked = page.replace(three, "")  # whose loaders nothing calls, and nothing could: its policy lets nothing load
    addresses = re.findall(r"""(?:src|href|url)\s*[=(]\s*["']?([^"')\s>]+)""", marked)
    assert [a for a in addresses if not a.startswith(("#", "data:"))] == []
    assert "@import" not in page
    assert len(page) < 3_000_000


def test_the_page_is_well_formed_and_its_ids_are_unique(page):
    balance = _Balance()
    balance.feed(page)
    assert balance.open == []
    assert len(balance.ids) == len(set(balance.ids))
    for target in set(re.findall(r"""(?:href="|url\()#([^")]+)""", page)):
        assert target in balance.ids


@pytest.mark.parametrize(
    "seen",
    [
        "Demonstrated and reproduced path",
        "Fig. 4 of the paper",
        "Each demonstration (grey) and its own primitive (blue)",
        "Distance of each primitive from its demonstration",
        "Weight of each basis function, by coordinate",
        "The search for the time scale",
        "The catch",
        "24 of 30 caught (95 % interval 0.614 to 0.923)",
        "Reward per rollout",
        "Fig. 5 of the paper",
        "The learned swing-up",
        "Fig. 6 of the paper",
        "Position of the catch",
        "Time of the catch",
        "40 flights",
        "Camera “left”",
        "rollout on the twin",
        "Reward of every rollout on the twin from an empty table, for comparison.",
        "Greedy trials that reached the goal: 70% before this learning, 95% after it.",
        "6 full games: 5 swung up, 5 catch predicted, 4 caught.",
        "The imitated swing",
        "Desired and exerted force",
        "they differ by 0.21 N rms",
        "20260101-120000-abcd",
    ],
)
def test_what_was_asked_for_is_shown(page, seen):
    assert seen in page


def test_metrics_and_figures_say_what_they_are_in_the_words_of_the_declaration(page):
    stage = find_stage("adapt")
    assert f'<dt title="success_rate: {stage.metrics["success_rate"]}">' in page
    assert f"<summary>What is this?</summary><p>{stage.figures['adapt-search']}</p>" in page


def test_metrics_and_settings_of_every_stage_are_listed(page, logs):
    for path in logs.values():
        for name in LogFile(path, topics=()).stage["metrics"]:
            assert f'<dt title="{name}' in page
    for setting in ("settings.repeats", "game.rope.length_m", "hardware.kind", "settings.grid.angle_bins"):
        assert f"<dt>{setting}</dt>" in page


def test_the_film_holds_the_caught_rollout(page):
    film = re.search(r'<div class="player" data-autoplay=1>.*?</script>', page, re.DOTALL)
    assert film is not None
    assert '"rate":60' in film[0]
    assert film[0].count("[") > 140  # 2.5 s at 60 pictures a second


def test_a_stage_that_failed_or_never_ran_shows_as_such(run, logs):
    stages = [dict(stage) for stage in run["stages"]]
    stages[2] |= {"status": "failed", "error": "no tau catches <the ball>"}
    kept = {name: path for name, path in logs.items() if name in {"capture", "encode"}}
    page = make_report({**run, "stages": stages}, kept)
    assert "This stage failed: no tau catches &lt;the ball&gt;" in page
    assert page.count("This stage has no log: it did not run, or did not end.") == len(stages) - 3
    assert "Demonstrated and reproduced path" in page
    assert "Reward per rollout" not in page


def test_logs_without_messages_still_make_a_page(run, tmp_path):
    logs = {}
    for stage in run["stages"]:
        logs[stage["name"]] = tmp_path / f"{stage['name']}.mcap"
        memory_log().finish(logs[stage["name"]], stage=stage["name"], settings={}, metrics={})
    page = make_report(run, logs)
    assert page.count("The log of this stage holds nothing to draw.") == len(run["stages"])


def _one_of_each_stage(topics):
    """Every topic; in the usual suite one of each stage alone, for each is a page of its own."""
    of_stage = {topic.split("/")[1]: topic for topic in topics}
    return [topic if topic in of_stage.values() else pytest.param(topic, marks=pytest.mark.slow) for topic in topics]


@pytest.mark.parametrize("topic", _one_of_each_stage(sorted(all_topics())))
def test_a_log_that_lacks_one_topic_still_makes_a_page(run, logs, tmp_path, topic):
    """Every figure may be missing alone: the others must not depend on it."""
    stage = topic.split("/")[1]
    full = LogFile(logs[stage])
    log = memory_log()
    for name in full.topics:
        kind = kind_of(all_topics(), name)
        for t_ns, data in full.channel(name).messages:
            if name != topic.replace("*", "left"):
                log.write(name, t_ns / 1e9, codec(kind).decode(data))
    path = tmp_path / "part.mcap"
    log.finish(path, stage=stage, settings=full.stage["settings"], metrics=full.stage["metrics"])
    page = make_report({"run": "x", "stages": [{"name": stage, "status": "ran"}]}, {stage: path})
    assert f'<section id="{stage}">' in page


def test_a_stage_of_a_project_of_its_own_gets_metrics_and_settings(tmp_path):
    path = tmp_path / "own.mcap"
    memory_log().finish(path, stage="own", settings={"a": 1}, metrics={"rate_hz": 5.0})
    page = make_report({"run": "x", "stages": [{"name": "own", "status": "ran"}]}, {"own": path})
    assert "<h2>own</h2>" in page
    assert "5 Hz" in page


@dataclass(frozen=True)
class _OlderRolloutMessage:
    number: int
    miss_m: float


def test_a_log_of_another_version_leaves_the_rest_of_the_page(run, logs, tmp_path):
    log = McapLog({"/learn/rollout": _OlderRolloutMessage}, MemoryFile())
    log.write("/learn/rollout", 0.0, _OlderRolloutMessage(1, 0.01))
    log.finish(tmp_path / "learn.mcap", stage="learn", settings={}, metrics={"caught_rate": 1.0})
    assert "Reward per rollout" in make_report(run, {"learn": logs["learn"]})
    page = make_report(run, {"learn": tmp_path / "learn.mcap", "encode": logs["encode"]})
    assert re.search(r"This chapter cannot be drawn[^<]*", page)
    assert "Reward per rollout" not in page
    assert "Demonstrated and reproduced path" in page


def test_a_damaged_log_is_refused_with_one_line(run, logs, tmp_path):
    broken = bytearray(logs["learn"].read_bytes())
    broken[len(broken) // 2] ^= 1
    (tmp_path / "learn.mcap").write_bytes(broken)
    with pytest.raises(InputError, match=r"learn.mcap, before byte \d+: the MCAP file is damaged"):
        make_report(run, {**logs, "learn": tmp_path / "learn.mcap"})
