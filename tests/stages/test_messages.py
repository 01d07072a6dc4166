"""Declarations of every stage's log."""

from __future__ import annotations

import subprocess
import sys

import pytest

from kendama_cli.schema.declaration import find_stage, stage_names
from kendama_cli.schema.messages import codec

STAGES = stage_names()


def topics_of(stage: str) -> dict[str, type]:
    """Return the declared topics of a stage, of a part's too."""
    declaration = find_stage(stage)
    assert declaration is not None
    return dict(declaration.topics)


@pytest.mark.parametrize("stage", STAGES)
def test_a_stages_topics_are_its_own(stage: str) -> None:
    topics = topics_of(stage)
    assert topics
    assert all(topic.startswith(f"/{stage}/") for topic in topics)


@pytest.mark.parametrize("stage", STAGES)
def test_every_declared_message_has_a_protobuf_schema(stage: str) -> None:
    for kind in topics_of(stage).values():
        package = "foxglove" if kind.__module__ == "kendama_cli.schema.foxglove" else "kendama"
        assert codec(kind).schema == f"{package}.{kind.__name__.removesuffix('Message')}"


def test_messages_load_neither_numpy_nor_protobuf() -> None:
    code = (
        "import sys; from kendama_cli.schema.declaration import find_stage, stage_names;"
        "[find_stage(name).topics for name in stage_names()];"
        "print([m for m in ('numpy', 'pandas', 'google.protobuf', 'mcap') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
