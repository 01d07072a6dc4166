"""Cameras of the part, for the entry point group ``kendama.cameras``."""

from kendama_cli.schema.registry import Variant

FILE = Variant(
    "file", settings="kendama_cli.settings.camera:FileCamera", makes="kendama_cli.plugins.cameras.file:open_file"
)
DEVICE = Variant(
    "device",
    settings="kendama_cli.settings.camera:DeviceCamera",
    makes="kendama_cli.plugins.cameras.device:open_device",
    needs="a camera that OpenCV can open",
)
