"""Makes README's video from the newest default run: ``kendama run && python data/video.py [FOLDER]``.

It shows the caught swing of ``adapt`` at its own speed, then a full game of ``transfer``: the learned swing-up, and the
catch at an eighth of its speed. An animated WebP of six seconds, at most 1 MB, takes the place of
``pictures/kendama.webp``; its XMP says when the two catches were, so that a test can hold them to a run's. With a
FOLDER the frames are also written there as PNG.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from kendama_cli.config.site import find_site
from kendama_cli.log.reader import logged_settings
from kendama_cli.pipeline.report import logs_of
from kendama_cli.pipeline.run_selection import select_runs
from kendama_cli.plugins.publication.video_maker import VideoMaker
from kendama_cli.report.chapters import declaration_of, performances
from kendama_cli.report.replay.performance import Performance
from kendama_cli.report.source import StageLog
from kendama_cli.settings.game import GameSettings

VIDEO = Path(__file__).parent / "pictures" / "kendama.webp"
WIDTH_PX, HEIGHT_PX, RATE_HZ, QUALITY = 640, 480, 16, 60
SEEN = slice(70, 670), slice(230, 1030)
"""Rows and columns of the ray caster's pictures that the video shows."""
INK_BGR, PAPER_BGR = (70, 60, 60), (250, 248, 246)


@dataclass(frozen=True)
class Part:
    """Part of the video: its caption, and the times of the motion from its catch, played at ``speed``."""

    stage: str
    caption: str
    start_s: float
    end_s: float
    speed: float

    def times(self, catch_s: float) -> NDArray[np.float64]:
        """Return the motion's time of each frame."""
        count = round((self.end_s - self.start_s) / self.speed * RATE_HZ)
        return catch_s + self.start_s + np.arange(count) * self.speed / RATE_HZ


PARTS = (
    Part("adapt", "1  The arm repeats a recorded swing, and catches", -1.4, 0.4, 1.0),
    Part("transfer", "2  A swing-up that it learned by trying", -1.8, -0.16, 1.0),
    Part("transfer", "3  The catch, at 1/8 speed", -0.16, 0.16, 1 / 8),
)


def main(folder: Path | None) -> None:
    """Write the video of the newest run of the home folder."""
    (record,) = select_runs(find_site(None).home, [])
    made = {stage: motion_of(record, stage) for stage in {part.stage for part in PARTS}}
    frames = [frame for part in PARTS for frame in pictures(part, *made[part.stage])]
    images = [Image.fromarray(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)) for frame in frames]
    catches = json.dumps({stage: motion.catch_s for stage, (motion, _) in made.items()}, sort_keys=True)
    images[0].save(
        VIDEO,
        save_all=True,
        append_images=images[1:],
        duration=1000 // RATE_HZ,
        loop=0,
        quality=QUALITY,
        method=6,
        xmp=catches.encode(),
    )
    for number, image in enumerate(images if folder is not None else []):
        image.save(folder / f"{number:03}.png")


def catches_in(video: Path) -> dict[str, float]:
    """Return the times of the catches [s] that a video shows, by stage."""
    with Image.open(video) as image:
        return {str(stage): float(catch_s) for stage, catch_s in json.loads(image.info["xmp"]).items()}


def motion_of(record: Any, stage: str) -> tuple[Performance, GameSettings]:
    """Return the last motion of a ball that the stage logged, with the game that it was played with."""
    declaration = declaration_of(stage, {})
    assert declaration is not None
    log = StageLog(logs_of(record)[stage])
    motion = [one for one in performances(declaration, log) if "ball" in one.bodies.names][-1]
    return replace(motion, label=""), logged_settings(GameSettings, log.settings["game"], "game", log.path)


def pictures(part: Part, motion: Performance, game: GameSettings) -> Iterator[NDArray[np.uint8]]:
    """Yield the frames of a part, blue green red."""
    assert motion.catch_s is not None
    maker = VideoMaker(motion, game)
    for t_s in part.times(motion.catch_s):
        small = cv2.resize(maker.image(float(t_s), 1.0)[SEEN], (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
        picture = np.ascontiguousarray(small, dtype=np.uint8)
        cv2.rectangle(picture, (0, HEIGHT_PX - 40), (WIDTH_PX, HEIGHT_PX), PAPER_BGR, -1)
        place = (16, HEIGHT_PX - 14)
        cv2.putText(picture, part.caption, place, cv2.FONT_HERSHEY_DUPLEX, 0.62, INK_BGR, 1, cv2.LINE_AA)
        yield picture


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
