"""The stage ``encode``, declared."""

from __future__ import annotations

from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.encode.messages import TOPICS

STAGE = StageDeclaration(
    name="encode",
    title="Movement primitive",
    lead="Fits a dynamic movement primitive to each coordinate, averaged over the demonstrations.",
    run="kendama_cli.stages.encode.stage:Encode",
    returns="kendama_cli.artifacts.motion_plan:MotionPlan",
    settings={"encode": EncodeSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.encode.chapter:encode_figures",
    headline=(Headline("rmse_mm", "error of the movement primitive"),),
    brief="fitted to {rmse_mm:.1f} mm by {n_parameters} parameters",
    metrics={
        "n_parameters": "Number of parameters of one coordinate: goal, duration and weights.",
        "rmse_mm": (
            "Root mean square distance of the demonstrations from their own primitives; smaller is better, 1 mm "
            "is good."
        ),
        "max_error_mm": "Largest distance of a demonstration from its own primitive; smaller is better.",
        "duration_s": "Duration of the average primitive at tau 1.",
        "spread_mm": "Root mean square distance of the demonstrations from their average; small means that they agree.",
        "spread_max_mm": "Largest distance of a demonstration from the average at one phase.",
        "duration_spread_s": "Standard deviation of the demonstrations' durations.",
        "width": "Width of the basis functions, relative to their distance.",
        "outliers": "Names of the demonstrations that lie far from the others, or none.",
        "averaged": "Number of demonstrations in the average.",
        "turn_rmse_deg": "Root mean square error of the encoded rotation of the cup; smaller is better.",
        "tilt_max_deg": "Largest tilt of the cup's axis in the average primitive.",
        "spin_max_deg": "Largest rotation of the cup about its own axis in the average primitive.",
    },
    topic_words={
        "/encode/demonstrated": "Recorded path of the cup, cut to its motion, for each demonstration.",
        "/encode/own": "Path that each demonstration's own primitive reproduces.",
        "/encode/reproduced": "Path of the average primitive, which the next stages use.",
        "/encode/weights": "Weights of the basis functions, of each demonstration and of the average.",
    },
    figures={
        "encode-path": (
            "Side view of the demonstrated paths (grey) and of the path that the average primitive reproduces (blue)."
        ),
        "encode-time": "Demonstrated and reproduced coordinates over time; both lines should coincide.",
        "encode-own": "Each demonstration beside the path of its own primitive, with the distance between them.",
        "encode-error": "Distance of each primitive from its demonstration over time; the peaks show the hardest part.",
        "encode-weights": (
            "Weights of the basis functions by phase; grey lines that lie together are demonstrations that agree."
        ),
    },
    methods=(
        "Each Cartesian coordinate of the cup was encoded as a dynamic movement primitive with "
        "{encode.functions} basis functions.",
        "Their weights were found by the regression '{encode.regression}', with a spring constant of "
        "{encode.stiffness}, and averaged over {averaged} demonstrations.",
        "The primitive reproduces the demonstrations with an error of {rmse_mm} rms.",
    ),
)
