"""A live stream as it is stored on disk: a row for every pose that came, in the source's own axes."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.recording_format import STREAM_HEADER
from kendama_cli.devices.recordings.text_table import filled_rows, numbers
from kendama_cli.errors import ConfigError


class StreamFile:
    """Writes rows to ``path`` as they come; raises ConfigError where the file exists already."""

    def __init__(self, path: Path, name: str) -> None:
        self.path, self.count = path, 0
        try:
            self._file = path.open("x", encoding="utf-8", buffering=1)
        except FileExistsError:
            raise ConfigError(
                "capture.record",
                f"'capture.record' is {path}, which exists; a recording is never overwritten: name another",
            ) from None
        self._file.write(f"# {name}\n{STREAM_HEADER}\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def write(self, row: tuple[float, ...]) -> None:
        """Write one pose (8 numbers), durable against the end of this process."""
        self._file.write(",".join(f"{value:.7g}" if i else f"{value:.6f}" for i, value in enumerate(row)) + "\n")
        self.count += 1


def read_stream(path: str, text: str) -> BodyTrack:
    """Read the body in the file; a row that was cut short at the end is left out."""
    lines = text.splitlines()
    head = lines.index(STREAM_HEADER)
    rows = [row for row in filled_rows(text, "comma", head + 2) if len(row.cells) == 8]
    table = numbers(path, rows, range(8), STREAM_HEADER.split(","))
    name = lines[0].lstrip("# ") if head else Path(path).stem
    return BodyTrack(name, table[:, 0] - table[0, 0], table[:, 1:4], table[:, 4:])
