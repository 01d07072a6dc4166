"""The public names for parts of others: each is there, light to ask for, and all that docs and examples need."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from kendama_cli import extension
from kendama_cli.pipeline.code import FileIndex, read_code
from kendama_cli.schema.public_names import homes

ROOT = Path(__file__).resolve().parents[2]
BENCH = sorted((ROOT / "examples" / "bench").rglob("*.py"))
SPRINGS = sorted((ROOT / "examples" / "springs").rglob("*.py"))
LEARNER = sorted((ROOT / "examples" / "course" / "exercises" / "8-your-own-learner").rglob("*.py"))
PUBLIC = {"kendama_cli", "kendama_cli.extension", "kendama_cli.gym", "kendama_cli.conformance"}


def test_every_public_name_is_the_object_of_its_module_and_stands_once() -> None:
    for name, module in homes().items():
        assert getattr(extension, name) is getattr(importlib.import_module(module), name)
    assert set(dir(extension)) == set(homes())
    assert Path(extension.__file__).read_text().count("\n    from ") == len(homes()), "a name stands twice"


def test_every_public_name_says_what_it_is() -> None:
    assert [name for name in homes() if not (getattr(extension, name).__doc__ or "").strip()] == []


def test_a_name_that_is_not_public_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Variand'"):
        extension.Variand  # noqa: B018


def test_declarations_settings_and_errors_import_nothing_heavy() -> None:
    probe = (
        "import sys; from kendama_cli.extension import ("
        "CameraRig, ConfigError, HardwareError, Headline, Stage, StageDeclaration, Variant, setting);"
        "print(sorted({'numpy', 'typer', 'hydra', 'pandas', 'cv2', 'dartpy', 'numba', 'scipy'} & set(sys.modules)))"
    )
    assert subprocess.check_output([sys.executable, "-c", probe], text=True) == "[]\n"


def imported(source: str) -> Iterator[str]:
    """Yield the modules of ours that a source imports."""
    for node in ast.walk(ast.parse(source)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        yield from (name for name in names if name.partition(".")[0] == "kendama_cli")


@pytest.mark.parametrize(
    "path",
    [*BENCH, *SPRINGS, *LEARNER, *sorted((ROOT / "examples").glob("*.py"))],
    ids=lambda path: f"{path.parent.name}/{path.name}",
)
def test_examples_import_public_modules_only(path: Path) -> None:
    of_a_plugin = {"kendama_cli.plugins.interact.extension"} if path in SPRINGS else set()
    assert set(imported(path.read_text())) <= PUBLIC | of_a_plugin


def test_the_example_package_shows_parts_by_public_names() -> None:
    named = {
        alias.name
        for path in BENCH
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom) and node.module == "kendama_cli.extension"
        for alias in node.names
    }
    assert named >= {"Variant", "setting", "StageDeclaration", "RobotState", "LearnerMaker", "drawing"}


@pytest.mark.parametrize(
    ("line", "counted", "not_counted"),
    [
        ("from kendama_cli.extension import play", "motion/dmp/primitive.py", "learning/reward.py"),
        ("from kendama_cli.extension import Variant", "schema/registry.py", "motion/dmp/primitive.py"),
        ("import kendama_cli.extension", "learning/reward.py", "extension.py"),
        ("from kendama_cli import extension", "motion/dmp/primitive.py", "extension.py"),
        ("from kendama_cli.extension import *", "motion/dmp/primitive.py", "extension.py"),
    ],
)
def test_the_code_behind_a_public_name_counts_for_a_strangers_stage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, counted: str, not_counted: str
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    name = f"stranger{abs(hash(line))}"
    (tmp_path / f"{name}.py").write_text(line + "\n")
    importlib.invalidate_caches()
    digests = read_code([f"{name}:Stage"], FileIndex(tmp_path / "index.json")).digests
    assert f"kendama_cli/{counted}" in digests
    assert f"kendama_cli/{not_counted}" not in digests
