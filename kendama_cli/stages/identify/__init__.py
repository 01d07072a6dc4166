"""The stage ``identify``, declared."""

from __future__ import annotations

from kendama_cli.identification.settings import IdentifySettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.identify.messages import TOPICS

STAGE = StageDeclaration(
    name="identify",
    title="Friction identification",
    lead="Identifies friction and servo lag of each joint from an excitation; later stages compensate both.",
    run="kendama_cli.stages.identify.stage:Identify",
    returns="kendama_cli.artifacts.friction_model:FrictionModel",
    settings={"identify": IdentifySettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.identify.chapter:identification_figures",
    headline=(Headline("tracking_rms_mm_after", "error of the cup at speed, friction compensated"),),
    brief="{tracking_rms_mm_before:.1f} mm off before, {tracking_rms_mm_after:.1f} mm after",
    metrics={
        "model": "Friction model with the smaller error on held-out samples: parametric or network.",
        "parametric_rms_nm": (
            "Root mean square error of the Coulomb, Stribeck and viscous model on held-out samples; smaller is better."
        ),
        "network_rms_nm": "Root mean square error of the network on held-out samples; smaller is better.",
        "tracking_rms_mm_before": "Root mean square distance of the cup from its circle without friction compensation.",
        "tracking_rms_mm_after": (
            "Root mean square distance of the cup from its circle with friction compensation; smaller than before "
            "is good."
        ),
        "tracking_speed_m_s": "Speed of the cup on the circle.",
        "drive_delay_ms": "Delay with which the drives follow, which is removed before the distances are computed.",
        "servo_lag_s": "Median lag of the joints behind their commands; zero where they follow well.",
        "servo_dead_time_s": "Time after which the joints begin to follow a command; below zero for one that is held.",
        "*_rms_nm": "Root mean square error of the chosen model at one joint, whose name stands for the star.",
    },
    topic_words={
        "/identify/joints": "Positions, velocities and torques of the joints while the arm moves for the fit.",
        "/identify/wrench": "Force and torque at the wrist's sensor during the same motions.",
        "/identify/friction": "Held-out sample of a joint's friction beside the predictions of both models.",
        "/identify/servo": "Lag, sag and dead time of the arm's servo, as found in the same motion.",
        "/identify/tracking/reference": "Commanded position of the cup on the circle.",
        "/identify/tracking/before": "Position of the cup on the circle without friction compensation.",
        "/identify/tracking/after": "Position of the cup on the circle with friction compensation.",
    },
    figures={
        "identify-friction": "Friction torque over velocity for each joint: samples and both fitted models.",
        "identify-circle": "Path of the cup on the circle, with enlarged errors, before and after compensation.",
        "identify-misses": "Distance of the cup from the circle over time, before and after compensation.",
    },
    methods=(
        'Friction was identified on the arm; the model chosen was "{model}", and the cup then followed its '
        "reference with {tracking_rms_mm_after} rms.",
    ),
)
