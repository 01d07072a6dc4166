"""Declarations of every stage's log."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from kendama_cli.schema.messages import codec

STAGES = ("capture", "encode", "identify", "adapt", "learn", "predict", "transfer", "interact", "rehearse")


@pytest.mark.parametrize("stage", STAGES)
def test_a_stages_topics_are_its_own(stage: str) -> None:
    topics = importlib.import_module(f"kendama_cli.stages.{stage}.messages").TOPICS
    assert topics
    assert all(topic.startswith(f"/{stage}/") for topic in topics)


@pytest.mark.parametrize("stage", STAGES)
def test_every_declared_message_has_a_protobuf_schema(stage: str) -> None:
    for kind in importlib.import_module(f"kendama_cli.stages.{stage}.messages").TOPICS.values():
        package = "foxglove" if kind.__module__ == "kendama_cli.schema.foxglove" else "kendama"
        assert codec(kind).schema == f"{package}.{kind.__name__.removesuffix('Message')}"


def test_messages_load_neither_numpy_nor_protobuf() -> None:
    names = ", ".join(f"kendama_cli.stages.{name}.messages" for name in STAGES)
    code = (
        f"import sys, {names}; print([m for m in ('numpy', 'pandas', 'google.protobuf', 'mcap') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
