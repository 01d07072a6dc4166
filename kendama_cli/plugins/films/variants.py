"""Detectors of this part, as declarations for the entry point group ``kendama.detectors``."""

from kendama_cli.schema.registry import Variant

TRAINED = Variant(
    "trained",
    settings="kendama_cli.plugins.films.settings:TrainedDetectorSettings",
    makes="kendama_cli.plugins.films.trained_file:trained_detector",
)
NETWORK = Variant(
    "network",
    settings="kendama_cli.plugins.films.settings:NetworkDetectorSettings",
    makes="kendama_cli.plugins.films.network_file:network_detector",
)
