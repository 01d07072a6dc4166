"""The detector and the demonstrator of this part, for ``kendama.detectors`` and ``kendama.demonstrators``."""

from kendama_cli.schema.registry import Variant

TRAINED = Variant(
    "trained",
    settings="kendama_cli.plugins.films.settings:TrainedDetectorSettings",
    makes="kendama_cli.plugins.films.trained_detector:trained_detector",
)
VIDEO = Variant(
    "video",
    settings="kendama_cli.plugins.films.swing_settings:SwingVideoCapture",
    makes="kendama_cli.plugins.films.swing_video:open_swing_videos",
)
