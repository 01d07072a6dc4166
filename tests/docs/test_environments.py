"""The pages of the Gymnasium environments say what the registered environments are."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import kendama_cli.gym  # noqa: F401 - registers
from tests.docs.measure import DOCS

PAGES = sorted((DOCS / "reference" / "environments").glob("*.md"))


def filled(page: Path) -> str:
    """Return the text of a page with its generated tables."""
    sys.path[:0] = [folder] if (folder := str(DOCS)) not in sys.path else []
    return str(importlib.import_module("declared").filled(page.read_text()))


def table(text: str, heading: str) -> list[list[str]]:
    """Return the rows of the tables under a heading, without their heads."""
    section = text.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    lines = re.sub(r"^\|.*\|\n\|(?: ?--- ?\|)+$", "", section, flags=re.M).splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]


def boxes(space: gymnasium.Space[Any]) -> list[Any]:
    """Return the parts of an observation that a page lists, a goal once."""
    parts = getattr(space, "spaces", None)
    return [space] if parts is None else [parts["observation"], parts["desired_goal"]]


def made(page: Path, **options: Any) -> gymnasium.Env[Any, Any]:
    """Return the environment of a page."""
    return gymnasium.make(f"kendama/{page.stem}", **options)


def test_every_environment_has_a_page() -> None:
    ours = {spec.id for spec in gymnasium.registry.values() if spec.namespace == "kendama"}
    assert {f"kendama/{page.stem}" for page in PAGES} == ours


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_the_bounds_of_each_observation(page: Path) -> None:
    rows = table(filled(page), "Observation space")
    low, high = (
        np.concatenate([getattr(box, end) for box in boxes(made(page).observation_space)]) for end in ("low", "high")
    )
    assert [int(row[0]) for row in rows] == [
        i for box in boxes(made(page).observation_space) for i in range(*box.shape)
    ]
    assert np.array([row[2] for row in rows], np.float32) == pytest.approx(low)
    assert np.array([row[3] for row in rows], np.float32) == pytest.approx(high)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_the_actions(page: Path) -> None:
    text, env = filled(page), made(page)
    rows = table(text, "Action space")
    accelerations = made(page, actions="discrete").unwrapped.settings.actions_m_s2
    if isinstance(env.action_space, gymnasium.spaces.Discrete):
        assert [float(row[1]) for row in rows] == list(accelerations)
        assert "`Discrete(5)`" in text
    else:
        assert [float(cell) for cell in rows[0][2:4]] == [env.action_space.low[0], env.action_space.high[0]]
        assert f"{max(accelerations):g} m/s²" in rows[0][1]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_the_arguments_with_their_defaults(page: Path) -> None:
    rows = {row[0].strip("`"): ast.literal_eval(row[1].strip("`")) for row in table(filled(page), "Arguments")}
    parameters = inspect.signature(type(made(page).unwrapped).__init__).parameters
    assert rows == {name: one.default for name, one in parameters.items() if name != "self"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_has_rewards_version_and_picture(page: Path) -> None:
    text, spec = page.read_text(), made(page).spec
    assert spec is not None
    assert f"- v{spec.version}: " in text
    (picture,) = re.findall(r"!\[[^\]]{20,}\]\(([\w-]+\.png)\)", text)
    assert (page.parent / picture).stat().st_size < 100_000
    assert table(text, "Measured agents")


def test_the_rewards_of_the_swing_up_are_those_of_the_settings() -> None:
    (page,) = [page for page in PAGES if page.stem == "SwingUp-v1"]
    reward = made(page).unwrapped.settings.reward
    rows = {row[0].split("`")[1]: row[1] for row in table(page.read_text(), "Rewards")}
    assert {name: float(rows[name]) for name in ("goal", "timeout", "outside")} == {
        "goal": reward.goal,
        "timeout": reward.timeout,
        "outside": reward.outside,
    }
    assert rows["missed"] == f"{reward.missed:g} at the rim, falling to 0 at {reward.missed_range_m:g} m"
    assert reward.step == reward.displacement_per_m == 0.0
