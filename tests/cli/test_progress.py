"""What a run says while it goes on."""

from __future__ import annotations

import pytest

from kendama_cli.cli.progress import PlainLines


def test_a_stage_that_starts_tells_its_first_reasons_and_how_many_more(capsys: pytest.CaptureFixture[str]) -> None:
    lines = PlainLines()
    lines.stage_starts("adapt", None, ("config a 1 -> 2",))
    lines.stage_starts("learn", None, tuple(f"config {key} 1 -> 2" for key in "abcde"))
    lines.stage_starts("transfer", None, ())
    one, many, none = capsys.readouterr().err.splitlines()
    assert one == "adapt: starts (config a 1 -> 2)"
    assert many.endswith("(config a 1 -> 2; config b 1 -> 2; config c 1 -> 2; 2 more in 'kendama plan')")
    assert none == "transfer: starts (goes on)"
