"""The stage ``capture``, declared."""

from __future__ import annotations

from kendama_cli.devices.demonstrator.settings import CaptureSettings
from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.stages.capture.messages import TOPICS

STAGE = StageDeclaration(
    name="capture",
    title="Demonstration",
    lead="Reads demonstrations: the path of the cup in each swing.",
    run="kendama_cli.stages.capture.stage:Capture",
    returns="kendama_cli.artifacts.demonstration:DemonstrationSet",
    settings={"capture": CaptureSettings},
    topics=TOPICS,
    kind="records",
    chapter="kendama_cli.stages.capture.chapter:capture_figures",
    replay="kendama_cli.stages.capture.performance:replay",
    episodes="kendama_cli.stages.capture.episodes:episodes",
)
