"""The stage ``encode``, declared."""

from __future__ import annotations

from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.encode.messages import TOPICS

STAGE = StageDeclaration(
    name="encode",
    title="Movement primitive",
    lead="Fits a dynamic movement primitive to each coordinate, averaged over the demonstrations.",
    run="kendama_cli.stages.encode.stage:Encode",
    returns="kendama_cli.artifacts.motion_plan:MotionPlan",
    settings={"encode": EncodeSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.encode.chapter:encode_figures",
    headline=(Headline("rmse_mm", "error of the movement primitive"),),
)
