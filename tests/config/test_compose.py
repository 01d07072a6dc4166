"""Many compositions at once are those that composing each alone gives."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from kendama_cli.config.compose import composed
from kendama_cli.config.hydra_compose import compose_with_hydra
from kendama_cli.config.site import Site, bundled_root, find_site
from kendama_cli.config.sweep import composed_each, expand_sweep
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline import command_cache
from kendama_cli.pipeline.nodes import build_settings

CONF = bundled_root() / "conf"


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
    combinations = expand_sweep(
        site, ["transfer.catch.half_width_m=0.3,0.31", "transfer.catch.contact_speed_m_s=0.1,0.2"]
    )
    made = list(composed_each(site, combinations))
    assert made == [composed(site, texts) for texts in combinations]
    assert [one["adapt"]["line"]["half_width_m"] for one in made] == [0.3, 0.3, 0.31, 0.31]


def test_a_wrong_value_is_told_by_the_key_that_has_it(site: Site) -> None:
    for key, value in (("transfer.thorough", "perhaps"), ("predict.onset.min_frames", "none")):
        for again in (False, True):
            with pytest.raises(ConfigError) as caught:
                build_settings(composed(site, [f"{key}={value}"]))
            assert caught.value.key == key, f"from the index: {again}"
    order = [name.partition("/")[0] for one in OmegaConf.load(CONF / "config.yaml").defaults for name in one]
    for file in CONF.rglob("*.yaml"):
        for source in re.findall(r"\$\{(\w+)", file.read_text()):
            taker = file.relative_to(CONF).parts[0]
            assert order.index(source) <= order.index(taker), f"{file}: {source} is checked after {taker}"


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
    mine, here, last = (tmp_path / folder for folder in (f"{name}/conf", "here/conf", "last/conf"))
    for folder in (mine, here, last):
        (folder / "learn").mkdir(parents=True)
    (mine / "learn/odd.yaml").write_text("defaults: [sarsa]\nalpha: 0.123\n")
    for folder, mark in ((mine, "here"), (last, "last")):
        (folder / "learn/sarsa.yaml").write_text(f"alpha: 0.1\nmark: {mark}\n")
    (last / "config.yaml").write_text("defaults: [{learn: sarsa}]\n")
    monkeypatch.chdir(here.parent)
    for folders in ((mine, here), (here, mine)):
        site = dataclasses.replace(find_site(), conf_folders=(*folders, last))
        learn = composed(site, ["learn=odd"])["learn"]
        assert (learn["alpha"], learn["mark"]) == (0.123, "here"), "a folder before the last one did not win"


@pytest.mark.parametrize(
    "values",
    [
        ["seed=3", "learn.alpha=0.5"],
        ["learn.alpha=${seed}", "+learn.further={a: [1, {b: 2}]}"],
        ["++learn.further=1", "~learn.goal.slack_s"],
        ["capture.path=[a, b]", "capture.path=c", "transfer.catch.half_width_m=0.31"],
    ],
    ids=" ".join,
)
def test_values_set_in_files_that_were_composed_before_are_set_as_hydra_sets_them(
    site: Site, values: list[str]
) -> None:
    overrides = ["capture=file", *values, "simulation/engine=rail"]  # Hydra alone knows nothing of kinds
    with initialize_config_dir(str(site.conf_folders[0]), version_base="1.3"):
        wanted = OmegaConf.to_container(compose("config", overrides=overrides), resolve=True)
    found = [compose_with_hydra(site, overrides)[0] for _ in range(2)]
    assert found == [wanted, wanted]
    assert compose_with_hydra(site, ["capture=iiwa_kendama", "simulation/engine=rail"])[0] != wanted, "they were kept"


@pytest.mark.parametrize("wrong", ["learn.alph=1", "+learn.alpha=1", "~learn.alph", "learn.alpha.x=1"])
def test_values_that_hydra_does_not_set_are_refused_in_files_that_were_composed_before(site: Site, wrong: str) -> None:
    for _ in range(2):
        with pytest.raises(ConfigError, match=r"learn\.alph"):
            compose_with_hydra(site, [wrong])


def test_a_changed_file_and_a_changed_variable_are_seen_by_the_same_process(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command_cache, "SETTLED_S", 0.0)  # else files as young as these are never kept
    for name in ("learn", "picked"):
        (tmp_path / "conf" / name).mkdir(parents=True)
    chosen = "defaults: [sarsa, {/picked@_here_: '${oc.env:KENDAMA_TEST_PICKED}'}, _self_]\n"
    (tmp_path / "conf/learn/chosen.yaml").write_text(chosen)
    (tmp_path / "conf/picked/other.yaml").write_text("alpha: 0.25\n")
    for alpha, name in ((0.1, "mine"), (0.2, "mine"), (0.25, "other")):
        monkeypatch.setenv("KENDAMA_TEST_PICKED", name)
        (tmp_path / "conf/picked/mine.yaml").write_text(f"alpha: {alpha}\n")
        for _ in range(2):
            assert compose_with_hydra(find_site(), ["learn=chosen"])[0]["learn"]["alpha"] == alpha


def _written(tmp_path: Path, name: str, text: str) -> Site:
    file = tmp_path / "conf" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return find_site()


def test_a_file_of_a_group_holds_only_what_differs_from_its_kind(site: Site, tmp_path: Path) -> None:
    site = _written(tmp_path, "capture/mine.yaml", "kind: file\nunit: mm\ncolumns: {x: 2}\n")
    expected = composed(site, ["capture=file", "capture.unit=mm", "capture.columns.x=2"])
    assert composed(site, ["capture=mine"]) == expected
    assert composed(site, ["capture=mine", "capture.unit=cm"])["capture"]["unit"] == "cm"


def test_a_kind_brings_its_nested_groups_which_can_be_chosen(site: Site, tmp_path: Path) -> None:
    site = _written(tmp_path, "camera/mine.yaml", "kind: virtual\nrate_hz: 60.0\n")
    chosen = ["camera/sensor=webcam"]
    assert composed(site, ["camera=mine", *chosen]) == composed(site, ["camera.rate_hz=60.0", *chosen])


def test_an_arm_takes_the_missing_keys_from_the_arm_that_its_kind_names(site: Site, tmp_path: Path) -> None:
    site = _written(tmp_path, "robot/mine.yaml", "kind: urdf\nname: mine\npath: mine.urdf\n")
    expected = composed(site, ["robot=urdf", "robot.name=mine", "robot.path=mine.urdf"])
    assert composed(site, ["robot=mine"]) == expected


def test_an_unknown_key_of_a_file_of_ones_own_is_refused(site: Site, tmp_path: Path) -> None:
    site = _written(tmp_path, "capture/mine.yaml", "kind: file\nunits: mm\n")
    with pytest.raises(ConfigError, match=r"'capture\.units'.*unit"):
        build_settings(composed(site, ["capture=mine"]))


def test_kinds_that_refer_to_each_other_are_refused_in_one_line(site: Site, tmp_path: Path) -> None:
    _written(tmp_path, "capture/one.yaml", "kind: two\n")
    site = _written(tmp_path, "capture/two.yaml", "kind: one\n")
    with pytest.raises(ConfigError) as refused:
        composed(site, ["capture=one"])
    assert "\n" not in str(refused.value)
