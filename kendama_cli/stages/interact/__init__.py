"""The stage ``interact``, declared."""

from __future__ import annotations

from kendama_cli.motion.task_settings import InteractSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.interact.messages import TOPICS

STAGE = StageDeclaration(
    name="interact",
    title="Force control in a scene",
    lead="An arm plays a script of poses and forces among bodies, its tool on springs in task space.",
    run="kendama_cli.stages.interact.stage:Interact",
    gives="kendama_cli.artifacts.interaction:InteractionResult",
    settings={"interact": InteractSettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.interact.chapter:interaction_figures",
    headline=(Headline("force_error_rms_n", "rms error of the force on what the arm touches"),),
)
