"""The referee's section of a run's report: ``kendama cross-check`` writes its log beside a run; no pipeline has it."""

from __future__ import annotations

from kendama_cli.plugins.mujoco.cross_check.messages import TOPICS
from kendama_cli.schema.declaration import Headline, StageDeclaration

SECTION = StageDeclaration(
    name="referee",
    title="Under another physics",
    lead=(
        "Replays the cup's path of every game in MuJoCo, where the rope is a chain of forty colliding links, and "
        "compares the catches with those of kendama's own simulation."
    ),
    run="",
    returns="",
    settings={},
    topics=TOPICS,
    chapter="kendama_cli.plugins.mujoco.cross_check.chapter:figures",
    replay="kendama_cli.plugins.mujoco.cross_check.chapter:replay",
    headline=(Headline("caught_rate", "of these games caught under another physics"),),
    metrics={
        "caught_rate": "Fraction of the games that MuJoCo catches; close to ours_caught_rate is good.",
        "caught_rate_low": "Lower end of the 95 % interval of the caught rate.",
        "caught_rate_high": "Upper end of the 95 % interval of the caught rate.",
        "ours_caught_rate": "Fraction of the same games that kendama's own simulation catches.",
        "same_outcome_rate": "Fraction of the games with the same outcome in both simulations; 1 is best.",
        "agreement_mm_p50": "Median distance between the two misses in games with a taut rope; smaller is better.",
        "agreement_slack_mm_p50": "Median distance between the two misses in games with a rope slack in the swing.",
        "slack_in_swing": "Number of games whose rope was slack so long that its mass decides the outcome.",
        "games": "Number of games that were cross-checked.",
    },
    topic_words={
        "/referee/game": "One game in both simulations: outcomes, misses and paths.",
    },
    figures={
        "referee-misses": "Miss of each game in MuJoCo over that in kendama's simulation; marks on the diagonal agree.",
        "referee-paths": "Cup and both balls in the swing plane, in the game whose misses differ most.",
    },
)
