"""The hands that come with kendama, as declarations for the entry point group ``kendama.hands``.

``makes`` is called with the hand's settings and gives a sequence of HandDevice, one per demonstration, in order.
"""

from kendama_cli.schema.registry import Variant

FILE = Variant(
    "file", settings="kendama_cli.devices.hand.settings:FileCapture", makes="kendama_cli.devices.hand.file:open_files"
)
MOCAP = Variant(
    "mocap",
    settings="kendama_cli.devices.hand.settings:MocapCapture",
    makes="kendama_cli.devices.hand.mocap:open_mocap",
)
HAPTIC = Variant(
    "haptic",
    settings="kendama_cli.devices.hand.settings:HapticCapture",
    makes="kendama_cli.devices.hand.haptic:open_haptic",
)
