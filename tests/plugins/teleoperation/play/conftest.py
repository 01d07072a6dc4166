"""Games that are served, for the tests that play them; skipped without the extra ``play``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.plugins.teleoperation.play.served_game import Game

for _name in ("uvicorn", "starlette", "websockets"):
    pytest.importorskip(_name, reason="needs the extra 'play'")
served_game = pytest.importorskip("tests.plugins.teleoperation.play.served_game")


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Game]:
    """One running game for the tests of a file."""
    made = served_game.Game(tmp_path_factory.mktemp("game"))
    yield made
    if made.process.poll() is None:
        assert made.end() == 0


@pytest.fixture
def games(tmp_path: Path) -> Iterator[Callable[..., Game]]:
    """Starts games with options of their own."""
    made: list[Game] = []

    def start(*options: str) -> Game:
        made.append(served_game.Game(tmp_path, *options))
        return made[-1]

    yield start
    for one in made:
        if one.process.poll() is None:
            one.process.kill()
        one.process.wait(timeout=20)
