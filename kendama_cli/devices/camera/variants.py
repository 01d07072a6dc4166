"""The cameras that come with kendama, as declarations for the entry point group ``kendama.cameras``.

``makes`` is called as an OpenCameras (see interface.py) and returns one Camera per calibrated model.
"""

from kendama_cli.schema.registry import Variant

VIRTUAL = Variant(
    "virtual",
    settings="kendama_cli.settings.camera:VirtualCamera",
    makes="kendama_cli.devices.camera.virtual:open_virtual",
)
