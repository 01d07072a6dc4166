"""A law that is changed in one file is seen in every engine, environment and learner that uses it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.architecture.laws_probe import ACTIONS, LARGEST_M_S2, STRETCHED_M

ROOT = Path(__file__).parents[2]
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package, with what is compiled already, beside the rest of the tree."""
    copy = tmp_path_factory.mktemp("tree")
    shutil.copytree(ROOT / "kendama_cli", copy / "kendama_cli")
    for name in ("conf", "data", "pipelines", "tests"):
        (copy / name).symlink_to(ROOT / name)
    return copy


@pytest.fixture(scope="module")
def before(tree: Path) -> dict[str, Any]:
    return probed(tree)


def probed(tree: Path) -> dict[str, Any]:
    command = [sys.executable, "-m", "tests.architecture.laws_probe"]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    assert Path(found["package"]).parent == tree / "kendama_cli"
    return found


def with_patch(tree: Path, file: str, old: str, new: str) -> dict[str, Any]:
    """Return the engines' results with ``old``, which stands once in ``file``, replaced by ``new``."""
    path = tree / "kendama_cli" / file
    text = path.read_text()
    assert text.count(old) == 1
    try:
        path.write_text(text.replace(old, new))
        return probed(tree)
    finally:
        path.write_text(text)


def test_a_new_term_of_the_reward(tree: Path, before: dict[str, Any]) -> None:
    old = "return settings.step - "
    after = with_patch(tree, "learning/reward.py", old, f"return 7.0 * (abs(x_m) > 0.0) + {old[7:]}")
    was, now = before["rewards"], after["rewards"]
    assert was["one"] == was["many"]
    assert now["one"] - was["one"] == now["many"] - was["many"] == pytest.approx(7.0 * ACTIONS)
    assert now["random"] > was["random"] + 100.0
    assert now["sarsa"] > was["sarsa"] + 100.0
    assert after["tensions"] == before["tensions"]


def test_a_changed_law_of_the_rope(tree: Path, before: dict[str, Any]) -> None:
    old = "law.stiffness_n_m * (used_m + left_m - law.length_m) + growth"
    stiffer = f"{old} + 1e5 * (used_m + left_m - law.length_m) ** 2"
    after = with_patch(tree, "physics/rope.py", old, stiffer)
    assert set(before["tensions"]) == {"rail", "arm", "hand", "side", "plain"}
    for world, tension_n in before["tensions"].items():
        assert after["tensions"][world] == pytest.approx(tension_n + 1e5 * STRETCHED_M**2, rel=1e-9), world
    assert after["limits"]["compiled"] != before["limits"]["compiled"], "learning on the rail"


def test_a_new_limit(tree: Path, before: dict[str, Any]) -> None:
    old = "    h, maximum = limiter.period_s, limiter.max_m_s2\n"
    after = with_patch(tree, "motion/braking.py", old, f"    command_m_s2 = max(-0.5, min(0.5, command_m_s2))\n{old}")
    was, now = before["limits"], after["limits"]
    for engine in ("many", "rail", "dart"):
        assert was[engine] > 0.15
        assert now[engine] / was[engine] == pytest.approx(0.5 / LARGEST_M_S2, rel=0.1), engine
    assert (was["catch"], now["catch"]) == (8.0, 0.5)
    assert now["planner"] != was["planner"]
    assert now["compiled"] != was["compiled"]
