"""The detectors that come with kendama, as declarations for the entry point group ``kendama.detectors``.

``makes`` is called with the detector's settings and returns a Detector (see interface.py).
"""

from kendama_cli.schema.registry import Variant

COLOUR = Variant(
    "colour",
    settings="kendama_cli.vision.settings:ColourDetectorSettings",
    makes="kendama_cli.vision.detection.colour_detector:colour_detector",
)
