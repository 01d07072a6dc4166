"""A process that logs 200 MB of random images and prints what it logged and by how much its memory grew [MB]."""

import os
import resource
import sys
from pathlib import Path

from kendama_cli.log.writer import McapLog
from kendama_cli.schema.foxglove import CompressedImage
from kendama_cli.store.checkpoint import DurableAppendFile

IMAGE_BYTES = 100_000


def main() -> None:
    """Log, take positions as checkpoints do, and finish."""
    folder = Path(sys.argv[1])
    file = DurableAppendFile(folder / "log.part")
    log = McapLog({"/image": CompressedImage}, file)
    log.write("/image", 0.0, CompressedImage("left", "jpeg", os.urandom(IMAGE_BYTES)))
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for step in range(1, 2100):
        log.write("/image", 0.01 * step, CompressedImage("left", "jpeg", os.urandom(IMAGE_BYTES)))
        if step % 500 == 0:
            file.sync()
            log.position()
    log.finish(folder / "log.mcap", stage="x", settings={}, metrics={})
    after_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print((folder / "log.mcap").stat().st_size / 1e6, (after_kb - before_kb) / 1e3)


if __name__ == "__main__":
    main()
