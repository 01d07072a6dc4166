"""The stage ``measure``, declared."""

from __future__ import annotations

from kendama_cli.identification.settings import SwingMeasurement, TrackMeasurement
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.measure.messages import TOPICS

STAGE = StageDeclaration(
    name="measure",
    title="The kendama",
    lead="Measures rope and drag by a free swing of the ball under a cup at rest.",
    run="kendama_cli.stages.measure.stage:Measure",
    returns="kendama_cli.artifacts.kendama_model:KendamaModel",
    settings={"measure": SwingMeasurement | TrackMeasurement},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.measure.chapter:figures",
    headline=(Headline("rope_mm", "length of the rope"), Headline("drag_n_s_m_at_3", "drag over speed at 3 m/s")),
)
