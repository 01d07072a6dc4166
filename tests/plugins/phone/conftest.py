"""One running 'kendama play --phone' for the tests of a file; skipped without the extra ``phone``."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.plugins.phone.replayed import PhoneGame


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PhoneGame]:
    """The game; Ctrl-C must end it."""
    for name in ("segno", "cryptography", "uvicorn", "starlette", "websockets"):
        pytest.importorskip(name, reason="needs the extra 'phone'")
    made = PhoneGame(tmp_path_factory.mktemp("game"))
    yield made
    if made.process.poll() is None:
        assert made.end() == 0
