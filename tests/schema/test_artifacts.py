"""Any artifact that can be declared comes back as it was; what cannot be distinguished is refused as declared."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from typing_extensions import TypeAliasType, TypeVar

from kendama_cli.errors import StageError
from kendama_cli.schema.artifacts import artifact_type
from kendama_cli.store.codecs import load_artifact, save_artifact


@dataclass(frozen=True)
class Leaf:
    name: str
    share: float
    n: int
    flag: bool


@dataclass(frozen=True)
class Circle:
    kind: Literal["circle"]
    radius: float


@dataclass(frozen=True)
class Ball:
    kind: Literal["ball", "sphere"]
    radius: float


@dataclass(frozen=True)
class Tree:
    leaf: Leaf | None
    children: tuple[Tree, ...]
    shape: Circle | Ball | Leaf | None
    values: npt.NDArray[np.float64] | float
    any_array: np.ndarray
    pair: tuple[int, str]
    by_name: Mapping[str, Leaf | int | None]
    by_number: dict[int, tuple[float, ...]]
    scalar: Annotated[int | float | str | bool | None, "of any type"]
    choice: Literal["fast", 3]


FLOATS = st.floats()
TEXT = st.text(max_size=8)
LEAVES = st.builds(Leaf, TEXT, FLOATS, st.integers(), st.booleans())
SHAPES = st.one_of(
    st.none(),
    LEAVES,
    st.builds(Circle, st.just("circle"), FLOATS),
    st.builds(Ball, st.sampled_from(["ball", "sphere"]), FLOATS),
)
FLOAT_ARRAYS = hnp.arrays(np.float64, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3))
ARRAYS = st.one_of(
    FLOAT_ARRAYS,
    hnp.arrays(st.sampled_from([np.dtype(np.int8), np.dtype(bool), np.dtype("<U3")]), hnp.array_shapes(max_side=3)),
)


def trees(children: st.SearchStrategy[tuple[Tree, ...]]) -> st.SearchStrategy[Tree]:
    return st.builds(
        Tree,
        leaf=st.none() | LEAVES,
        children=children,
        shape=SHAPES,
        values=FLOAT_ARRAYS | FLOATS,
        any_array=ARRAYS,
        pair=st.tuples(st.integers(), TEXT),
        by_name=st.dictionaries(TEXT, st.none() | st.integers() | LEAVES, max_size=3),
        by_number=st.dictionaries(st.integers(), st.lists(FLOATS, max_size=2).map(tuple), max_size=3),
        scalar=st.none() | st.booleans() | st.integers() | FLOATS | TEXT,
        choice=st.sampled_from(["fast", 3]),
    )


def same(one: Any, other: Any) -> bool:
    """Equal in every type, bit of an array, sign of a zero."""
    if type(one) is not type(other):
        return False
    if dataclasses.is_dataclass(one):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in dataclasses.fields(one))
    if isinstance(one, np.ndarray):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return repr(one) == repr(other)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(tree=trees(st.lists(trees(st.just(())), max_size=2).map(tuple)))
def test_random_artifacts_come_back_as_they_were_and_twice_to_the_same_bytes(tmp_path: Path, tree: Tree) -> None:
    assert artifact_type(f"{__name__}:Tree", "stage 'toy'") is Tree
    files = []
    for _ in range(2):
        for old in tmp_path.iterdir():
            old.unlink()
        save_artifact(Tree, tree, tmp_path)
        files.append({file.name: file.read_bytes() for file in tmp_path.iterdir()})
    assert files[0] == files[1]
    assert same(load_artifact(Tree, tmp_path), tree)


def test_numpys_numbers_and_whole_numbers_become_what_is_declared(tmp_path: Path) -> None:
    given_leaf: Any = Leaf("a", np.float32(0.5), np.int64(3), np.bool_(True))  # type: ignore[arg-type]
    save_artifact(Leaf, given_leaf, tmp_path)
    assert same(load_artifact(Leaf, tmp_path), Leaf("a", 0.5, 3, True))
    save_artifact(Leaf, Leaf("a", 1, 3, True), tmp_path)
    assert same(load_artifact(Leaf, tmp_path), Leaf("a", 1.0, 3, True))


S = TypeVar("S", bound=np.generic)
# numpy's NDArray is such an alias from 2.5 on, which wants Python 3.12
ArrayAlias = TypeAliasType("ArrayAlias", np.ndarray[tuple[Any, ...], np.dtype[S]], type_params=(S,))
LeafAlias = TypeAliasType("LeafAlias", Leaf | None)


@dataclass(frozen=True)
class Aliased:
    values: ArrayAlias[np.float64]
    leaf: LeafAlias


def test_an_alias_of_a_type_statement_is_what_it_stands_for(tmp_path: Path) -> None:
    assert artifact_type(f"{__name__}:Aliased", "stage 'toy'") is Aliased
    for made in (Aliased(np.arange(3.0), Leaf("a", 0.5, 3, True)), Aliased(np.zeros((0, 2)), None)):
        save_artifact(Aliased, made, tmp_path)
        assert same(load_artifact(Aliased, tmp_path), made)
    with pytest.raises(StageError, match="'values' is"):
        save_artifact(Aliased, Aliased(np.arange(3), None), tmp_path)  # whole numbers


@pytest.mark.parametrize(
    ("leaf", "says"),
    [
        (Leaf(3, 0.5, 3, True), "its 'name' is a int, declared str"),  # type: ignore[arg-type]
        (Leaf("a", "b", 3, True), "its 'share' is a str, declared float"),  # type: ignore[arg-type]
        (Leaf("a", 0.5, True, True), "its 'n' is a bool, declared int"),
        (Leaf("\udc80", 0.5, 3, True), "surrogates not allowed"),
    ],
)
def test_a_field_that_is_not_what_it_is_declared_to_be_is_named(tmp_path: Path, leaf: Leaf, says: str) -> None:
    with pytest.raises(StageError, match="stage 'toy' returned a Leaf that cannot be stored: ") as caught:
        save_artifact(Leaf, leaf, tmp_path, "stage 'toy'")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@dataclass(frozen=True)
class Other:
    name: str
    share: float
    n: int
    flag: bool


@dataclass(frozen=True)
class Alike:
    one: Leaf | Other


@dataclass(frozen=True)
class TwoTuples:
    one: tuple[int, ...] | tuple[str, ...]


@dataclass(frozen=True)
class Loose:
    one: Any


@dataclass(frozen=True)
class Keyed:
    one: Mapping[tuple[int, int], str]


@dataclass
class Melting:
    one: int


@dataclass(frozen=True)
class Within:
    one: tuple[Melting, ...]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        (
            "Alike",
            "whose field 'one' may be a Leaf or a Other: these cannot be distinguished; give both a field 'kind'",
        ),
        ("TwoTuples", "may be a tuple[int, ...] or a tuple[str, ...]: these cannot be distinguished"),
        ("Loose", "whose field 'one' is declared Any; an artifact holds frozen dataclasses, arrays"),
        ("Keyed", "whose field 'one' has keys of type tuple[int, int]; allowed: numbers and strings"),
        ("Melting", "which is no frozen dataclass; make it one"),
        ("Within", "whose field 'one.*' is declared Melting; an artifact holds"),
    ],
)
def test_what_cannot_be_stored_is_refused_when_it_is_declared(name: str, says: str) -> None:
    with pytest.raises(StageError) as caught:
        artifact_type(f"{__name__}:{name}", "stage 'toy'")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
