"""The stage ``identify``, declared."""

from __future__ import annotations

from kendama_cli.identification.settings import IdentifySettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.identify.messages import TOPICS

STAGE = StageDeclaration(
    name="identify",
    title="Friction identification",
    lead="Identifies the friction of each joint from an excitation; later stages compensate it.",
    run="kendama_cli.stages.identify.stage:Identify",
    returns="kendama_cli.artifacts.friction_model:FrictionModel",
    settings={"identify": IdentifySettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.identify.chapter:identification_figures",
    headline=(Headline("tracking_rms_mm_after", "error of the cup at speed, friction compensated"),),
)
