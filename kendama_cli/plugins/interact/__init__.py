"""The stage ``interact``, declared."""

from __future__ import annotations

from kendama_cli.plugins.interact.messages import TOPICS
from kendama_cli.plugins.interact.settings import InteractSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration

STAGE = StageDeclaration(
    name="interact",
    title="Force control in a scene",
    lead="Plays a script of poses and forces in a scene, by impedance control of the tool.",
    run="kendama_cli.plugins.interact.stage:Interact",
    returns="kendama_cli.plugins.interact.artifact:InteractionResult",
    settings={"interact": InteractSettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.plugins.interact.chapter:interaction_figures",
    headline=(Headline("force_error_rms_n", "rms error of the force on what the arm touches"),),
    brief="force {force_error_rms_n:.2g} N off, path {path_error_rms_mm:.2g} mm off",
    metrics={
        "force_error_rms_n": (
            "Root mean square error of the contact force along its desired direction; smaller is better."
        ),
        "force_error_n_p95": "Error of the contact force that 95 % of the settled time stays below.",
        "force_error_max_n": "Largest error of the contact force after it has settled.",
        "contact_fraction": (
            "Fraction of the settled time in which the tool touched a body; 1 is best where a force is desired."
        ),
        "peak_force_n": "Largest force between the tool and any body.",
        "friction": "Measured friction coefficient of the contact while the tool slid.",
        "path_error_rms_mm": (
            "Root mean square distance of the tool from its reference, apart from the direction of the force."
        ),
        "touched": "Names of the bodies that the tool touched.",
        "effort_over_limit": "Highest joint torque divided by its limit; at most 1 is possible.",
        "speed_over_limit": "Highest joint velocity divided by its limit; at most 1 is possible.",
        "duration_s": "Duration of the script.",
    },
    topic_words={
        "/interact/joints": "Positions, velocities and torques of the joints.",
        "/interact/tool": "Pose of the tool.",
        "/interact/reference": "Desired pose of the tool.",
        "/interact/body": "Pose of the scene's movable body, whose name is the child frame.",
        "/interact/wrench": "Force and torque at the wrist's sensor.",
        "/interact/contact": "Force between the tool and a body, along the desired direction and across it.",
    },
    figures={
        "interact-scene": "Side view of the tool's path among the bodies, with the contact marked.",
        "interact-force": "Desired and exerted force over time, with the steps of the script.",
        "interact-friction": "Force across the desired direction divided by that along it, over time.",
        "interact-deviation": "Distance of the tool from its reference over time.",
        "interact-efforts": "Joint torques over time.",
    },
)
