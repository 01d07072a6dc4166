"""The referee's section of a run's report: ``kendama referee`` writes its log beside the run; no pipeline runs it."""

from __future__ import annotations

from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.referee.messages import TOPICS

SECTION = StageDeclaration(
    name="referee",
    title="Under another physics",
    lead=(
        "The cup is carried where it went in every game, and the ball hangs on a chain of forty colliding links in "
        "MuJoCo: what it says of the catches that our own simulation claims."
    ),
    run="",
    gives="",
    settings={},
    topics=TOPICS,
    chapter="kendama_cli.stages.referee.chapter:figures",
    replay="kendama_cli.stages.referee.performance:replay",
    headline=(Headline("caught_rate", "of these games caught under another physics"),),
)
