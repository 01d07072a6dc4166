"""A printed marker on the cup, in films and before a camera; for ``kendama.demonstrators``."""

from kendama_cli.schema.registry import Variant

MARKER = Variant(
    "marker",
    settings="kendama_cli.plugins.marker.settings:MarkerCapture",
    makes="kendama_cli.plugins.marker.films:open_marker",
)
MARKER_LIVE = Variant(
    "marker_live",
    settings="kendama_cli.plugins.marker.settings:MarkerLiveCapture",
    makes="kendama_cli.plugins.marker.live:open_marker_live",
)
