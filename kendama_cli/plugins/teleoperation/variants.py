"""People at a distance as demonstrators: in a browser, and at a haptic device; for ``kendama.demonstrators``."""

from kendama_cli.schema.registry import Variant

PLAY = Variant(
    "play",
    settings="kendama_cli.plugins.teleoperation.play.settings:PlayCapture",
    makes="kendama_cli.plugins.teleoperation.play.capture:open_tries",
)
HAPTIC = Variant(
    "haptic",
    settings="kendama_cli.plugins.teleoperation.haptic.settings:HapticCapture",
    makes="kendama_cli.plugins.teleoperation.haptic.device:open_haptic",
    needs="a haptic device behind an OpenIGTLink server",
)
