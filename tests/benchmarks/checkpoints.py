"""Cost of checkpointing: its fraction of a learning run's time.

``python -m tests.benchmarks.checkpoints`` learns in DART as the worker does, onto the disk of the present folder, and
prints the time spent in saving over all time. The peer is the same run without saving.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from kendama_cli.pipeline.context import WorkerContext
from kendama_cli.stages.interface import State
from kendama_cli.stages.learn.messages import TOPICS
from kendama_cli.stages.learn.stage import Learn
from kendama_cli.store.checkpoint import CheckpointFolder
from tests.learning.settings_files import game_settings, learn_settings

SEED = 10000
ROLLOUTS = 2000


class Timed(WorkerContext):
    """The worker's context, with a clock around every checkpoint that is saved."""

    saving_s = 0.0
    saved = 0

    def checkpoint(self, state: Callable[[], State], *, force: bool = False) -> None:
        """As the worker's, timed."""
        due_s, began = self._due_s, time.perf_counter()
        super().checkpoint(state, force=force)
        self.saving_s += time.perf_counter() - began
        self.saved += self._due_s != due_s


def main(rollouts: int = ROLLOUTS) -> None:
    """Print the share."""
    settings = learn_settings(count__evaluation_rollouts=rollouts)
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as folder:
        checkpoints = CheckpointFolder(Path(folder))
        context = Timed(seed=SEED, checkpoints=checkpoints, topics=TOPICS, emit=lambda _: None)
        stage = Learn(learn=settings, game=game_settings())
        stage.prepare()
        began = time.perf_counter()
        stage.run({}, context)
        whole_s = time.perf_counter() - began
    rest_s = whole_s - context.saving_s
    print(f"learning in DART                   {rest_s:10.2f} s")
    print(f"checkpoints saved                  {context.saved:10d}")
    print(f"saving them                        {context.saving_s:10.4f} s   {context.saving_s / rest_s:.4f} x learning")


if __name__ == "__main__":
    main()
