"""The stage ``learn``, declared."""

from __future__ import annotations

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.learn.messages import TOPICS

STAGE = StageDeclaration(
    name="learn",
    title="Swing-up without prior knowledge",
    lead=("SARSA(λ) learns from nothing to swing the ball up, driven by random harmonic motions while it explores."),
    run="kendama_cli.stages.learn.stage:Learn",
    gives="kendama_cli.artifacts.policy:PolicyArtifact",
    settings={"learn": LearnSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.learn.chapter:swingup_figures",
    ensemble_chapter="kendama_cli.stages.learn.comparison:CHAPTER",
    headline=(
        Headline("rollouts_to_learn", "rollouts until the swing-up was learned"),
        Headline("frozen_success_rate", "of swing-ups by the frozen table succeed"),
    ),
)
