"""libyaml's parser below OmegaConf's rules gives what OmegaConf's own gives."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from omegaconf import OmegaConf, _utils
from omegaconf._utils import get_yaml_loader

from kendama_cli.config.hydra_compose import quick_loader, quick_yaml

CONF = Path(__file__).resolve().parents[2] / "conf"


def test_every_file_that_we_ship_means_the_same_by_both() -> None:
    files = sorted(CONF.rglob("*.yaml"))
    assert len(files) > 100
    for file in files:
        text = file.read_text()
        assert yaml.load(text, Loader=quick_loader()) == yaml.load(text, Loader=get_yaml_loader()), file


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: 1e3", 1000.0),
        ("a: 2026-11-23", "2026-11-23"),
        ("a: on", True),
        ("a: 1_000", 1000),
        ("a: .5", 0.5),
        ("a: 'größer'", "größer"),
        ("a: ${b}\nb: 1", "${b}"),
        ("a: &x [1, 2]\nb: *x", [1, 2]),
    ],
)
def test_rules_of_omegaconf_hold(text: str, value: object) -> None:
    for loader in (quick_loader(), get_yaml_loader()):
        found = yaml.load(text, Loader=loader)["a"]
        assert (found, type(found)) == (value, type(value))


def test_a_key_that_stands_twice_is_refused_while_files_are_read_quickly_and_nothing_is_left_behind(
    tmp_path: Path,
) -> None:
    (tmp_path / "twice.yaml").write_text("a: 1\na: 2\n")
    with quick_yaml(), pytest.raises(yaml.constructor.ConstructorError, match="found duplicate key a"):
        OmegaConf.load(tmp_path / "twice.yaml")
    assert _utils.get_yaml_loader is get_yaml_loader
