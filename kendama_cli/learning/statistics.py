"""The counting rule, written down once: when the swing-up counts as learned and how many rollouts that took.

*Rollouts to learn* is the number of the first of ``streak`` (10) successes in a row by the greedy policy. Rollouts
are counted from 1 and every rollout counts, exploring ones too; an exploring rollout neither adds to the row nor
breaks it. After ``cap`` (1000) rollouts without such a row learning has failed, and the failure counts as the cap.
From the tenth success on the table rests: what it does without learning on the way is what it will do once frozen.
Then it is put to the proof on bodies that differ (``learn.proof``). Only after ``settled`` successes in a row it is
frozen; a failure before that wakes the learning again, and at the cap the table with the longest row is taken. None of
that changes the figure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from kendama_cli.learning.settings import CountSettings


@dataclass(frozen=True)
class LearningCount:
    """How far learning has come: rollouts so far, the present row of greedy successes and where it began."""

    rollouts: int = 0
    row: int = 0
    row_began: int = 0
    learned_at: int | None = None

    def after(self, *, explored: bool, success: bool, settings: CountSettings) -> LearningCount:
        """The count after one more rollout."""
        count = replace(self, rollouts=self.rollouts + 1)
        if explored:
            return count
        if not success:
            return replace(count, row=0, row_began=0)
        row, began = count.row + 1, count.row_began or count.rollouts
        learned_at = began if count.learned_at is None and row >= settings.streak else count.learned_at
        return replace(count, row=row, row_began=began, learned_at=learned_at)

    def resting(self, settings: CountSettings) -> bool:
        """Whether the next rollout tests the table as it stands instead of teaching it."""
        return self.row >= settings.streak

    def finished(self, settings: CountSettings) -> bool:
        """Whether there is nothing left to learn for: the row is long enough to settle, or the cap is reached."""
        return self.row >= settings.settled or self.rollouts >= settings.cap

    @property
    def learned(self) -> bool:
        """Whether the row of greedy successes has been reached."""
        return self.learned_at is not None

    def rollouts_to_learn(self, settings: CountSettings) -> int:
        """The counting rule's figure; the cap where learning failed."""
        return settings.cap if self.learned_at is None else self.learned_at
