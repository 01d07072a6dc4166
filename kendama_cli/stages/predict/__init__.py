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
    headline=(Headline("position_error_mm_p50", "median error of the predicted catch"),),
    brief="{position_error_mm_p50:.1f} mm off, {prediction_horizon_ms:.0f} ms ahead",
    metrics={
        "position_error_mm_p50": (
            "Median error of the predicted catch position at the stated fraction of the flight; below 5 mm is good."
        ),
        "position_error_mm_p95": "Error of the predicted catch position that 95 % of the flights stay below.",
        "time_error_ms_p50": "Median error of the predicted catch time, earlier or later.",
        "time_error_ms_p95": "Error of the predicted catch time that 95 % of the flights stay below.",
        "time_error_rms_ms": "Root mean square error of the predicted catch time; smaller is better.",
        "prediction_horizon_ms": (
            "Median time that remains until the catch when the prediction is stated; longer leaves more time to move."
        ),
        "observed_fraction": "Fraction of the flight that had been observed when the prediction is stated.",
        "flights": "Number of simulated flights.",
        "predicted_rate": "Fraction of the flights for which there was a prediction; 1 is best.",
        "detection_rate": "Fraction of the images in which the ball was detected; 1 is best.",
        "onset_delay_ms_p50": "Median delay with which the start of the flight is detected in the images.",
        "onset_delay_ms_p95": "Delay of the detected start of the flight that 95 % of the flights stay below.",
        "onset_false_alarms": "Number of flights whose start was reported too early; 0 is best.",
    },
    topic_words={
        "/predict/detection": "Ball that was detected in one image of one camera.",
        "/predict/estimate": "Predicted crossing of the rim plane after each image, with standard deviations.",
        "/predict/error": "Error of one prediction in position and time, and its horizon.",
        "/predict/ball": "True position of the ball.",
        "/predict/image/*": "Camera images of one flight; * stands for the camera's name.",
    },
    figures={
        "predict-mm": "Error of the predicted position over the time that remains to the catch: median and bands.",
        "predict-ms": "Error of the predicted time over the time that remains to the catch: median and bands.",
        "predict-estimate": (
            "Distance of each estimate of one flight from the last, beside its stated standard deviation."
        ),
        "compare-mm": "Error of the predicted position over the remaining time, for each group of a comparison.",
        "compare-ms": "Error of the predicted time over the remaining time, for each group of a comparison.",
    },
    methods=(
        "The catch was predicted for {predict.flights} flights from images at {camera.rate_hz} with the "
        'detector "{predict.detector.kind}" and the flight model "{predict.motion.kind}".',
    ),
)
