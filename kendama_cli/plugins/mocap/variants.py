"""Motion capture, in files and as a stream; for ``kendama.demonstrators``."""

from kendama_cli.schema.registry import Variant

BODY = Variant(
    "body",
    settings="kendama_cli.plugins.mocap.settings:BodyCapture",
    makes="kendama_cli.plugins.mocap.body:open_bodies",
    packages=("kendama.recordings",),
)
MOCAP = Variant(
    "mocap",
    settings="kendama_cli.plugins.mocap.settings:MocapCapture",
    makes="kendama_cli.plugins.mocap.live:open_mocap",
    needs="a motion capture system that streams rigid bodies",
)
