"""The hand that plays in the browser, as a declaration for the entry point group ``kendama.demonstrators``."""

from kendama_cli.schema.registry import Variant

PLAY = Variant(
    "play",
    settings="kendama_cli.devices.hand.play.settings:PlayCapture",
    makes="kendama_cli.devices.hand.play.capture:open_tries",
)
