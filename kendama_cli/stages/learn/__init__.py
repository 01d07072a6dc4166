"""The stage ``learn``, declared."""

from __future__ import annotations

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.learn.messages import TOPICS

STAGE = StageDeclaration(
    name="learn",
    title="Swing-up without prior knowledge",
    lead="Learns to swing the ball up, to release and to catch it, without demonstrations.",
    run="kendama_cli.stages.learn.stage:Learn",
    returns="kendama_cli.artifacts.policy:PolicyArtifact",
    settings={"learn": LearnSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.learn.chapter:swingup_figures",
    replay="kendama_cli.stages.learn.chapter:replay",
    ensemble_chapter="kendama_cli.stages.learn.comparison:CHAPTER",
    headline=(
        Headline("rollouts_to_solved", "rollouts before the first of those in a row that prove the swing-up"),
        Headline("frozen_caught_rate", "of swing-ups by the frozen policy end in the cup"),
    ),
)
