"""A home that 0.2.0 (commit b9f1eb2) wrote, with a live stream, a policy and an arm's run, by the names of today."""

from __future__ import annotations

import json
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import DemonstrationSet
from kendama_cli.artifacts.policy import PolicyArtifact, policy_digest
from kendama_cli.cli.main import main
from kendama_cli.log.reader import LogFile
from kendama_cli.plugins.migration.home import migrate_home
from kendama_cli.store import durable
from kendama_cli.store.codecs import load_artifact, pack_arrays
from kendama_cli.store.home import MARK
from kendama_cli.store.store import Store, StoredResult

ARCHIVE = Path(__file__).with_name("home-0.2.0.tar.xz")
RECORDED = ("capture=mocap", "capture.port=19372", "capture.seconds=2.5", "capture.times=stamps")


@pytest.fixture
def old(tmp_path, monkeypatch):
    with tarfile.open(ARCHIVE) as archive:
        archive.extractall(tmp_path / "home", filter="data")
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "home"


@pytest.fixture
def new(old, capsys):
    assert told(capsys, "cache", "migrate")[0] == 0
    return old


def told(capsys, *words) -> tuple[int, str, str]:
    code = main(list(words))
    out, err = capsys.readouterr()
    return code, out, err


def results(home: Path) -> dict[str, StoredResult]:
    return {one.stage: one for one in Store(home).entries()}


@pytest.mark.parametrize("words", [("runs",), ("report",), ("diff", "1", "2"), ("plan", "-p", "press"), ("run",)])
def test_a_home_of_old_names_is_refused_with_the_command_that_rewrites_it(old, capsys, words):
    code, _, err = told(capsys, *words)
    assert code == 2
    assert f"{old} has the names of settings and metrics from before 0.3; type 'kendama cache migrate' once" in err


def test_a_home_without_a_mark_is_known_by_the_names_in_its_keys(old, capsys):
    (old / MARK).unlink()
    assert "type 'kendama cache migrate' once" in told(capsys, "runs")[2]
    assert told(capsys, "cache", "migrate")[1] == f"{old}: 4 results (1 recordings) and 3 runs rewritten\n"
    (old / MARK).unlink()
    assert told(capsys, "runs")[0] == 0


def test_all_of_it_is_rewritten_once_and_every_byte_is_whole(old, capsys):
    code, out, _ = told(capsys, "cache", "migrate")
    assert (code, out) == (0, f"{old}: 4 results (1 recordings) and 3 runs rewritten\n")
    assert told(capsys, "cache", "migrate")[1] == f"{old}: 0 results (0 recordings) and 0 runs rewritten\n"
    assert told(capsys, "cache", "verify")[0] == 0
    assert {path.parent.name for path in old.glob("results/*/*.json")} == {"capture", "encode", "interact", "learn"}
    assert len(list(old.glob("objects/*/*"))) == 4


def test_what_a_person_recorded_is_known_again_and_its_samples_are_those_of_before(old, capsys):
    before = results(old)["capture"]
    files = {name: durable.file_sha256(before.artifact / name) for name in ("artifact.json", "arrays.npz")}
    migrate_home(Store(old))
    words = ("plan", "-p", "imitation", "--until", "capture", *RECORDED, "capture.max_gap_s=0.2", "--json")
    (stage,) = json.loads(told(capsys, *words)[1])["stages"]
    assert stage["status"] == "cached"
    after = results(old)["capture"]
    assert after.key == stage["key"] != before.key
    assert {name: durable.file_sha256(after.artifact / name) for name in files} == files
    assert len(load_artifact(DemonstrationSet, after.artifact).demonstrations) == 1


def test_a_later_stage_keeps_the_recording_that_it_was_made_from(new):
    found = results(new)
    assert found["encode"].parts["inputs"] == {"capture": found["capture"].content_digest}
    assert found["encode"].parts["config"]["encode"].keys() >= {"rest_fraction", "margin_fraction"}


def test_runs_are_found_by_the_names_of_today(new, capsys):
    rows = json.loads(told(capsys, "runs", "--json", "--filter", "learn.count.max_rollouts=20")[1])
    rows = rows["runs"] if isinstance(rows, dict) else rows
    assert [row["run"][:5] for row in rows] == ["00002"]
    code, _, err = told(capsys, "runs", "--filter", "learn.count.cap=20")
    assert code == 2
    assert "no run has 'learn.count.cap'; since 0.3 it is called 'learn.count.max_rollouts'" in err
    record = json.loads(next(new.glob("runs/00002-*.json")).read_text())["record"]
    assert {"learn/learner=random_replay", "learn.count.max_rollouts=20"} <= set(record["overrides"])
    (learned,) = record["stages"]
    assert {"rollouts_to_learned", "solved", "random_success_rate"} <= learned["metrics"].keys()
    assert Path(learned["artifact"]).is_dir()


@pytest.mark.parametrize("run", ["1", "2", "3"])
def test_reports_are_made_of_the_logs_by_the_names_of_today(new, capsys, run):
    assert told(capsys, "report", run, "-o", "page.html")[0] == 0
    page = Path("page.html").read_text(encoding="utf-8")
    assert {"1": "max_gap_s", "2": "workspace_shrink", "3": "max_error_m"}[run] in page
    for old in ("longest_gap_s", "slowest_rad_s", "most_error_m", "turn_rad", "contact_share"):
        assert old not in page


def test_runs_are_compared(new, capsys):
    code, out, _ = told(capsys, "diff", "2", "3", "--json")
    assert code == 0
    assert "contact_fraction" in out or "peak_force_n" in out


def test_a_policy_is_sealed_by_the_names_of_today(new):
    policy: PolicyArtifact = load_artifact(PolicyArtifact, results(new)["learn"].artifact)
    assert policy.kind == "random_replay"
    assert policy.digest == policy_digest(policy.kind, policy.meaning, policy.arrays)
    assert "min_rate_rad_s" in policy.meaning
    assert "slowest_rad_s" not in policy.meaning


def test_the_arms_log_has_its_messages_at_their_times(old):
    before = LogFile(results(old)["interact"].artifact / "log.mcap")
    counts = {topic: before.table(topic).shape for topic in before.topics}
    migrate_home(Store(old))
    after = LogFile(results(old)["interact"].artifact / "log.mcap")
    assert {topic: after.table(topic).shape for topic in after.topics} == counts
    assert after.stage["settings"]["interact"]["script"][0]["rotation_rad"] == [0.0, 0.0, 0.0]
    assert "contact_fraction" in after.stage["metrics"]
    joints = "/interact/joints"
    assert after.table(joints).equals(before.table(joints))


def test_a_field_of_an_artifact_that_has_another_name_keeps_its_array(tmp_path):
    store = Store(tmp_path / "home")
    fastest = np.array([1.5, 2.5])
    with store.scratch_folder() as folder:
        (folder / "artifact.json").write_bytes(b'{"fastest_rad_s": {"array": "fastest_rad_s"}}')
        (folder / "arrays.npz").write_bytes(pack_arrays({"fastest_rad_s": fastest}))
        (folder / "metrics.json").write_bytes(b"{}\n")
        gives = "kendama_cli.artifacts.friction_model:FrictionModel"
        parts: dict[str, Any] = {
            "stage": "mine:Identify",
            "gives": gives,
            "config": {},
            "inputs": {},
            "code": {"a": "b"},
        }
        store.put(folder, "identify", "0" * 40, {}, parts)
    assert migrate_home(store).results == 1
    (made,) = store.entries()
    assert json.loads((made.artifact / "artifact.json").read_bytes())["max_speed_rad_s"] == {"array": "max_speed_rad_s"}
    with np.load(made.artifact / "arrays.npz") as arrays:
        assert np.array_equal(arrays["max_speed_rad_s"], fastest)


def test_a_home_is_left_alone_while_a_run_continues(old, capsys):
    with Store(old).in_use():
        code, _, err = told(capsys, "cache", "migrate")
    assert code == 1
    assert "a run is using" in err
    assert "longest_gap_s" in str(results(old)["capture"].parts)
