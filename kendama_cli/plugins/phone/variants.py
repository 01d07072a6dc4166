"""A phone's inertial recording as a demonstrator; for ``kendama.demonstrators``."""

from kendama_cli.schema.registry import Variant

PHONE = Variant(
    "phone",
    settings="kendama_cli.plugins.phone.settings:PhoneCapture",
    makes="kendama_cli.plugins.phone.swings:open_phone",
)
