"""Settings of cameras behind a server."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.schema.settings import setting
from kendama_cli.settings.camera import CameraRig, Source


@dataclass(frozen=True)
class RemoteCamera(CameraRig):
    """Live cameras of 'kendama camera serve', chosen by their names."""

    source: ClassVar[Source] = "live"

    kind: Literal["remote"] = setting("The images come from the cameras of 'kendama camera serve'.")
    host: str = setting("Name or address of the machine that serves the cameras.")
    port: int = setting("TCP port on which they are served.", above=0, at_most=65535)
    key_file: str = setting("File of the key that both machines share; 'kendama robot key' makes one.")
    rate_hz: float = setting("Images per second that the server's cameras take [Hz].", above=0)
    jpeg_quality: int | None = setting(
        "JPEG quality of the images on the line; null sends them unchanged, in many more bytes.",
        at_least=10,
        at_most=100,
    )
