"""The plan holds: imports go down, files are short, only render prints, no pickle, values live in conf/ alone."""

from __future__ import annotations

import ast
import dataclasses
import functools
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import LONGEST_FIRST

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "kendama_cli"
FILES = sorted(PACKAGE.rglob("*.py"))
ENVIRONMENTS = PACKAGE / "plugins" / "agents" / "environments"
ACTING = (PACKAGE, ENVIRONMENTS, PACKAGE / "robot_model" / "display")
"""Packages that act when they are imported, as their docstrings say."""


def test_imports_go_down_the_floors_only() -> None:
    script = Path(sys.executable).parent / "lint-imports"
    done = subprocess.run([script, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@functools.cache
def libraries(file: Path) -> set[str]:
    """What ``file`` imports anywhere, by the first part of its name."""
    nodes = list(ast.walk(ast.parse(file.read_text())))
    whole = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    parts = {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    return {name.split(".")[0] for name in whole | parts}


@pytest.mark.parametrize(
    ("library", "folders"),
    [
        ("hydra", {"config"}),
        ("omegaconf", {"config"}),
        ("dartpy", {"robot_model", "simulation"}),
        ("typer", {"cli"}),
        ("rich", {"cli"}),
        ("cv2", {"vision", "devices", "rendering", "report", "stages"}),
        ("matplotlib", {"report", "stages"}),
        ("numba", {"system"}),
        ("distributed", set()),
        ("dask_jobqueue", set()),
        ("obstore", set()),
        ("embreex", {"rendering"}),
        ("gymnasium", {"api.py"}),  # there for its types alone
        ("socket", {"devices", "system"}),
        ("subprocess", {"devices", "pipeline", "system", "cli"}),
        ("fcntl", {"system"}),
        ("filelock", {"system"}),
    ],
)
def test_a_library_lives_in_its_own_folders_only(library: str, folders: set[str]) -> None:
    found = {file.relative_to(PACKAGE).parts[0] for file in FILES if library in libraries(file)}
    assert found - {"plugins"} <= folders


def test_the_core_names_no_plug_in() -> None:
    """No text does either: parts come by entry points, as a stranger's do."""
    named = [file.relative_to(PACKAGE).as_posix() for file in FILES if "kendama_cli.plugins" in file.read_text()]
    names_in_records = "schema/renames.py"  # what homes of older versions hold, and what it is called today
    assert [name for name in named if not name.startswith("plugins/") and name != names_in_records] == []


WITH_PARTS = {
    "adaptation/lab_table.py",
    "architecture/laws_probe.py",
    "benchmarks/kept_servo.py",
    "benchmarks/led_games.py",
    "benchmarks/menagerie.py",
    "benchmarks/menagerie_games.py",
    "benchmarks/play.py",
    "faults/readers.py",
    "films/table.py",
}
"""They hold laws of core and parts together, or time or judge a part."""
SUITES = "from kendama_cli.plugins.suites"
"""The core's own variants keep the laws of their interfaces too."""


def test_the_cores_tests_import_no_plug_in() -> None:
    plugged = ("from kendama_cli.plugins", "import kendama_cli.plugins", "from tests.plugins")
    tests = {file.relative_to(ROOT / "tests").as_posix(): file for file in (ROOT / "tests").rglob("*.py")}
    lines = {name: file.read_text().splitlines() for name, file in tests.items() if not name.startswith("plugins/")}
    found = {
        name
        for name, text in lines.items()
        if any(line.lstrip().startswith(plugged) and not line.lstrip().startswith(SUITES) for line in text)
    }
    assert found == WITH_PARTS


def test_numerics_know_no_clock_no_global_seed_and_no_files() -> None:
    for folder in ("motion", "learning", "vision"):
        for file in (PACKAGE / folder).rglob("*.py"):
            text = file.read_text()
            for word in ("import time", "np.random.seed", "np.random.rand", "open(", "logging"):
                assert word not in text, f"{file.name} has {word}"


def test_what_only_linux_has_stands_in_the_files_of_linux() -> None:
    words = (
        "fcntl",
        "prctl",
        "os.fork",
        "waitpid",
        "send_fds",
        "recv_fds",
        "SEQPACKET",
        "AF_UNIX",
        "os.killpg",
        "SIGKILL",
    )
    linux = {PACKAGE / "system" / name for name in ("linux.py", "fork_server.py")}
    assert [file.name for file in FILES for word in words if word in file.read_text() and file not in linux] == []


def test_no_pickle_anywhere() -> None:
    for file in FILES:
        assert "import pickle" not in file.read_text(), file
        assert "allow_pickle=True" not in file.read_text(), file
        assert list(pickled_by_a_pipe(file.read_text())) == [], file


def pickled_by_a_pipe(source: str) -> Iterator[str]:
    """Where a file with ``multiprocessing`` says or hears what its pipes and queues pickle."""
    if "multiprocessing" not in source:
        return
    for node in ast.walk(ast.parse(source)):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
            continue
        if node.func.attr in ("send", "recv", "Queue", "SimpleQueue", "Manager", "Listener", "Client"):
            yield f"line {node.lineno}: {ast.unparse(node.func)}"


def test_what_a_pipe_pickles_is_found() -> None:
    begin = "from multiprocessing.connection import Connection\nline = Connection(3)\n"
    assert list(pickled_by_a_pipe(begin + "line.send(1)\nline.recv()")) == ["line 3: line.send", "line 4: line.recv"]
    assert list(pickled_by_a_pipe(begin + "line.send_bytes(b'1')\nline.recv_bytes()")) == []
    assert list(pickled_by_a_pipe("import socket\nsocket.socket().send(b'1')")) == []


def test_package_files_say_what_the_folder_is_or_declare_its_stage() -> None:
    """Every module below a package imports its ``__init__``, so what else stands there is in the key of each."""
    for file in PACKAGE.rglob("__init__.py"):
        if file.parent in ACTING:
            continue
        for node in ast.parse(file.read_text()).body:
            says = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
            declares = isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("StageDeclaration(")
            assert says or declares or isinstance(node, ast.ImportFrom), f"{file}:{node.lineno}"


def test_declarations_import_nothing_heavy() -> None:
    for file in [*PACKAGE.rglob("__init__.py"), *PACKAGE.rglob("variants.py")]:
        if file.parent in ACTING:
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert name.split(".")[0] in {*sys.stdlib_module_names, "kendama_cli"}, f"{file}: {name}"


def test_importing_every_declaration_imports_nothing_heavy() -> None:
    probe = (
        "import sys; from kendama_cli.schema.declaration import find_stage, stage_names;"
        "from kendama_cli.pipeline.nodes import node_schemas;"
        "found = [find_stage(name).name for name in stage_names()]; schemas, broken = node_schemas();"
        "heavy = {'numpy', 'typer', 'hydra', 'pandas', 'cv2', 'dartpy', 'numba', 'scipy', 'google', 'yaml'};"
        "print(len(found), len(schemas), broken, sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.split(maxsplit=2) == ["13", "23", "None []\n"]


def test_every_declared_target_is_there() -> None:
    from kendama_cli.schema import declaration, registry  # noqa: PLC0415

    for name in declaration.stage_names():
        stage = declaration.find_stage(name)
        assert stage is not None
        for target in (stage.run, stage.returns, stage.chapter, stage.film):
            assert target is None or registry.resolve(target, name) is not None
        assert stage.run.startswith((f"kendama_cli.stages.{name}.", "kendama_cli.plugins."))


def assigned_outside_init(source: str, name: str) -> set[str]:
    """Return the attributes of ``self`` that the class ``name`` assigns in a method other than its constructor."""
    (made,) = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef) and node.name == name]
    methods = [one for one in made.body if isinstance(one, ast.FunctionDef) and one.name != "__init__"]
    targets = (node for method in methods for node in ast.walk(method) if isinstance(node, ast.Attribute))
    return {
        node.attr
        for node in targets
        if isinstance(node.ctx, ast.Store) and isinstance(node.value, ast.Name) and node.value.id == "self"
    }


def test_a_stage_never_changes_its_own_settings() -> None:
    from kendama_cli.schema import declaration  # noqa: PLC0415

    for name in declaration.stage_names():
        stage = declaration.find_stage(name)
        assert stage is not None
        module, found = stage.run.split(":")
        assert not assigned_outside_init((ROOT / f"{module.replace('.', '/')}.py").read_text(), found), name
    changing = "class A:\n    def run(self):\n        self._game, other = 1, 2"
    assert assigned_outside_init(changing, "A") == {"_game"}


def test_settings_have_no_defaults_so_that_values_live_in_conf_alone() -> None:
    from kendama_cli.pipeline import nodes  # noqa: PLC0415
    from kendama_cli.schema import settings as schema  # noqa: PLC0415

    seen = 0
    found, _ = nodes.node_schemas()
    waiting = [kind for node in found.values() for kind in schema.variants(node).values()]
    while waiting:
        kind = waiting.pop()
        for field in dataclasses.fields(kind):
            absent = field.metadata.get("absent", dataclasses.MISSING)  # for older files and code alone
            assert field.default is absent, f"{kind.__name__}.{field.name}"
            assert field.default_factory is dataclasses.MISSING, f"{kind.__name__}.{field.name}"
            seen += 1
    assert seen > 40


def test_nothing_tracked_is_generated_or_large() -> None:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    for name in filter(None, listed.stdout.split("\0")):
        assert (ROOT / name).stat().st_size < 1_000_000, name
        assert not name.endswith((".pyc", ".mcap", ".npz")), name


def test_the_files_that_begin_the_suite_are_there() -> None:
    assert [name for name in LONGEST_FIRST if not (ROOT / "tests" / name).is_file()] == []
