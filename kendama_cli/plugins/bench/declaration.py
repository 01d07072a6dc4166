"""The stage ``bench``, declared: a learner on a table in an environment of others."""

from __future__ import annotations

from kendama_cli.plugins.bench.messages import TOPICS
from kendama_cli.plugins.bench.settings import BenchSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration

STAGE = StageDeclaration(
    name="bench",
    title="Learning in another environment",
    lead="Learns on tiles in an environment of Gymnasium, and compares the policy with what explored for it.",
    run="kendama_cli.plugins.bench.stage:Bench",
    returns="kendama_cli.plugins.bench.artifact:TilePolicy",
    settings={"bench": BenchSettings},
    topics=TOPICS,
    chapter="kendama_cli.plugins.bench.chapter:learning_figures",
    headline=(Headline("frozen_return", "mean return of the frozen policy"),),
    brief="return {frozen_return:.4g}, replayed exploration {replayed_return:.4g}",
    metrics={
        "frozen_return": "Mean return of the frozen policy over the evaluation's episodes; more is better.",
        "replayed_return": (
            "Mean return of the best harmonic that explored, replayed in the same episodes: the baseline without a "
            "table."
        ),
        "random_return": "Mean return of random actions in the same episodes.",
        "gain": "Return of the frozen policy minus that of the replayed harmonic; above 0 the table adds something.",
        "episodes": "Number of episodes of learning.",
        "steps": "Number of actions of learning.",
        "tiles": "Number of tiles that were ever visited.",
    },
    topic_words={"/bench/episode": "One episode: whether it explored, its return and its number of actions."},
    figures={"bench-return": "Return of each episode, exploring ones apart; the line is a running median."},
)
