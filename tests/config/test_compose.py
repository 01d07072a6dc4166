"""Many compositions at once are those that composing each alone gives."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, bundled_root, find_site
from kendama_cli.config.sweep import composed_each, expand_sweep
from kendama_cli.errors import ConfigError


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    monkeypatch.chdir(tmp_path)
    return find_site()


def test_each_of_a_sweep_is_composed_as_it_would_be_alone(site: Site) -> None:
    combinations = expand_sweep(site, ["seed=range(0,2)", "game.rope.length_m=0.3", "capture=file,iiwa_kendama"])
    assert len(combinations) == 4
    assert list(composed_each(site, combinations)) == [composed(site, texts) for texts in combinations]


def test_a_value_that_another_refers_to_is_composed_in_full(site: Site, tmp_path: Path) -> None:
    folder = tmp_path / "conf/game/cup"
    folder.mkdir(parents=True)
    text = (bundled_root() / "conf/game/cup/floor.yaml").read_text()
    (folder / "linked.yaml").write_text(text.replace("depth_m: 0.070", "depth_m: ${game.cup.radius_m}"))
    combinations = [["game/cup=linked", f"game.cup.radius_m={radius}"] for radius in (0.05, 0.06)]
    depths = [config["game"]["cup"]["depth_m"] for config in composed_each(find_site(), combinations)]
    assert depths == [0.05, 0.06]


def test_the_shipped_configurations_references_are_followed_in_a_sweep(site: Site) -> None:
    combinations = expand_sweep(site, ["transfer.catch.half_width_m=0.3,0.31", "transfer.catch.give_m_s=0.1,0.2"])
    made = list(composed_each(site, combinations))
    assert made == [composed(site, texts) for texts in combinations]
    assert [one["adapt"]["line"]["half_width_m"] for one in made] == [0.3, 0.3, 0.31, 0.31]


def test_references_that_are_not_plain_may_mean_anything(site: Site, tmp_path: Path) -> None:
    folder = tmp_path / "conf/game/cup"
    folder.mkdir(parents=True)
    text = (bundled_root() / "conf/game/cup/floor.yaml").read_text()
    for name, reference in (("relative", "${.radius_m}"), ("nested", "${game.${oc.select:nothing,cup}.radius_m}")):
        (folder / f"{name}.yaml").write_text(text.replace("depth_m: 0.070", f"depth_m: {reference}"))
        combinations = [[f"game/cup={name}", f"game.cup.radius_m={radius}"] for radius in (0.05, 0.06)]
        depths = [config["game"]["cup"]["depth_m"] for config in composed_each(find_site(), combinations)]
        assert depths == [0.05, 0.06], name


@pytest.mark.parametrize("wrong", ["learn.alph=1", "learn=1", "lern.alpha=1"])
def test_a_wrong_key_in_a_sweep_is_named(site: Site, wrong: str) -> None:
    with pytest.raises(ConfigError):
        list(composed_each(site, [["seed=1", wrong]]))


def test_a_changed_environment_variable_is_seen_although_no_file_changed(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "conf/capture"
    folder.mkdir(parents=True)
    text = (bundled_root() / "conf/capture/file.yaml").read_text()
    (folder / "mine.yaml").write_text("\n".join(["note: ${oc.env:KENDAMA_TEST_NOTE}", text]))
    for note in ("one", "two"):
        monkeypatch.setenv("KENDAMA_TEST_NOTE", note)
        assert composed(find_site(), ["capture=mine"])["capture"]["note"] == note
        assert composed(find_site(), ["+seed2=${oc.env:KENDAMA_TEST_NOTE}", "capture=file"])["seed2"] == note


@pytest.mark.parametrize("name", ["plain", "with space", "it's, [odd]", "back\\slash", "equals=sign", "${dollar}"])
def test_folders_of_any_name_are_searched_in_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    mine = tmp_path / name / "conf/learn"
    mine.mkdir(parents=True)
    (mine / "odd.yaml").write_text("defaults: [sarsa]\nalpha: 0.123\n")
    (mine / "sarsa.yaml").write_text((bundled_root() / "conf/learn/sarsa.yaml").read_text() + "\nmark: here\n")
    here = tmp_path / "here"
    (here / "conf").mkdir(parents=True)
    monkeypatch.chdir(here)
    for folders in ([mine.parent, here / "conf"], [here / "conf", mine.parent]):
        site = dataclasses.replace(find_site(), conf_folders=(*folders, bundled_root() / "conf"))
        learn = composed(site, ["learn=odd"])["learn"]
        assert (learn["alpha"], learn["mark"]) == (0.123, "here"), "a folder before the bundled one did not win"
