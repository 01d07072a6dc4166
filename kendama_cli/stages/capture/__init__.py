"""The stage ``capture``, declared."""

from __future__ import annotations

from kendama_cli.devices.demonstrator.settings import CaptureSettings
from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.schema.foxglove import FrameTransform

STAGE = StageDeclaration(
    name="capture",
    title="Demonstration",
    lead="Reads demonstrations: the path of the cup in each swing.",
    run="kendama_cli.stages.capture.stage:Capture",
    returns="kendama_cli.artifacts.demonstration:DemonstrationSet",
    settings={"capture": CaptureSettings},
    topics={"/capture/cup": FrameTransform},
    kind="records",
    chapter="kendama_cli.stages.capture.chapter:capture_figures",
    replay="kendama_cli.stages.capture.chapter:replay",
    episodes="kendama_cli.stages.capture.episodes:episodes",
    brief="{n_demonstrations:swing} of {duration_s:.1f} s",
    metrics={
        "n_demonstrations": "Number of swings that were recorded.",
        "sample_rate_hz": "Median sample rate of the recordings; 50 Hz and more resolves a swing.",
        "duration_s": "Mean duration of the recordings, before they are cut to their motion.",
        "peak_speed_m_s": "Highest speed of the cup in all recordings; a hand's swing reaches 0.5 to 3 m/s.",
        "origin": "Source of the recordings as their files state it: person, synthetic, or mixed if they differ.",
        "likely_error_mm": (
            "Root mean square error that a recording of inertial sensors suggests of its path, the largest of all; no "
            "bound."
        ),
    },
    topic_words={
        "/capture/cup": "Pose of the cup in each demonstration, whose name is the child frame.",
    },
    figures={
        "capture-path": "Side view of the cup's path in each demonstration, relative to its start.",
        "capture-time": "Horizontal and vertical coordinate of the cup over time, for each demonstration.",
    },
    methods=(
        "Demonstrations are {n_demonstrations} swings of a hand-held cup (origin: {origin}), sampled at "
        "{sample_rate_hz}.",
    ),
)
