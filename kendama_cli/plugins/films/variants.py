"""Detectors of this part, as declarations for the entry point group ``kendama.detectors``."""

from kendama_cli.schema.registry import Variant

TRAINED = Variant(
    "trained",
    settings="kendama_cli.plugins.films.settings:TrainedDetectorSettings",
    makes="kendama_cli.plugins.films.trained_file:trained_detector",
)
