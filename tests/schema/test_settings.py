"""Plain configuration becomes settings, or one line names the key that does not fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import build, input_files, setting


@dataclass(frozen=True)
class Round:
    kind: Literal["round"]
    radius_m: float = setting("radius [m]", above=0, at_most=2)


@dataclass(frozen=True)
class Square:
    kind: Literal["square"]
    side_m: float = setting("side [m]", at_least=0, below=2)


@dataclass(frozen=True)
class Outer:
    count: int = setting("how many", at_least=1)
    name: str = setting("what it is called")
    flag: bool = setting("whether")
    mode: Literal["fast", "exact"] = setting("which way")
    sign: Literal[1, -1] = setting("which sign")
    edges: tuple[float, ...] = setting("edges, rising", above=0)
    pair: tuple[int, int] = setting("two of them")
    shape: Round | Square = setting("its shape")
    path: str | tuple[str, ...] | None = setting("its files", file=True)

    def __post_init__(self) -> None:
        if list(self.edges) != sorted(self.edges):
            raise ConfigError("edges", f"'edges' must rise, not {list(self.edges)}")


GOOD: dict[str, Any] = {
    "count": 2,
    "name": "cup",
    "flag": True,
    "mode": "fast",
    "sign": -1,
    "edges": [1, 2.5],
    "pair": [3, 4],
    "shape": {"kind": "round", "radius_m": 1},
    "path": ["a", "b"],
}


def test_whole_numbers_become_floats_and_lists_tuples() -> None:
    made = build(Outer, GOOD, "outer")
    assert made.edges == (1.0, 2.5)
    assert isinstance(made.edges[0], float)
    assert made.shape == Round(kind="round", radius_m=1.0)
    assert input_files(made) == {"path": ("a", "b")}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cont": 1}, "unknown key 'outer.cont', did you mean 'outer.count'?"),
        ({"zzz": 1}, "unknown key 'outer.zzz'; allowed here: outer.count, "),
        ({"count": 0}, "'outer.count' is 0; allowed: at least 1"),
        ({"count": 1.5}, "'outer.count' must be a whole number at least 1, not 1.5"),
        ({"count": True}, "'outer.count' must be a whole number at least 1, not True"),
        ({"name": 3}, "'outer.name' must be text, not 3"),
        ({"flag": 1}, "'outer.flag' must be true or false, not 1"),
        ({"mode": "fst"}, "'outer.mode' is 'fst', did you mean 'outer.mode=fast'? Allowed: fast, exact"),
        ({"sign": True}, "'outer.sign' is True; allowed: 1, -1"),
        ({"edges": [2, 1]}, "'outer.edges' must rise, not [2.0, 1.0]"),
        ({"edges": [1, -1]}, "'outer.edges[1]' is -1.0; allowed: above 0"),
        ({"edges": 3}, "'outer.edges' must be a list like [a, b], not 3"),
        ({"edges": [float("nan")]}, "'outer.edges[0]' must be a finite number, not nan"),
        ({"pair": [1]}, "'outer.pair' must have 2 values, not 1"),
        ({"shape": {"kind": "oval"}}, "'outer.shape.kind' is 'oval'; allowed: round, square"),
        ({"shape": {"kind": "square", "side_m": 2}}, "'outer.shape.side_m' is 2.0; allowed: at least 0 and below 2"),
        ({"shape": {"kind": "square", "radius_m": 2}}, "unknown key 'outer.shape.radius_m'"),
        ({"shape": {"kind": "round"}}, "missing key 'outer.shape.radius_m': radius [m]"),
        ({"shape": {"kind": "round", "radius_m": 0}}, "'outer.shape.radius_m' is 0.0; allowed: above 0 and at most 2"),
        ({"shape": 3}, "'outer.shape.kind' is 3"),
        (
            {"shape": ["round"]},
            "'outer.shape.kind' is ['round'], did you mean 'outer.shape.kind=round'? ",
        ),
    ],
)
def test_what_does_not_fit_is_named_with_what_is_allowed(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        build(Outer, {**GOOD, **change}, "outer")
    assert message in str(caught.value)


def test_a_missing_key_says_what_it_means() -> None:
    with pytest.raises(ConfigError, match=r"missing key 'outer.name': what it is called"):
        build(Outer, {key: value for key, value in GOOD.items() if key != "name"}, "outer")


def test_a_key_that_older_files_lack_has_what_its_absence_means() -> None:
    @dataclass(frozen=True)
    class Grown:
        old: int = setting("was there")
        new: Literal["first", "second"] = setting("came later", absent="first")

    assert build(Grown, {"old": 1}, "grown") == Grown(1, new="first")
    assert build(Grown, {"old": 1, "new": "second"}, "grown").new == "second"
    with pytest.raises(ConfigError, match=r"'grown\.new' is None; allowed: first, second"):
        build(Grown, {"old": 1, "new": None}, "grown")
