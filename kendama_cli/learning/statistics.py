"""The counting rule, written down once: when the swing-up counts as learned or solved, and how many rollouts it took.

*Rollouts to first* is the number of the first of ``learned_streak`` (10) successes in a row by the greedy policy,
*rollouts to solved* that of the rollouts before the first of ``solved_streak`` (80) in a row. Rollouts are counted from
1 and every rollout counts, exploring ones too; an exploring rollout neither adds to a streak nor breaks it. After
``max_rollouts`` (1000) rollouts without such a streak learning has failed to show it, and that counts as so many.

From the tenth success on the policy is tried as it stands: what it does without learning on the way is what it will do
once it is frozen. A failure before it is solved resumes the learning; in the end the policy with the longest streak is
taken, unsolved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from kendama_cli.learning.task_settings import CountSettings


@dataclass(frozen=True)
class LearningCount:
    """Progress of learning: rollouts so far, the present streak of greedy successes and its first rollout."""

    rollouts: int = 0
    streak: int = 0
    streak_began: int = 0
    learned_at: int | None = None
    solved_after: int | None = None
    """Rollouts before the first of those in a row after which the policy counts as solved."""
    succeeded_ever: bool = False
    greedy_failed: bool = False
    """True where the last rollout was a greedy one that failed."""
    explored_in_a_row: int = 0
    """Exploring rollouts since the last greedy one."""
    ended: bool = False
    """True where the learner takes no more rollouts, though none of the rule's ends is reached."""

    def after(self, *, explored: bool, success: bool, settings: CountSettings) -> LearningCount:
        """Return the count after one more rollout."""
        count = replace(
            self,
            rollouts=self.rollouts + 1,
            succeeded_ever=self.succeeded_ever or success,
            greedy_failed=not (success or explored),
            explored_in_a_row=self.explored_in_a_row + 1 if explored else 0,
        )
        if explored:
            return count
        if not success:
            return replace(count, streak=0, streak_began=0)
        streak, began = count.streak + 1, count.streak_began or count.rollouts
        learned_at = began if count.learned_at is None and streak >= settings.learned_streak else count.learned_at
        solved_after = began - 1 if streak >= settings.solved_streak else None
        return replace(count, streak=streak, streak_began=began, learned_at=learned_at, solved_after=solved_after)

    def frozen(self, settings: CountSettings) -> bool:
        """Return True if the next rollout validates the policy as it is instead of training it."""
        return self.streak >= settings.learned_streak

    def to_solve(self, settings: CountSettings) -> int:
        """Return the number of further successes in a row that count as solved, or reach the cap; at least one."""
        return max(1, min(settings.solved_streak - self.streak, settings.max_rollouts - self.rollouts))

    def finished(self, settings: CountSettings) -> bool:
        """Return True if learning is over: the streak is long enough to freeze, or the cap or its end is reached."""
        return self.ended or self.streak >= settings.solved_streak or self.rollouts >= settings.max_rollouts

    @property
    def learned(self) -> bool:
        """Return True if the streak of greedy successes has been reached."""
        return self.learned_at is not None

    @property
    def solved(self) -> bool:
        """Return True if the present policy counts as solved."""
        return self.solved_after is not None

    def rollouts_to_learned(self, settings: CountSettings) -> int:
        """Return the counting rule's first figure; the cap if the streak was never reached."""
        return settings.max_rollouts if self.learned_at is None else self.learned_at

    def rollouts_to_solved(self, settings: CountSettings) -> int:
        """Return the counting rule's second figure; the cap if nothing was solved."""
        return settings.max_rollouts if self.solved_after is None else self.solved_after
