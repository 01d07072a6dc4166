"""Settings of ``capture=video``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.devices.demonstrator.settings import PlausibleSettings
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class SwingVideoCapture:
    """Videos of a swing from the side, with boxes about ball and cup (``kendama camera train VIDEO --cup``)."""

    streams: ClassVar[bool] = True
    """Its progress is told: the images that were read."""
    plausible: PlausibleSettings
    kind: Literal["video"] = setting("The demonstrations are videos that show ball, cup and string from the side.")
    path: str | tuple[str, ...] | None = setting(
        "Video, glob or list of them; the boxes of each lie beside it, in VIDEO-boxes.",
        file=True,
        brings="kendama_cli.plugins.films.swing_boxes:box_files",
    )
    string_m: float | None = setting(
        "Length of the string, from where it leaves the cup to the ball's centre [m]; all lengths scale with it. null "
        "takes the scale from gravity in the ball's free flight.",
        above=0,
    )
    tie_m: float = setting(
        "Height of the middle of the cup's box above the point where the string leaves the cup [m].", at_least=0
    )
    rate_hz: float | None = setting(
        "Images per second at which a slow-motion video was recorded [Hz]; null takes the times of the video.", above=0
    )
    max_gap_s: float = setting(
        "Gaps without the cup of up to this duration are interpolated; longer ones end a swing [s].", above=0
    )
    segments: Literal["auto", "one"] = setting(
        "Swings in one video: 'auto' splits it where the hand rests, 'one' takes each stretch without a gap as one."
    )

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no video; set it to a file, a glob or a list of files")
        if self.string_m is not None and self.tie_m >= self.string_m:
            raise ConfigError(
                "tie_m", f"'tie_m' is {self.tie_m:g}; allowed: below string_m, which is {self.string_m:g}"
            )
