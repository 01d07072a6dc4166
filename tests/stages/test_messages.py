"""What every stage says that it logs."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from kendama_cli.log.channels import CHANNELS, FAMILIES

STAGES = ("capture", "encode", "identify", "adapt", "learn", "predict", "transfer", "interact")


@pytest.mark.parametrize("stage", STAGES)
def test_a_stages_topics_are_its_own(stage: str) -> None:
    topics = importlib.import_module(f"kendama_cli.stages.{stage}.messages").TOPICS
    assert topics
    assert all(topic.startswith(f"/{stage}/") for topic in topics)


def test_together_the_stages_declare_every_channel() -> None:
    declared = {
        topic for name in STAGES for topic in importlib.import_module(f"kendama_cli.stages.{name}.messages").TOPICS
    }
    assert declared == {*CHANNELS, *(f"{prefix}*" for prefix in FAMILIES)}


def test_messages_load_neither_numpy_nor_protobuf() -> None:
    names = ", ".join(f"kendama_cli.stages.{name}.messages" for name in STAGES)
    code = (
        f"import sys, {names}; print([m for m in ('numpy', 'pandas', 'google.protobuf', 'mcap') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
