"""A change of code that may change a result changes the code's digest; what cannot be known is told."""

from __future__ import annotations

import importlib
import itertools
import json
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

import kendama_cli
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.code import Code, FileIndex, code_digest, read_code
from kendama_cli.pipeline.code_syntax import read_syntax
from kendama_cli.schema import registry
from tests.toy_project import ToyProject, statuses

Read = Callable[..., Code]
NUMBER = itertools.count()
CHECKED = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    {}\nelse:\n    {}\n"


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Read:
    """Lay out files, each PKG in them a name of this test's own, and read the code of PKG.stage."""
    monkeypatch.syspath_prepend(tmp_path)
    name = f"lab{next(NUMBER)}x"

    def reading(files: Mapping[str, str | None], *targets: str, is_named: bool = False) -> Code:
        for path, text in files.items():
            file = tmp_path / path.replace("PKG", name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.unlink(missing_ok=True)
            if text is not None:
                file.write_text(text.replace("PKG", name))
        importlib.invalidate_caches()
        index = FileIndex(tmp_path / "index.json")
        named = [one.replace("PKG", name) for one in targets or ("PKG.stage:Stage",)]
        code = read_code(named, index, is_named=is_named)
        assert {place: code_digest(place, index) for place in code.digests} == code.digests, "as a worker reads it"
        return Code({place.replace(name, "PKG"): one for place, one in code.digests.items()}, code.unknown)

    return reading


@pytest.mark.parametrize(
    ("stage", "changed"),
    [
        (CHECKED.format("pass", "from PKG.fast import G"), "PKG/fast.py"),
        ("import typing\nif not typing.TYPE_CHECKING:\n    import PKGtools\n", "PKGtools/__init__.py"),
        ("if 1:\n    pass\nelif 2:\n    import PKGtools.deep\n", "PKGtools/deep.py"),
        ("def f():\n    with open('x'):\n        from PKGtools import deep\n", "PKGtools/deep.py"),
        ("import importlib\nG = importlib.import_module('PKGtools.deep')\n", "PKGtools/deep.py"),
        ("from importlib import import_module as get\nG = get(name='PKGtools')\n", "PKGtools/__init__.py"),
        ("G = __import__('PKGtools')\n", "PKGtools/__init__.py"),
        ("from importlib import import_module\ndef f(n): return import_module(f'PKGtools.{n}')\n", "PKGtools/deep.py"),
        ("import PKGspace.deep\n", "PKGspace/other.json"),
        ("from importlib.resources import files\nG = files('PKGtools').joinpath('gain.txt')\n", "PKGtools/gain.txt"),
        ("import pkgutil\nG = pkgutil.get_data('PKGtools', 'deep/gain.bin')\n", "PKGtools/deep/gain.bin"),
        ("import PKGlone\n", "PKGlone.py"),
        ("import PKGlone\n", "PKGgains.json"),
        ("", "PKG/gain.json"),
        ("", "PKG/deep/er/gain.npz"),
        ("", "PKG/_core.cpython-311-x86_64-linux-gnu.so"),
        ("", "PKG/chapter.py"),
        ("", "PKG/stage.pyx"),
    ],
)
@pytest.mark.parametrize("package", [{"PKG/__init__.py": ""}, {}], ids=["package", "namespace"])
def test_whatever_a_strangers_stage_may_read_of_its_own_counts(
    read: Read, package: dict[str, str], stage: str, changed: str
) -> None:
    files = {**package, "PKG/stage.py": stage, "PKGtools/__init__.py": "", "PKGtools/deep.py": ""}
    files |= {"PKGlone.py": "", "PKGspace/deep.py": ""}
    before = read({**files, changed: "1"})
    after = read({changed: "2"})
    place = "PKGlone/PKGgains.json" if changed == "PKGgains.json" else changed
    assert {one for one, digest in after.digests.items() if before.digests.get(one) != digest} == {place}
    assert before.unknown == []


@pytest.mark.parametrize(
    ("before", "after", "same"),
    [
        ('"""1"""\nG = float(__doc__)\n', '"""2"""\nG = float(__doc__)\n', False),
        (CHECKED.format("G = 0", "G = 1"), CHECKED.format("G = 0", "G = 2"), False),
        ("class StageDeclaration(dict): pass\nX = StageDeclaration(g=1)\n",) * 2 + (True,),
        ("class StageDeclaration(dict): pass\nX = StageDeclaration(g=1)\n", "X = StageDeclaration(g=2)\n", False),
        ("G = 0.0\n", "G = -0.0\n", False),
        ("G = 1\n", "G = True\n", False),
        ("G = 1\n", "# a comment\n\nG = (1)\n", True),
    ],
)
def test_a_strangers_module_counts_but_for_comments_and_blank_lines(
    read: Read, before: str, after: str, *, same: bool
) -> None:
    assert (read({"PKG/stage.py": before}).digests == read({"PKG/stage.py": after}).digests) is same


@pytest.mark.parametrize(
    ("stage", "unknown"),
    [
        ("import PKGnowhere\n", "(line 1) imports 'PKGnowhere', which cannot be found"),
        ("def f():\n    import PKG.nowhere\n", "(line 2) imports 'PKG.nowhere', which cannot be found"),
        ("from importlib import import_module\nimport_module('PKGnowhere')\n", "(line 2) imports 'PKGnowhere'"),
        ("from importlib import import_module\ndef f(n): return import_module(n)\n", "(line 2) imports a module by a"),
        ("import runpy\nrunpy.run_path('x.py')\n", "(line 2) imports a module by a computed name"),
        ("try:\n    import PKGnowhere\nexcept ValueError:\n    pass\n", "(line 2) imports 'PKGnowhere'"),
    ],
)
def test_an_import_that_cannot_be_followed_is_reported(read: Read, stage: str, unknown: str) -> None:
    (told,) = read({"PKG/__init__.py": "", "PKG/stage.py": stage}).unknown
    assert ".stage (line" in told
    assert unknown.partition(" ")[0] in told
    assert unknown.split("imports")[1].split("'", maxsplit=1)[0] in told


@pytest.mark.parametrize(
    "stage",
    [
        *(
            f"from importlib import import_module\ndef f(n): return import_module({name})\n"
            for name in ("f'PKG.{n}'", "'.' + n, 'PKG'", "f'{__package__}.{n}'", "'PKG.%s' % n", "'PKG.{}'.format(n)")
        ),
        "import numpy, json, winreg, numpy.not_there\nfrom numpy import anything\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import PKGnowhere\n",
        "from PKG import anything\n",
    ],
)
def test_an_import_that_stays_in_the_package_or_is_of_a_library_is_no_doubt(read: Read, stage: str) -> None:
    assert read({"PKG/__init__.py": "", "PKG/stage.py": stage}).unknown == []


@pytest.mark.parametrize(
    "guard", ["try:\n    {}\nexcept ImportError:\n    pass\n", "with suppress(ImportError):\n    {}\n"]
)
def test_an_optional_package_counts_by_its_absence(read: Read, guard: str) -> None:
    before = read({"PKG/stage.py": guard.format("import PKGmaybe")})
    assert before.unknown == []
    after = read({"PKGmaybe/__init__.py": ""})
    assert before.digests.keys() ^ after.digests.keys() == {"PKGmaybe (not installed)", "PKGmaybe/__init__.py"}


def test_a_declaration_names_further_packages(read: Read) -> None:
    files = {"PKG/stage.py": "from importlib import import_module\ndef f(n): return import_module(n)\n"}
    installed = {"site-packages/PKGtools/__init__.py": "", "site-packages/PKGtools/gain.json": "1"}
    assert read({**files, **installed}).unknown != []
    named = read(files, "PKG.stage:Stage", "PKG", is_named=True)
    assert named.unknown == []
    with pytest.raises(UsageError, match=r"module 'lab\d+xnowhere' is not installed"):
        read(files, "PKG.stage:Stage", "PKGnowhere")


def test_a_library_counts_where_a_declaration_names_it(
    read: Read, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path / "site-packages")
    files = {"PKG/stage.py": "import PKGtools\n", "site-packages/PKGtools/__init__.py": "G = 1\n"}
    assert set(read(files).digests) == {"PKG/stage.py"}
    assert set(read(files, "PKG.stage", "PKGtools").digests) == {"PKG/stage.py", "PKGtools/__init__.py"}


def test_every_file_of_an_installed_distribution_counts(
    read: Read, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "lib" / "site-packages"
    monkeypatch.syspath_prepend(site)
    kept = ["lab/stage.py", "lab/__init__.py", "labtools/gain.py", "labdata.bin", "../../share/lab/gain.json"]
    left = [
        "../../bin/lab",
        "lab-1.dist-info/METADATA",
        "lab/__pycache__/stage.cpython-311.pyc",
        "__editable__.lab.pth",
    ]
    for name in (*kept, *left):
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text("G = 1\n")
    (site / "lab-1.dist-info/METADATA").write_text("Metadata-Version: 2.1\nName: lab\nVersion: 1\n")
    (site / "lab-1.dist-info/RECORD").write_text("".join(f"{name},,\n" for name in (*kept, *left)))
    (site / "lab-1.dist-info/entry_points.txt").write_text("[kendama.stages]\nlab = lab.stage:STAGE\n")
    registry._entry_points.cache_clear()
    try:
        found = set(read({}, "lab.stage:Stage").digests)
    finally:
        registry._entry_points.cache_clear()
    assert found == {*kept[:2], *(f"lab (distribution)/{name}" for name in kept[2:])}


def test_links_in_a_package_are_followed_once(read: Read, tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data/gain.json").write_text("1")
    code = read({"PKG/stage.py": ""})
    package = next(tmp_path.glob("lab*x"))
    (package / "data").symlink_to(tmp_path / "data")
    (package / "again").symlink_to(package)
    os.mkfifo(package / "pipe")
    assert read({}).digests.keys() - code.digests.keys() == {"PKG/data/gain.json"}


def test_of_ours_comments_docstrings_declarations_and_types_do_not_count_and_anything_else_does(tmp_path: Path) -> None:
    def digest(text: str) -> object:
        (tmp_path / "x.py").write_text(text)
        return read_syntax(tmp_path / "x.py", "kendama_cli.x", is_ours=True)[0]

    plain = digest("def f(x=1):\n    return x\n")
    assert digest('"""Doc."""\n# comment\ndef f(x=1):\n    """Doc."""\n    return x\n') == plain
    assert digest("def f(x=1):\n    return x\nSTAGE = StageDeclaration(title='x')\n") == plain
    assert digest("if TYPE_CHECKING:\n    import numpy\ndef f(x=1):\n    return x\n") == plain
    assert digest("if TYPE_CHECKING:\n    import numpy\nelse:\n    G = 1\ndef f(x=1):\n    return x\n") != plain
    assert digest("def f(x=2):\n    return x\n") != plain
    declared = digest("class S:\n    a_m: float = setting('length [m]', above=0)\n")
    assert digest("class S:\n    a_m: float = setting('rope [m]' 'long', above=0)\n") == declared
    assert digest("class S:\n    a_m: float = setting('length [m]', above=1)\n") != declared


def test_nothing_of_ours_reads_docstrings_or_imports_by_name_where_the_digest_does_not_look() -> None:
    ours = Path(kendama_cli.__file__).parent
    named = (
        "schema/registry.py",
        "__init__.py",
        "extension.py",
        "plugins/help/docs.py",
        "plugins/help/doctor.py",
        "plugins/agents/environments/__init__.py",
        "plugins/course/grading.py",
        "pipeline/code_syntax.py",
    )
    libraries = ("plugins/franka/process.py", "devices/recordings/mcap_poses.py")
    for file in ours.rglob("*.py"):
        text = file.read_text()
        assert "__doc__" not in text, file
        if file.relative_to(ours).as_posix() not in (*named, *libraries):
            assert "import_module" not in text, file


def test_data_beside_a_module_of_ours_counts(tmp_path: Path) -> None:
    code = read_code(["kendama_cli.robot_model.display"], FileIndex(tmp_path / "index.json"))
    assert "kendama_cli/robot_model/display/symbols.txt" in code.digests
    assert "kendama_cli/robot_model/display/libGL-x86_64.so" in code.digests


def test_a_stage_whose_code_cannot_be_known_runs_each_time_and_says_why(toy: ToyProject) -> None:
    total = toy.folder / "lib/toy/total.py"
    total.write_text(
        f"from importlib import import_module\ndef later(n):\n    return import_module(n)\n{total.read_text()}"
    )
    for _ in range(2):
        assert statuses(toy.run_json()) != {"roll": "cached", "total": "cached"}
    assert statuses(toy.run_json()) == {"roll": "cached", "total": "ran"}
    stages = json.loads(toy.kendama("plan", "-p", "toy", "--json").stdout)["stages"]
    assert stages[1]["reasons"] == [
        "never cached: toy.total (line 3) imports a module by a computed name: name its package in the declaration"
    ]
    total.write_text(total.read_text().replace("topics={},", 'topics={}, packages=("toy",),'))
    toy.run_json()
    assert statuses(toy.run_json()) == {"roll": "cached", "total": "cached"}


def test_a_data_file_of_another_package_reruns_its_stages(toy: ToyProject) -> None:
    toy.run_json()
    (toy.folder / "lib/toy/roll/table.json").write_text("[1]")
    plan = json.loads(toy.kendama("plan", "-p", "toy", "--json").stdout)["stages"][0]
    assert plan["reasons"] == ["code toy/roll/table.json changed"]
    shutil.rmtree(toy.home)
    toy.run_json()
    assert statuses(toy.run_json()) == {"roll": "cached", "total": "cached"}
