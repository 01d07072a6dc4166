"""The stage ``interact``, declared."""

from __future__ import annotations

from kendama_cli.plugins.interact.messages import TOPICS
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.settings.interact import InteractSettings

STAGE = StageDeclaration(
    name="interact",
    title="Force control in a scene",
    lead="Plays a script of poses and forces in a scene, by impedance control of the tool.",
    run="kendama_cli.plugins.interact.stage:Interact",
    returns="kendama_cli.plugins.interact.artifact:InteractionResult",
    settings={"interact": InteractSettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.plugins.interact.chapter:interaction_figures",
    headline=(Headline("force_error_rms_n", "rms error of the force on what the arm touches"),),
)
