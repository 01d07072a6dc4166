"""The stage ``predict``, declared."""

from __future__ import annotations

from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.predict.messages import TOPICS
from kendama_cli.vision.settings import PredictSettings

STAGE = StageDeclaration(
    name="predict",
    title="Catch prediction",
    lead="Predicts where and when to catch the ball from camera images of free flights.",
    run="kendama_cli.stages.predict.stage:Predict",
    returns="kendama_cli.artifacts.prediction:PredictionStudy",
    settings={"predict": PredictSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.predict.chapter:prediction_figures",
    ensemble_chapter="kendama_cli.stages.predict.comparison:CHAPTER",
    headline=(Headline("position_error_mm_p50", "median error of the predicted catch"),),
)
