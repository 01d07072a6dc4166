"""The stage ``transfer``, declared."""

from __future__ import annotations

from kendama_cli.control.settings import TransferSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.transfer.messages import TOPICS

STAGE = StageDeclaration(
    name="transfer",
    title="Transfer to the robot",
    lead="Continues learning on the hardware, imitates the swing, and plays full games through images.",
    run="kendama_cli.stages.transfer.stage:Transfer",
    returns="kendama_cli.artifacts.transfer_result:TransferResult",
    settings={"transfer": TransferSettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.transfer.chapter:transfer_figures",
    replay="kendama_cli.stages.transfer.performance:replay",
    episodes="kendama_cli.stages.transfer.episodes:episodes",
    ensemble_chapter="kendama_cli.stages.transfer.comparison:CHAPTER",
    headline=(
        Headline("success_rate_after", "of swing-ups succeed on {robot}"),
        Headline("caught_rate", "of full games caught on {robot}"),
    ),
)
