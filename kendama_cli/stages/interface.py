"""Inputs and result of a stage.

A stage is a class whose constructor takes its settings by keyword (the names in the pipeline's ``config``) and whose
``run`` takes the artifacts of the stages it needs, computes, and gives one artifact with metrics. It reaches files,
clocks and processes only through its context and its blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:  # a declaration may stand beside its stage in one file, and imports nothing heavy
    import numpy as np

Metric = float | int | bool | str | None
State = Mapping[str, Any]
"""What a checkpoint holds: numpy arrays and JSON values by name."""


class LogWriter(Protocol):
    """The stage's MCAP log; its topics and their message types are those that the stage declares."""

    def write(self, topic: str, t_s: float, message: object) -> None:
        """Append one message at simulated (or recorded) time ``t_s``.

        Raises LogMessageError for a topic that is not declared, and for a message that is not of its type.
        """


class StageContext(Protocol):
    """Services of the worker to a running stage."""

    log: LogWriter

    def rng(self, purpose: str) -> np.random.Generator:
        """Return the random stream for ``purpose``, derived from the top-level seed; its state travels with
        checkpoints.
        """

    def restore(self) -> State | None:
        """Return the newest intact checkpoint of this computation, or None; log and random streams are restored too."""

    def checkpoint(self, state: Callable[[], State], *, force: bool = False) -> None:
        """Save what ``state()`` returns, durably on return; called often, it saves only when one is due (or forced)."""

    def ask(self, question: str) -> str | None:
        """Return the line that a person at the terminal answers; None where there is none, or no answer will come."""

    def progress(self, done: int, total: int | None, **figures: float | int | str) -> None:
        """Report where the work stands to who watches the run, with a few named figures."""


@dataclass(frozen=True)
class StageResult:
    """Result of a stage: an artifact of the dataclass that its declaration names, and its metrics.

    ``warnings`` are sentences about what is suspicious but possible; they stand in the closing lines of a run and in
    its report, and among the metrics as ``warnings``, one a line. A metric ``completed`` that is False says that the
    stage stopped before its end and this is what it had: it is kept, and ``kendama run`` ends with exit code 1.
    """

    artifact: Any
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


class Stage(Protocol):
    """One step of a pipeline.

    A stage may also have ``prepare() -> None``: load what ``run`` will need (compiled code, say), changing nothing
    that a result depends on. A sweep calls it in the process from which its workers are forked.
    """

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Compute from ``given`` (artifacts by the names in the pipeline's ``needs``)."""
