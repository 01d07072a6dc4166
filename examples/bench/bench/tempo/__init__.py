"""Declaration of the stage tempo."""

from bench.tempo.messages import TOPICS
from bench.tempo.settings import TempoSettings
from kendama_cli.extension import Headline, StageDeclaration

STAGE = StageDeclaration(
    name="tempo",
    title="Speed over time scale",
    lead="The primitive is played at several time scales, and its peak speed is compared with the limit.",
    run="bench.tempo.stage:Tempo",
    returns="bench.tempo.artifact:TempoStudy",
    settings={"tempo": TempoSettings},
    topics=TOPICS,
    chapter="bench.tempo.chapter:figures",
    headline=(Headline("min_tau_scale", "smallest time scale whose speed is allowed"),),
)
