"""The stage ``measure``, declared."""

from __future__ import annotations

from kendama_cli.identification.settings import SwingMeasurement, TrackMeasurement
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.measure.messages import TOPICS

STAGE = StageDeclaration(
    name="measure",
    title="The kendama",
    lead="Measures rope and drag by a free swing of the ball under a cup at rest.",
    run="kendama_cli.stages.measure.stage:Measure",
    returns="kendama_cli.artifacts.kendama_model:KendamaModel",
    settings={"measure": SwingMeasurement | TrackMeasurement},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.measure.chapter:figures",
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
