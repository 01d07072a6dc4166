"""Progress of a transfer between two rollouts: all that a checkpoint needs to resume bit for bit."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.control.catch_game import Game
from kendama_cli.control.settings import TransferSettings
from kendama_cli.learning.interface import Learner
from kendama_cli.learning.learners import begin_learner, joined_state, parted_state, resume_learner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.random_stream import random_stream


@dataclass(frozen=True)
class GameFigures:
    """Figures of a game, None if not measured; ``frames`` counts images, ``seen`` those with the ball."""

    swung_up: bool
    caught: bool
    error_mm: float | None
    """Error of the crossing that was predicted some time before it."""
    frames: int
    seen: int
    latency_frames: float | None

    @staticmethod
    def of(game: Game, horizon_s: float) -> GameFigures:
        """Return the figures of ``game``, its prediction taken ``horizon_s`` before the crossing."""
        error_m, observed = game.prediction_error_m(horizon_s), game.observed
        return GameFigures(
            swung_up=game.swung_up,
            caught=game.caught,
            error_mm=None if error_m is None else 1e3 * error_m,
            frames=len(observed.frames),
            seen=observed.seen,
            latency_frames=observed.latency_frames,
        )


@dataclass(frozen=True)
class RopeFitFigures:
    """Fit of the imitation: the real rope's length over the model's, and whether the arm follows that."""

    rope_scale: float
    resized: bool


@dataclass(frozen=True)
class AttemptFigures:
    """One attempt at the imitation: its aim (adaptation.aim), and what came of it in the world.

    ``along_m`` is None for the motion as planned. ``miss_m`` is the ball beside the planned cup, None where it never
    came down, ``apex_m`` its maximum height over the rim, None where the ball is not tracked. ``led`` is False before
    the servo was known that led later attempts. ``outcome`` are the words for it, empty where it was measured.
    """

    along_m: float | None
    shift_m: tuple[float, float]
    caught: bool
    miss_m: tuple[float, float] | None
    apex_m: float | None
    led: bool
    outcome: str = ""
    path_m: tuple[float, ...] = ()
    """Ends of the path of motions that the aim was chosen from; in ``bent`` a search's changes of the motion."""
    bent: tuple[float, ...] = ()

    @staticmethod
    def of(numbers: Mapping[str, Any]) -> AttemptFigures:
        """Return the attempt of JSON values."""
        miss_m, (x, y) = numbers["miss_m"], numbers["shift_m"]
        missed = None if miss_m is None else (float(miss_m[0]), float(miss_m[1]))
        ends = {name: tuple(numbers[name]) for name in ("path_m", "bent")}
        return AttemptFigures(**{**numbers, **ends, "shift_m": (float(x), float(y)), "miss_m": missed})


@dataclass(frozen=True)
class UntoldRollout:
    """Rollout that was played and whose outcome is not told yet: it is, from byte ``since`` of a file on."""

    phase: str
    figures: AttemptFigures
    since: int

    @staticmethod
    def of(numbers: Mapping[str, Any]) -> UntoldRollout:
        """Return the rollout of JSON values."""
        return UntoldRollout(numbers["phase"], AttemptFigures.of(numbers["figures"]), int(numbers["since"]))


Start = Literal["table", "scratch"]
"""Start of a learner on the hardware: the policy that was handed over (mostly a table), or nothing."""
STARTS: tuple[Start, ...] = ("table", "scratch")
_RESULTS = ("before", "after", "imitation", "repeats", "games")


class Progress:
    """Results by step, the learners between two rollouts, the simulated clock of the log, and the seed of it all.

    Every rollout draws from a stream of its own (step, number), so that nothing depends on a rollout that broke off.
    """

    def __init__(self, state: Mapping[str, Any], learn: LearnSettings, transfer: TransferSettings) -> None:
        self.before: list[bool] = list(state["before"])
        self.after: list[bool] = list(state["after"])
        self.attempts = [AttemptFigures.of(one) for one in state["imitation"]]
        self.repeats: list[bool] = list(state["repeats"])
        self.untold = None if state["untold"] is None else UntoldRollout.of(state["untold"])
        self.rope_fit = None if state["rope_fit"] is None else RopeFitFigures(**state["rope_fit"])
        self.servo = None if state["servo"] is None else _servo(state["servo"])
        self.games = [GameFigures(**game) for game in state["games"]]
        self.clock_s = float(state["clock_s"])
        self.missed = int(state["missed"])
        self._seed = int(state["seed"])
        self._learn = learn
        self._cap = transfer.max_rollouts
        self._frozen = max(transfer.solved_streak, learn.count.learned_streak)
        self._learners: dict[str, dict[str, Any]] = {start: joined_state(state, start) for start in STARTS}
        self._missed_here = 0

    @classmethod
    def resumed(
        cls,
        state: Mapping[str, Any] | None,
        policy: PolicyArtifact | None,
        learn: LearnSettings,
        transfer: TransferSettings,
        rng: np.random.Generator,
    ) -> Progress:
        """Return the progress of ``state``, or the beginning with ``policy``; None where nothing is to be learned."""
        if state is not None:
            return cls(state, learn, transfer)
        fresh: dict[str, Any] = {name: [] for name in _RESULTS}
        fresh |= {
            "untold": None,
            "rope_fit": None,
            "servo": None,
            "clock_s": 0.0,
            "missed": 0,
            "seed": int(rng.integers(2**63)),
        }
        fresh |= parted_state(begin_learner(learn, policy).state(), "table")
        fresh |= parted_state(begin_learner(learn).state(), "scratch")
        return cls(fresh, learn, transfer)

    def saved(self) -> dict[str, Any]:
        """Return the state to checkpoint: arrays and JSON values."""
        saved: dict[str, Any] = {
            "before": list(self.before),
            "after": list(self.after),
            "imitation": [dataclasses.asdict(one) for one in self.attempts],
            "repeats": list(self.repeats),
            "untold": None if self.untold is None else dataclasses.asdict(self.untold),
            "rope_fit": None if self.rope_fit is None else dataclasses.asdict(self.rope_fit),
            "servo": None if self.servo is None else _numbers(self.servo),
            "games": [dataclasses.asdict(game) for game in self.games],
            "clock_s": self.clock_s,
            "missed": self.missed,
            "seed": self._seed,
        }
        for start, learner in self._learners.items():
            saved |= parted_state(learner, start)
        return saved

    def rng(self, step: str, number: int) -> np.random.Generator:
        """Return the random stream of one rollout."""
        return random_stream(self._seed, step, number)

    def learner(self, start: Start = "table") -> Learner:
        """Return a learner that resumes from its last finished rollout."""
        return resume_learner(self._learn, self._learners[start])

    def keep(self, learner: Learner, start: Start = "table") -> None:
        """Store ``learner`` after a finished rollout, for the next one to resume from."""
        self._learners[start] = learner.state()

    @property
    def policy(self) -> PolicyArtifact:
        """Policy that was handed over as learning left it, sealed."""
        return self.learner().policy

    def learned(self, start: Start = "table") -> bool:
        """Return True if the counting rule's streak of greedy successes has been reached."""
        return self.learner(start).count.learned

    def frozen(self, start: Start) -> bool:
        """Return True if learning is over: at the streak that freezes the table (from scratch: counts), or the cap."""
        count = self.learner(start).count
        enough = count.streak >= self._frozen if start == "table" else count.learned
        return enough or count.rollouts >= self._cap

    def rollouts(self, start: Start = "table") -> int:
        """Return the rollouts to learn on the hardware by the counting rule; the cap if that failed."""
        learned_at = self.learner(start).count.learned_at
        return self._cap if learned_at is None else learned_at

    def rollouts_to_solved(self) -> int:
        """Return the rollouts on the hardware until the table handed over was solved; the cap if it never was."""
        solved_after = self.learner().count.solved_after
        return self._cap if solved_after is None else solved_after

    def solved(self) -> bool | None:
        """Return True if the table is solved; None if learning ends before it can be."""
        return self.learner().count.solved if self._frozen >= self._learn.count.solved_streak else None

    def reverted(self) -> bool:
        """Return True if learning made the table worse: it is not solved, and fewer frozen rollouts succeed."""
        return not self.solved() and float(np.mean(self.after)) < float(np.mean(self.before))

    def kept(self, handed_over: PolicyArtifact) -> PolicyArtifact:
        """Return the policy of the games: as it is now, or ``handed_over`` if learning made it worse."""
        return handed_over if self.reverted() else self.policy

    @property
    def imitation(self) -> list[bool]:
        """Outcome of each attempt at the imitation: True where it was caught."""
        return [one.caught for one in self.attempts]

    @property
    def count(self) -> int:
        """Number of all rollouts, plays and games so far."""
        frozen = len(self.before) + len(self.after) + len(self.imitation) + len(self.repeats) + len(self.games)
        return frozen + sum(self.learner(start).count.rollouts for start in STARTS)

    def finished(self, duration_s: float, missed: int) -> None:
        """Count a rollout of ``duration_s``; ``missed`` counts since this process opened the line."""
        self.clock_s += duration_s
        self.missed += missed - self._missed_here
        self._missed_here = missed


def _numbers(servo: ServoModel) -> dict[str, Any]:
    """Return ``servo`` as JSON values."""
    fields = dataclasses.asdict(servo)
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in fields.items()}


def _servo(numbers: Mapping[str, Any]) -> ServoModel:
    """Return the servo of ``_numbers``."""
    return ServoModel(**{**numbers, "joint_names": tuple(numbers["joint_names"])})
