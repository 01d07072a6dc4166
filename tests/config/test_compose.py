"""Many compositions at once are those that composing each alone gives."""

from __future__ import annotations

from pathlib import Path

import pytest

from kendama_cli.config.compose import composed, composed_each, expand_sweep
from kendama_cli.config.site import Site, bundled_root, find_site
from kendama_cli.errors import ConfigError


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Site:
    monkeypatch.chdir(tmp_path)
    return find_site()


def test_each_of_a_sweep_is_composed_as_it_would_be_alone(site: Site) -> None:
    combinations = expand_sweep(
        site, ["seed=range(0,3)", "learn.alpha=0.1,1", "game.rope.length_m=0.3", "capture=file,iiwa_kendama"]
    )
    assert len(combinations) == 12
    assert list(composed_each(site, combinations)) == [composed(site, texts) for texts in combinations]


def test_a_value_that_another_refers_to_is_composed_in_full(site: Site, tmp_path: Path) -> None:
    folder = tmp_path / "conf/game"
    folder.mkdir(parents=True)
    text = (bundled_root() / "conf/game/kendama.yaml").read_text()
    (folder / "linked.yaml").write_text(text.replace("depth_m: 0.070", "depth_m: ${game.cup.radius_m}"))
    combinations = [["game=linked", f"game.cup.radius_m={radius}"] for radius in (0.05, 0.06)]
    depths = [config["game"]["cup"]["depth_m"] for config in composed_each(find_site(), combinations)]
    assert depths == [0.05, 0.06]


@pytest.mark.parametrize("wrong", ["learn.alph=1", "learn=1", "lern.alpha=1"])
def test_a_wrong_key_in_a_sweep_is_named(site: Site, wrong: str) -> None:
    with pytest.raises(ConfigError):
        list(composed_each(site, [["seed=1", wrong]]))
