"""README is short, and its video, figures and output are those of the product."""

from __future__ import annotations

import importlib.util
import re
import sys
from dataclasses import replace
from typing import Any

import pytest
from PIL import Image

from tests.docs.measure import DOCS, ROOT
from tests.rendering.example_motion import example_motion
from tests.simulation.dart.bench_robot import kendama_game

README = (ROOT / "README.md").read_text()
START = (DOCS / "tutorials" / "start.md").read_text()
FIGURES = "\n".join(path.read_text() for path in (DOCS / "results").glob("*.md"))


def video_program() -> Any:
    """Return the program that makes the video."""
    spec = importlib.util.spec_from_file_location("video", ROOT / "data" / "video.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["video"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_its_parts_stand_in_the_order_in_which_a_newcomer_asks() -> None:
    parts = (
        "kendama.webp",
        "## Try it",
        "```console",
        "tried on a real arm",
        "**Student",
        "**Researcher",
        "**Engineer",
    )
    places = [README.index(part) for part in (*parts, "## Results", "## Read on")]
    assert places == sorted(places)
    assert len(README.split()) <= 650


def test_each_line_of_its_output_is_one_of_the_first_tutorial() -> None:
    (shown,) = re.findall(r"^```console\n(.*?)^```", README, re.M | re.S)
    lines = [line for line in shown.splitlines() if line]
    assert len(lines) >= 5
    assert [line for line in lines if line not in START.splitlines()] == []


def test_each_figure_stands_with_its_baseline_in_one_row_of_the_results() -> None:
    section = README.partition("## Results")[2].partition("\n## ")[0]
    rows = [row.strip("| ").split(" | ") for row in section.splitlines() if row.startswith("| ")][1:]
    assert len(rows) == 6
    listed = [row for row in FIGURES.splitlines() if row.startswith("|")]
    for _, measured, baseline in rows:
        value = baseline.partition(": ")[2] or baseline
        assert any(measured in row and value in row for row in listed), (measured, baseline)
        assert re.search(r"[\[≥]", measured)


def test_its_video_is_small_lasts_six_seconds_and_moves() -> None:
    video = ROOT / "data" / "pictures" / "kendama.webp"
    assert video.stat().st_size <= 1_000_000
    with Image.open(video) as image:
        frames: Any = image
        assert frames.n_frames > 60
        pictures = []
        duration_ms = 0
        for number in range(frames.n_frames):
            frames.seek(number)
            frames.load()
            duration_ms += frames.info["duration"]
            pictures.append(frames.convert("L").resize((64, 48)).tobytes())
    assert duration_ms == pytest.approx(6000, abs=500)
    assert len(set(pictures)) > len(pictures) / 2


def test_its_video_says_when_the_catches_were() -> None:
    catches = video_program().catches_in(ROOT / "data" / "pictures" / "kendama.webp")
    assert set(catches) == {"adapt", "transfer"}


def test_the_program_of_its_video_renders_what_a_part_asks_for() -> None:
    program = video_program()
    part = program.Part("adapt", "caption", -0.1, 0.1, 0.5)
    assert len(part.times(1.0)) == round(0.4 * program.RATE_HZ)
    one = replace(part, start_s=0.0, end_s=1 / program.RATE_HZ, speed=1.0)
    (image,) = program.pictures(one, example_motion(2.0, 1.0), kendama_game())
    assert image.shape == (program.HEIGHT_PX, program.WIDTH_PX, 3)
    assert image[: program.HEIGHT_PX - 40].std() > 1.0
