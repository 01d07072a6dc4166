"""Stored compositions are never given again where a source or its file differs."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.config import hydra_compose
from kendama_cli.config.compose import composed, composition
from kendama_cli.config.site import Site, bundled_root, find_site
from kendama_cli.config.sweep import composed_each, expand_sweep
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.command_cache import SETTLED_S

FIRST = "defaults: [_self_, {capture: file}, {store: home}, {executor: local}]\nseed: 0\n"


@pytest.fixture
def capture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An own file of the group capture, below a first file that chooses nothing else: quickly composed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf/config.yaml").write_text(FIRST)
    return written(tmp_path / "conf/capture/mine.yaml", "")


def written(path: Path, more: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text((bundled_root() / "conf/capture/file.yaml").read_text() + "\n" + more)
    return path


@pytest.fixture
def settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are old enough at once: these tests write none within a tick of the clock."""
    monkeypatch.setattr("kendama_cli.pipeline.command_cache.SETTLED_S", -1.0)


@pytest.fixture
def remembering(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hydra composes each list of overrides once: the same files give the same."""
    real = hydra_compose.compose_with_hydra
    answers: dict[tuple[str, ...], Any] = {}

    def compose(site: Site, overrides: list[str]) -> Any:
        asked = tuple(overrides)
        if asked not in answers:
            answers[asked] = real(site, overrides)
        return answers[asked]

    monkeypatch.setattr(hydra_compose, "compose_with_hydra", compose)


@pytest.fixture
def composings(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Grows with each composition by Hydra."""
    seen: list[Any] = []
    real = hydra_compose.compose_with_hydra

    def counted(site: Site, overrides: list[str]) -> Any:
        seen.append(overrides)
        return real(site, overrides)

    monkeypatch.setattr(hydra_compose, "compose_with_hydra", counted)
    return seen


def index(site: Site) -> Path:
    (path,) = (site.home / "index/composed").glob("*.json")
    return path


# text with the escape of a dollar, a list, and a default value: whatever YAML and OmegaConf take
@pytest.mark.parametrize(
    "value", ["${oc.env:KENDAMA_TEST_X}", '"\\x24{oc.env:KENDAMA_TEST_X}"', "${oc.env:KENDAMA_TEST_X,9}"]
)
@pytest.mark.usefixtures("settled")
def test_what_an_interpolation_read_is_part_of_the_question(
    capture: Path, composings: list[Any], value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(capture, f"note: {value}")
    site = find_site()
    for asked, expected, times in (("4", "4", 1), ("6", "6", 2), ("6", "6", 2), ("4", "4", 3)):
        monkeypatch.setenv("KENDAMA_TEST_X", asked)
        made = composition(site, ["capture=mine"])
        assert (made.config["capture"]["note"], len(composings)) == (expected, times)
        assert made.environment == {"KENDAMA_TEST_X": asked}


@pytest.mark.usefixtures("settled")
def test_a_variable_that_was_not_set_is_remembered_as_such(
    capture: Path, composings: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    written(capture, "note: ${oc.env:KENDAMA_TEST_X,9}")
    for _ in range(2):
        assert composed(find_site(), ["capture=mine"])["capture"]["note"] == "9"
    assert len(composings) == 1
    monkeypatch.setenv("KENDAMA_TEST_X", "5")
    assert composed(find_site(), ["capture=mine"])["capture"]["note"] == "5"


@pytest.mark.parametrize("value", ["${now:%S}", "${hydra:job.name}", "${python_version:}", "${mine:1}"])
def test_an_interpolation_that_could_give_anything_is_refused_in_one_line(capture: Path, value: str) -> None:
    written(capture, f"note: {value}")
    with pytest.raises(ConfigError, match="nsupported interpolation type"):
        composed(find_site(), ["capture=mine"])


@pytest.mark.usefixtures("capture", "settled", "remembering")
def test_no_byte_of_a_stored_composition_can_change_unseen(composings: list[Any]) -> None:
    site = find_site()
    answer = composed(site, ["seed=4"])
    whole = index(site).read_bytes()
    assert composed(site, ["seed=4"]) == answer
    assert len(composings) == 1
    place = whole.index(b'"seed":4')
    changed = [
        whole[: place + 7] + b"6" + whole[place + 8 :],
        *(whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :] for i in (0, 15, 40, len(whole) // 2, len(whole) - 1)),
        whole[:-1],
        b"",
    ]
    for number, data in enumerate(changed):
        index(site).write_bytes(data)
        assert composed(site, ["seed=4"]) == answer
        assert len(composings) == number + 2, "it was not composed anew"
        assert index(site).read_bytes() == whole


WRONG = ["[1]", "[]", "null", "3", '"text"', "{}", '{"question": 1}', "[" * 100_000, "\x00", "\ufeff[1]"]


@pytest.mark.usefixtures("capture", "settled", "remembering")
def test_an_index_file_of_another_shape_is_as_good_as_none(composings: list[Any]) -> None:
    site = find_site()
    answer = composed(site, ["seed=4"])
    for number, text in enumerate(WRONG):
        index(site).write_text(text)
        assert composed(site, ["seed=4"]) == answer
        assert len(composings) == number + 2, f"it was not composed anew for {text[:20]!r}"


@pytest.mark.usefixtures("settled")
def test_a_file_in_a_linked_folder_is_watched_as_any_other(capture: Path, tmp_path: Path) -> None:
    away = tmp_path / "away"
    capture.parent.rename(away)
    (tmp_path / "conf/capture").symlink_to(away)
    (away / "loop").symlink_to(tmp_path / "conf")
    for note in ("one", "two"):
        written(away / "mine.yaml", f"note: {note}")
        assert composed(find_site(), ["capture=mine"])["capture"]["note"] == note


def test_a_file_that_could_change_again_within_one_tick_is_not_remembered(capture: Path) -> None:
    site = find_site()
    time.sleep(SETTLED_S + 0.1)  # of the first file
    written(capture, "")
    status = capture.stat()
    composed(site, ["capture=mine"])
    assert not (site.home / "index/composed").exists()
    os.utime(capture, ns=(status.st_atime_ns, status.st_mtime_ns - 10**10))  # the time of change is as young
    composed(site, ["capture=mine"])
    assert not (site.home / "index/composed").exists()
    time.sleep(SETTLED_S + 0.1)
    composed(site, ["capture=mine"])
    assert index(site)


@pytest.mark.parametrize(
    "overrides",
    [
        ["+capture.note=${seed}", "seed=5,6"],
        ["+capture.note=v${seed}", "seed=5,6"],
        ["+capture.note=${oc.select:seed}", "seed=5,6"],
    ],
)
@pytest.mark.usefixtures("capture")
def test_an_override_that_refers_to_a_swept_value_follows_it(overrides: list[str]) -> None:
    site = find_site()
    combinations = expand_sweep(site, overrides)
    made = list(composed_each(site, combinations))
    assert made == [composed(site, texts) for texts in combinations]
    assert len({json.dumps(one["capture"]["note"]) for one in made}) == 2


def test_a_reference_that_yaml_escapes_is_followed_in_a_sweep(capture: Path) -> None:
    written(capture, 'note: "\\x24\\x7bseed}"')
    notes = [
        one["capture"]["note"] for one in composed_each(find_site(), [["capture=mine", f"seed={i}"] for i in (5, 6)])
    ]
    assert notes == [5, 6]


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ("1: 2", "the key 1 in 'capture' is not text"),
        ("true: 2", "the key True in 'capture' is not text"),
        ("null: 2", "configuration: "),
        ("1.5: 2", "the key 1.5 in 'capture' is not text"),
        ("x: {3: 4}", "the key 3 in 'capture.x' is not text"),
        ("x: [0, {3: 4}]", r"the key 3 in 'capture.x\[1\]' is not text"),
        ("x: !!binary aGVsbG8=", "'capture.x' is binary data"),
        ("x: &a\n  y: *a", r"line \d+: '\*a' refers to what holds it"),
        ("x: &a [*a]", r"line \d+: '\*a' refers to what holds it"),
        ("x: " + "[" * 300 + "]" * 300, "nested deeper than 50"),
        # libyaml reads ahead, and from 0.2.6 on refuses 1000 levels by itself
        ("x: " + "[" * 3000 + "]" * 3000, "nested (deeper than 50|too deep)"),
        (
            "\n".join(["a0: &a0 [x]", *(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 40))]),
            "more than 1000000 values",
        ),
        ("x: !!set {a, b}", "configuration: "),
        ("? [1, 2]\n: 3", "configuration: "),
        ("x: !!python/object/apply:os.getcwd []", "configuration: "),
        ("x: !!python/object/apply:pathlib.Path [a]", "'capture.x' is a PosixPath"),
        ('x: "\\ud800"', "configuration: "),
    ],
)
def test_what_is_no_plain_yaml_is_one_line(capture: Path, more: str, named: str) -> None:
    written(capture, more)
    with pytest.raises(ConfigError, match=named) as caught:
        composed(find_site(), ["capture=mine"])
    assert len(str(caught.value).splitlines()) == 1
    assert len(str(caught.value)) < 400


@pytest.mark.usefixtures("capture")
@pytest.mark.parametrize("line", ["hydra: {searchpath: ['pkg://kendama_made_up']}", "hydra: null"])
def test_the_first_file_cannot_change_hydra_itself(tmp_path: Path, line: str) -> None:
    text = (bundled_root() / "conf/config.yaml").read_text()
    (tmp_path / "conf/config.yaml").write_text(f"{text}\n{line}\n")
    with pytest.raises(ConfigError, match="which kendama does not offer"):
        composed(find_site(), [])


@pytest.mark.usefixtures("capture")
def test_a_first_file_that_cannot_be_composed_is_one_line(tmp_path: Path) -> None:
    for text in ("[1]", "3", "- a", "defaults: 3", "defaults: [[1]]", "a: ${a}", "a: ${b}\nb: ${a}"):
        (tmp_path / "conf/config.yaml").write_text(text)
        with pytest.raises(ConfigError) as caught:
            composed(find_site(), [])
        assert len(str(caught.value).splitlines()) == 1, text
