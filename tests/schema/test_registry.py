"""Settings of parts that other packages bring: found by entry point, built by kind, imported only when chosen."""

from __future__ import annotations

import importlib.metadata
import sys
import textwrap
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Protocol

import pytest

from kendama_cli.errors import ConfigError, MissingPartError
from kendama_cli.schema import registry
from kendama_cli.schema.registry import Registry
from kendama_cli.schema.settings import build, build_value, chosen, setting, variants

SHAPES = Registry("toy.shapes", "shape")


class Shape(Protocol):
    """Interface of a shape."""

    def area_m2(self) -> float: ...


@dataclass(frozen=True)
class Drawing:
    name: str = setting("what it is called")
    shape: Annotated[Shape, SHAPES] = setting("its shape")
    hole: Annotated[Shape, SHAPES] | None = setting("what is cut out")
    more: tuple[Annotated[Shape, SHAPES], ...] = setting("other shapes")
    side: Annotated[float, "no registry"] = setting("side [m]", above=0)


SETTINGS = """
from dataclasses import dataclass
from typing import Literal
from kendama_cli.schema.settings import setting

@dataclass(frozen=True)
class {name}Settings:
    kind: Literal["{kind}"]
    size_m: float = setting("size [m]", above=0)
"""
DECLARATIONS = """
from kendama_cli.schema.registry import Variant

ROUND = Variant("round", "toy_round:RoundSettings", "toy_round:make")
SQUARE = Variant("square", "toy_square:SquareSettings", "toy_square:make")
LOST = Variant("lost", "toy_nowhere:LostSettings", "toy_nowhere:make")
MISNAMED = Variant("other", "toy_round:RoundSettings", "toy_round:make")
"""


def forget() -> None:
    """Have installed packages looked at again."""
    registry._entry_points.cache_clear()
    registry.declared.cache_clear()


@pytest.fixture
def shapes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package on the path that declares shapes as an installed one does."""
    (tmp_path / "toy_shapes.py").write_text(textwrap.dedent(DECLARATIONS))
    (tmp_path / "toy_round.py").write_text(SETTINGS.format(name="Round", kind="round"))
    (tmp_path / "toy_square.py").write_text(SETTINGS.format(name="Square", kind="square"))
    info = tmp_path / "toy_shapes-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-shapes\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[toy.shapes]\nround = toy_shapes:ROUND\nsquare = toy_shapes:SQUARE\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    forget()
    yield tmp_path
    forget()
    for module in ("toy_shapes", "toy_round", "toy_square"):
        sys.modules.pop(module, None)


def declare(folder: Path, *lines: str) -> None:
    """Declare ``lines`` in place of the shapes' entry points."""
    (folder / "toy_shapes-1.0.dist-info" / "entry_points.txt").write_text("\n".join(["[toy.shapes]", *lines]))
    forget()


GOOD: dict[str, Any] = {
    "name": "cup",
    "shape": {"kind": "round", "size_m": 1},
    "hole": None,
    "more": [{"kind": "round", "size_m": 2}],
    "side": 3,
}


def test_the_kind_chooses_the_settings_and_imports_those_alone(shapes: Path) -> None:
    made: Any = build(Drawing, GOOD, "drawing")
    assert (type(made.shape).__name__, made.shape.size_m, made.hole) == ("RoundSettings", 1.0, None)
    assert made.more[0].size_m == 2.0
    assert "toy_square" not in sys.modules
    cut: Any = build(Drawing, {**GOOD, "hole": {"kind": "square", "size_m": 2}}, "drawing")
    assert type(cut.hole).__name__ == "SquareSettings"


def test_a_whole_node_may_be_a_registry(shapes: Path) -> None:
    made = build_value(SHAPES, {"kind": "square", "size_m": 2}, "shape")
    assert made.size_m == 2.0


def test_variants_of_a_registry_are_listed_by_kind(shapes: Path) -> None:
    hint = Annotated[Shape, SHAPES]
    assert {kind: found.__name__ for kind, found in variants(hint).items()} == {
        "round": "RoundSettings",
        "square": "SquareSettings",
    }
    assert variants(hint) == variants(SHAPES) == variants(hint | None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shape": {"kind": "rond"}}, "'drawing.shape.kind' is 'rond', did you mean 'drawing.shape.kind=round'? "),
        ({"shape": {"size_m": 1}}, "'drawing.shape.kind' is None; allowed: round, square"),
        ({"shape": 3}, "'drawing.shape.kind' is 3; allowed: round, square"),
        ({"hole": {"kind": "oval"}}, "'drawing.hole.kind' is 'oval'; allowed: round, square"),
        ({"shape": {"kind": "round", "size": 1}}, "unknown key 'drawing.shape.size', did you mean"),
        ({"shape": {"kind": "round", "size_m": 0}}, "'drawing.shape.size_m' is 0.0; allowed: above 0"),
        ({"more": [{"kind": "oval"}]}, "'drawing.more[0].kind' is 'oval'; allowed: round, square"),
        ({"side": 0}, "'drawing.side' is 0.0; allowed: above 0"),
    ],
)
def test_what_does_not_fit_is_named_with_what_is_allowed(shapes: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        build(Drawing, {**GOOD, **change}, "drawing")
    assert message in str(caught.value)


def test_the_makers_of_all_chosen_parts_are_known_so_that_their_code_counts(shapes: Path) -> None:
    cut: Any = build(Drawing, {**GOOD, "hole": {"kind": "square", "size_m": 2}}, "drawing")
    assert chosen(Drawing, cut) == [(SHAPES, "round"), (SHAPES, "square"), (SHAPES, "round")]
    assert chosen(Drawing, build(Drawing, GOOD, "drawing")) == [(SHAPES, "round"), (SHAPES, "round")]
    assert chosen(SHAPES, cut.hole) == [(SHAPES, "square")]


def test_a_declaration_whose_module_is_missing_names_the_part(shapes: Path) -> None:
    declare(shapes, "lost = toy_shapes:LOST")
    with pytest.raises(MissingPartError, match="shape 'lost' needs module 'toy_nowhere', which is not installed"):
        build_value(SHAPES, {"kind": "lost"}, "shape")


def test_a_declaration_without_its_object_names_the_entry_point(shapes: Path) -> None:
    declare(shapes, "lost = toy_shapes:NOTHING")
    with pytest.raises(MissingPartError, match="shape 'lost': module 'toy_shapes' has no 'NOTHING'"):
        build_value(SHAPES, {"kind": "lost"}, "shape")


def test_an_entry_point_that_names_another_kind_is_refused(shapes: Path) -> None:
    declare(shapes, "mine = toy_shapes:MISNAMED")
    with pytest.raises(ConfigError, match=r"entry point 'mine' of group toy\.shapes names .*of kind 'mine'"):
        build_value(SHAPES, {"kind": "mine"}, "shape")


def test_a_name_that_two_packages_declare_is_refused(shapes: Path) -> None:
    other = shapes / "other_shapes-1.0.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: other-shapes\nVersion: 1.0\n")
    (other / "entry_points.txt").write_text("[toy.shapes]\nround = elsewhere:ROUND\n")
    forget()
    with pytest.raises(ConfigError, match=r"two packages declare 'round' in entry point group toy\.shapes"):
        SHAPES.kinds()


def test_what_is_installed_is_what_importlib_metadata_finds(shapes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    again = shapes / "later"
    (again / "Toy_Shapes-2.0.dist-info").mkdir(parents=True)
    (again / "Toy_Shapes-2.0.dist-info/METADATA").write_text("Metadata-Version: 2.1\nName: Toy.Shapes\nVersion: 2.0\n")
    (again / "Toy_Shapes-2.0.dist-info/entry_points.txt").write_text("[toy.shapes]\noval = toy_shapes:OVAL\n")
    monkeypatch.setattr(sys, "path", [*sys.path, str(again)])  # the same package once more: the first one counts
    declare(shapes, "# a comment", "", " round=toy_shapes:ROUND", "[toy.others]", "flat = toy_shapes:FLAT [extra]")
    known = importlib.metadata.entry_points()
    theirs = {group: sorted((one.name, one.value) for one in known.select(group=group)) for group in known.groups}
    assert {group: sorted(points) for group, points in registry._entry_points().items()} == theirs
    assert theirs["toy.shapes"] == [("round", "toy_shapes:ROUND")]
    assert "kendama.stages" in theirs


def test_a_package_in_an_archive_is_found(shapes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    archive = shapes / "toys.zip"
    with zipfile.ZipFile(archive, "w") as packed:
        packed.writestr("toys-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n")
        packed.writestr("toys-1.0.dist-info/entry_points.txt", "[toy.shapes]\ncone = toys:CONE\n")
    monkeypatch.setattr(sys, "path", [*sys.path, str(archive)])
    forget()
    assert registry.declared("toy.shapes")["cone"] == "toys:CONE"
