"""The stage ``rehearse``, declared."""

from __future__ import annotations

from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.rehearse.messages import TOPICS
from kendama_cli.stages.rehearse.settings import RehearseSettings

STAGE = StageDeclaration(
    name="rehearse",
    title="First tries on an arm",
    lead="Plays a checked motion on the twin, then on the arm, slowly and without the ball.",
    run="kendama_cli.stages.rehearse.stage:Rehearse",
    returns="kendama_cli.artifacts.rehearsal:Rehearsal",
    settings={"rehearse": RehearseSettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.rehearse.chapter:rehearsal_figures",
    headline=(
        Headline("speed", "of the motion's own speed was played on {robot}"),
        Headline("tracking_error_rms_mrad", "mrad rms between what was sent and what was measured"),
    ),
)
