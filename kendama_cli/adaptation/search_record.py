"""What a search for a catch has tried and found so far; a search that was cut off goes on from it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from math import hypot
from typing import Any, Protocol

from kendama_cli.adaptation.uncertainty import Repeat
from kendama_cli.physics.rim_crossing import SLACK_S


@dataclass(frozen=True)
class MotionVariation:
    """What is adapted: ``shift_m`` moves the goal along x and y within the share ``flight`` of the motion.

    ``bumps_m`` are the heights of the bumps by which the path is bent (path_bumps); none where there are none.
    """

    tau_scale: float
    amplitude: float = 1.0
    shift_m: tuple[float, float] = (0.0, 0.0)
    flight: tuple[float, float] = (0.0, 1.0)
    bumps_m: tuple[float, ...] = ()

    @property
    def shifted(self) -> bool:
        """Whether the goal is moved at all."""
        return self.shift_m != (0.0, 0.0)


@dataclass(frozen=True)
class Attempt:
    """One rollout of the search; misses and ``apex_m`` as in RolloutResult.

    ``flight`` is the share of the motion in which the ball flew, ``swing_slack_s`` as in RolloutResult; ``limit``
    tells which limit of the arm forbade the motion, so that nothing was played; ``steered_m`` is how far a seen catch
    moved the cup beside its plan.
    """

    variation: MotionVariation
    caught: bool
    signed_miss_m: float | None
    side_miss_m: float | None
    apex_m: float
    flight: tuple[float, float] | None
    limit: str | None = None
    swing_slack_s: float = 0.0
    steered_m: float = 0.0

    @property
    def slack_in_swing(self) -> bool:
        """Whether the rope hung slack in the swing: then its mass, which no model here has, decides the miss."""
        return self.swing_slack_s >= SLACK_S

    @property
    def off_m(self) -> float:
        """How far from the cup's middle the ball came down; infinite where it did not."""
        return hypot(self.signed_miss_m, self.side_miss_m or 0.0) if self.signed_miss_m is not None else float("inf")


@dataclass(frozen=True)
class Trial:
    """What to play next: a nominal ``attempt``, or perturbed world ``index`` to ``evaluate`` or ``confirm`` in.

    A policy search plays other kinds: rollout ``index`` to ``explore``, all of a generation in one perturbed world, and
    repeat ``index`` to ``prove`` by, in a world that nothing was played in.
    """

    kind: str
    variation: MotionVariation
    index: int


@dataclass(frozen=True)
class Search:
    """All results so far: attempts in order, the worlds that judged each candidate, and the chosen motion's repeats.

    ``short_of_reach`` are the catches in whose flight a seen catch cannot go as far as is asked for, each with the
    reason: they are taken by no race.
    """

    attempts: tuple[Attempt, ...] = ()
    evaluated: tuple[tuple[MotionVariation, tuple[Repeat, ...]], ...] = ()
    confirmed: tuple[Repeat, ...] = ()
    short_of_reach: tuple[tuple[MotionVariation, str], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "attempts": [asdict(one) for one in self.attempts],
            "evaluated": [
                [asdict(variation), [asdict(repeat) for repeat in repeats]] for variation, repeats in self.evaluated
            ],
            "confirmed": [asdict(one) for one in self.confirmed],
            "short_of_reach": [[asdict(variation), reason] for variation, reason in self.short_of_reach],
        }

    @staticmethod
    def from_json(state: Mapping[str, Any]) -> Search:
        """The search that ``to_json`` wrote."""
        return Search(
            tuple(_attempt(one) for one in state["attempts"]),
            tuple(
                (_variation(variation), tuple(Repeat(**one) for one in repeats))
                for variation, repeats in state["evaluated"]
            ),
            tuple(Repeat(**one) for one in state["confirmed"]),
            tuple((_variation(variation), reason) for variation, reason in state["short_of_reach"]),
        )

    def with_attempt(self, attempt: Attempt) -> Search:
        """This search and one attempt more."""
        return replace(self, attempts=(*self.attempts, attempt))

    def with_repeat(self, trial: Trial, repeat: Repeat) -> Search:
        """This search and the repeat that ``trial`` asked for."""
        if trial.kind == "confirm":
            return replace(self, confirmed=(*self.confirmed, repeat))
        done = dict(self.evaluated)
        done[trial.variation] = (*done.get(trial.variation, ()), repeat)
        return replace(self, evaluated=tuple(done.items()))

    def without_reach(self, variation: MotionVariation, reason: str) -> Search:
        """This search, knowing why ``variation`` lacks the reach that is asked for."""
        return replace(self, short_of_reach=(*self.short_of_reach, (variation, reason)))

    def reaching(self, candidates: Iterable[MotionVariation]) -> list[MotionVariation]:
        """Return those of ``candidates`` that do not lack reach."""
        short = dict(self.short_of_reach)
        return [one for one in candidates if one not in short]

    def rollouts(self) -> int:
        """All rollouts that the search took; the fresh repeats at its end are not part of it."""
        return len(self.attempts) + sum(len(repeats) for _, repeats in self.evaluated)

    def rollouts_to_first_catch(self) -> int | None:
        """The number of the first attempt that caught, from 1."""
        return next((i + 1 for i, one in enumerate(self.attempts) if one.caught), None)

    def flight(self, variation: MotionVariation) -> tuple[float, float] | None:
        """The share of the motion in which the ball flew: of ``variation``, or of the newest motion that threw it."""
        same = next((one.flight for one in self.attempts if one.variation == variation), None)
        return same or next((one.flight for one in reversed(self.attempts) if one.flight), None)

    def slack_in_swing(self, variation: MotionVariation) -> bool:
        """Whether the rope hung slack in the swing of ``variation``."""
        return any(one.slack_in_swing for one in self.attempts if one.variation == variation)

    def caught(self) -> int:
        """How many attempts caught."""
        return sum(one.caught for one in self.attempts)


class CatchSearch(Protocol):
    """A way to search: everything it knows is in the results so far."""

    def next_trial(self, search: Search) -> Trial | None:
        """The next rollout to play, or None when the search has ended."""

    def rollouts(self, search: Search) -> int:
        """How many rollouts the search took; the fresh repeats at its end are not part of it."""

    def best(self, search: Search) -> MotionVariation | None:
        """What is confirmed at the end."""

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """The success that is expected of a motion that was judged."""


@dataclass(frozen=True)
class Bounds:
    """Where to search: the least tau within the arm's limits by amplitude; a miss below ``mouth_m`` is a catch."""

    lowest_tau: Mapping[float, float]
    mouth_m: float


def _variation(values: Mapping[str, Any]) -> MotionVariation:
    lists = {name: tuple(values[name]) for name in ("shift_m", "flight", "bumps_m")}
    return MotionVariation(values["tau_scale"], values["amplitude"], **lists)


def _attempt(values: Mapping[str, Any]) -> Attempt:
    flight = values["flight"]
    return Attempt(
        **{**values, "variation": _variation(values["variation"]), "flight": None if flight is None else tuple(flight)}
    )
