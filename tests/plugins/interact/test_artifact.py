"""The result of an interaction comes back from the store as it was."""

from pathlib import Path

import numpy as np

from kendama_cli.plugins.interact.artifact import InteractionResult
from kendama_cli.store.codecs import load_artifact, save_artifact
from tests.store.test_codecs import same


def test_an_interaction_comes_back_as_it_was(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    made = InteractionResult(
        ("press",), ("table",), np.arange(3.0), np.zeros(3), *(rng.normal(size=(3, 3)) for _ in range(4))
    )
    save_artifact(InteractionResult, made, tmp_path)
    assert same(load_artifact(InteractionResult, tmp_path), made)
