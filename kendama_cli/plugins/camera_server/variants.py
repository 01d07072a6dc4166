"""Cameras behind a server, as a declaration for the entry point group ``kendama.cameras``."""

from kendama_cli.schema.registry import Variant

REMOTE = Variant(
    "remote",
    settings="kendama_cli.plugins.camera_server.settings:RemoteCamera",
    makes="kendama_cli.plugins.camera_server.remote:open_remote",
    needs="'kendama camera serve' on the cameras' machine: docs/plugins/camera-server.md",
)
