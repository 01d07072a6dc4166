"""Clock of cameras that no robot drives."""

from __future__ import annotations

import time


class Clock:
    """The wall's time where cameras are live, else a time that is set."""

    def __init__(self, *, live: bool) -> None:
        self.live, self.set_s = live, 0.0
        self._began_s = time.monotonic()

    def __call__(self) -> float:
        return time.monotonic() - self._began_s if self.live else self.set_s

    def wait(self, duration_s: float) -> None:
        """Let ``duration_s`` pass."""
        if self.live:
            time.sleep(duration_s)
        else:
            self.set_s += duration_s
