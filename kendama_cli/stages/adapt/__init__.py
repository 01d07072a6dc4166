"""The stage ``adapt``, declared."""

from __future__ import annotations

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.adapt.messages import TOPICS

STAGE = StageDeclaration(
    name="adapt",
    title="Adaptation",
    lead="Searches the time scale of the primitive at which the arm catches the ball in simulation.",
    run="kendama_cli.stages.adapt.stage:Adapt",
    returns="kendama_cli.artifacts.motion_plan:CatchMotion",
    settings={"adapt": AdaptSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.adapt.chapter:adaptation_figures",
    ensemble_chapter="kendama_cli.stages.adapt.comparison:CHAPTER",
    film="kendama_cli.stages.adapt.chapter:film",
    replay="kendama_cli.stages.adapt.chapter:replay",
    headline=(
        Headline("success_rate", "of perturbed repeats caught by the adapted swing"),
        Headline("tau_scale", "time scale tau of the catch"),
    ),
)
