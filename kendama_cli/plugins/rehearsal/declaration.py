"""The stage ``rehearse``, declared."""

from __future__ import annotations

from kendama_cli.plugins.rehearsal.settings import RehearseSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.schema.foxglove import JointStates

STAGE = StageDeclaration(
    name="rehearse",
    title="First attempts on an arm",
    lead="Plays a checked motion on the twin, then on the arm, slowly and without the ball.",
    run="kendama_cli.plugins.rehearsal.stage:Rehearse",
    returns="kendama_cli.plugins.rehearsal.artifact:Rehearsal",
    settings={"rehearse": RehearseSettings},
    topics={f"/rehearse/{name}": JointStates for name in ("ghost", "sent", "measured", "external")},
    kind="moves",
    chapter="kendama_cli.plugins.rehearsal.chapter:rehearsal_figures",
    headline=(
        Headline("speed", "of the motion's own speed was played on {robot}"),
        Headline("tracking_error_rms_mrad", "mrad rms between what was sent and what was measured"),
    ),
    brief="{tracking_error_rms_mrad:.1f} mrad behind at {speed:.0%} speed",
    metrics={
        "speed": "Speed of the rehearsal, as a fraction of the motion's own.",
        "completed": "True if the arm played the motion to its end.",
        "tracking_error_rms_mrad": (
            "Root mean square difference between the joint angles that were measured and sent; smaller is better."
        ),
        "tracking_error_max_mrad": "Largest difference between the joint angles that were measured and sent.",
        "twin_deviation_max_mrad": (
            "Largest difference between the arm's joint angles and the twin's; smaller means that the twin is right."
        ),
        "played_s": "Time for which the arm moved.",
    },
    topic_words={
        "/rehearse/ghost": "Joint angles of the twin in each control period.",
        "/rehearse/sent": "Joint angles that were sent to the arm, after all limits.",
        "/rehearse/measured": "Joint angles that the arm measured.",
        "/rehearse/external": "External joint torques as the arm itself estimates them, where it does.",
    },
    figures={
        "rehearse-behind": "Measured joint angles less those sent, over time; small means that the arm follows.",
        "rehearse-apart": "Measured joint angles less the twin's, over time; small means that the twin is right.",
        "rehearse-angles": "Joint angles over time as they were sent and as they were measured.",
    },
)
