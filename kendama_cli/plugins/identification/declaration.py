"""The stages ``identify`` and ``measure``, declared: what is measured of arm and kendama before a game."""

from __future__ import annotations

from kendama_cli.plugins.identification.messages import FRICTION_TOPICS, SWING_TOPICS
from kendama_cli.plugins.identification.settings import IdentifySettings, SwingMeasurement, TrackMeasurement
from kendama_cli.schema.declaration import Headline, StageDeclaration

IDENTIFY = StageDeclaration(
    name="identify",
    title="Friction identification",
    lead="Identifies friction and servo lag of each joint from an excitation; later stages compensate both.",
    run="kendama_cli.plugins.identification.friction_stage:Identify",
    returns="kendama_cli.artifacts.friction_model:FrictionModel",
    settings={"identify": IdentifySettings},
    topics=FRICTION_TOPICS,
    kind="moves",
    chapter="kendama_cli.plugins.identification.chapters:identification_figures",
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

MEASURE = StageDeclaration(
    name="measure",
    title="The kendama",
    lead="Measures rope and drag by a free swing of the ball under a cup at rest.",
    run="kendama_cli.plugins.identification.swing_stage:Measure",
    returns="kendama_cli.artifacts.kendama_model:KendamaModel",
    settings={"measure": SwingMeasurement | TrackMeasurement},
    topics=SWING_TOPICS,
    kind="moves",
    packages=("kendama.recordings",),
    chapter="kendama_cli.plugins.identification.chapters:figures",
    headline=(Headline("rope_mm", "length of the rope"), Headline("drag_n_s_m_at_3", "drag over speed at 3 m/s")),
    brief="rope {rope_mm:.0f} mm, drag {drag_n_s_m_at_3:.2g} N s/m at 3 m/s",
    metrics={
        "rope_mm": "Length of the rope from the tie to the ball's centre, from the period of the free swing.",
        "rope_mm_half_interval": "Half width of the 95 % interval of the rope's length.",
        "linear_n_s_m": "Linear drag coefficient of the ball [N s/m].",
        "linear_half_interval": "Half width of the 95 % interval of the linear drag coefficient [N s/m].",
        "quadratic_n_s2_m2": "Quadratic drag coefficient of the ball [N s^2/m^2].",
        "quadratic_half_interval": "Half width of the 95 % interval of the quadratic drag coefficient [N s^2/m^2].",
        "drag_n_s_m_at_3": "Drag divided by speed at 3 m/s [N s/m], which the swing determines best.",
        "drag_at_3_half_interval": "Half width of the 95 % interval of drag divided by speed at 3 m/s [N s/m].",
        "amplitude_deg": "Angle of the first swing; a larger one determines the drag better.",
        "duration_s": "Duration of the free swing that was fitted.",
        "rms_mm": "Root mean square residual of the fit; smaller is better.",
    },
    topic_words={
        "/measure/exchange": "Command that was sent and state that was measured in each control period.",
        "/measure/swing": "Observed ball and fitted pendulum in the plane of the swing.",
    },
    figures={
        "measure-swing": "Angle of the free swing over time: measured, and of the fitted pendulum.",
        "measure-left": "Residual of the fit over time; a pattern in it shows an effect that the model lacks.",
    },
)
