"""The referee's section of a run's report: ``kendama cross-check`` writes its log beside a run; no pipeline has it."""

from __future__ import annotations

from kendama_cli.plugins.referee.messages import TOPICS
from kendama_cli.schema.declaration import Headline, StageDeclaration

SECTION = StageDeclaration(
    name="referee",
    title="Under another physics",
    lead=(
        "The cup is carried where it went in every game, and the ball hangs on a chain of forty colliding links in "
        "MuJoCo: what it says of the catches that our own simulation claims."
    ),
    run="",
    returns="",
    settings={},
    topics=TOPICS,
    chapter="kendama_cli.plugins.referee.chapter:figures",
    replay="kendama_cli.plugins.referee.performance:replay",
    headline=(Headline("caught_rate", "of these games caught under another physics"),),
)
