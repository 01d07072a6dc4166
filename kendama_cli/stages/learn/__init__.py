"""The stage ``learn``, declared."""

from __future__ import annotations

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.learn.messages import TOPICS

STAGE = StageDeclaration(
    name="learn",
    title="Swing-up without prior knowledge",
    lead="Learns to swing the ball up, to release and to catch it, without demonstrations.",
    run="kendama_cli.stages.learn.stage:Learn",
    returns="kendama_cli.artifacts.policy:PolicyArtifact",
    settings={"learn": LearnSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.learn.chapter:swingup_figures",
    replay="kendama_cli.stages.learn.chapter:replay",
    headline=(
        Headline(
            "rollouts_to_solved",
            "rollouts to solved: before the first of 80 successes in a row",
        ),
        Headline("frozen_visual_caught_rate", "of swing-ups by the frozen policy end in the cup, by noisy sight"),
    ),
    brief=(
        "{rollouts_to_solved} rollouts, {frozen_visual_caught_rate:.0%} of {frozen_rollouts} caught "
        "(≥ {frozen_visual_caught_rate_low:.2f})"
    ),
    metrics={
        "learned": "True if the policy reached its streak of successes while it learned.",
        "rollouts_to_learned": (
            "Number of rollouts before the streak that counts as learned, or the cap; fewer is better."
        ),
        "solved": "True if the frozen policy reached the streak that counts as solved.",
        "rollouts_to_solved": (
            "Number of rollouts before the streak of frozen successes that counts as solved, or the cap; fewer is "
            "better."
        ),
        "rollouts": "Total number of rollouts of learning.",
        "frozen_rollouts": "Number of noisy rollouts in which the frozen policy was evaluated.",
        "frozen_visual_caught_rate": (
            "Fraction of noisy rollouts of the frozen policy whose ball the cup then catches by measurements that are "
            "noisy and late, on the rail; 1 is best."
        ),
        "frozen_visual_caught_rate_low": "Lower end of the exact 95 % interval of frozen_visual_caught_rate.",
        "frozen_visual_caught_rate_high": "Upper end of the exact 95 % interval of frozen_visual_caught_rate.",
        "frozen_caught_rate": (
            "Fraction of noisy rollouts of the frozen policy that end with the ball in the cup, which knows the true "
            "ball after the release; 1 is best."
        ),
        "frozen_caught_rate_low": "Lower end of the exact 95 % interval of frozen_caught_rate.",
        "frozen_caught_rate_high": "Upper end of the exact 95 % interval of frozen_caught_rate.",
        "frozen_success_rate": "Fraction of noisy rollouts of the frozen policy that reach the task's goal; 1 is best.",
        "half_swings": "Median number of half-swings until the goal, over successful rollouts.",
        "time_to_goal_s": "Median time until the goal, over successful rollouts; shorter is better.",
        "peak_displacement_m": "Largest distance of the cup from its start in the evaluation.",
        "simulated_s": "Simulated time of all rollouts, as long as they would take on an arm.",
        "random_success_rate": "Fraction of random harmonic motions that reach the goal: the random baseline.",
    },
    capped={"rollouts_to_learned": "learned", "rollouts_to_solved": "solved"},
    topic_words={
        "/learn/rollout": "One rollout: reward, explored or greedy, success, duration and half-swings.",
        "/learn/table": "Q-table after 1, 2, 4, ... rollouts and at the end.",
        "/learn/step": "State of cup and ball, action and rope tension in one rollout of the frozen policy.",
        "/learn/cup": "Pose of the cup in the same rollout.",
        "/learn/ball": "Position of the ball in the same rollout, and on through free flight.",
    },
    figures={
        "learn-reward": "Reward of each rollout of the learning; filled marks succeeded, the line is a running median.",
        "learn-path": "Paths of cup and ball of the learned swing-up, with a mark every 60 ms.",
        "learn-series": "Cup position, ball angle and chosen acceleration over time in the same rollout.",
        "learn-table": "Acceleration with the highest value in each state; no action was ever chosen in grey states.",
        "sweep-learned": (
            "Fraction of seeds that have solved the swing-up after a number of rollouts, with 95 % intervals."
        ),
        "sweep-transfer": "Further rollouts that each body needs after the policy is transferred to it.",
        "sweep-reward": "Median reward per rollout over the seeds, with the middle half shaded.",
        "sweep-frozen": "Fraction of catches of each frozen policy, one mark a seed.",
        "sweep-swings": "Number of half-swings to the goal, one mark a seed.",
        "sweep-times": "Time to the goal, one mark a seed, beside the best that a search found.",
    },
    methods=(
        'The swing-up was learned from nothing with the learner "{learn.learner.kind}" in the simulation '
        'engine "{learn.engine.kind}".',
        "The learning rate was {learn.alpha}, the discount {learn.gamma} and the trace decay {learn.trace_decay}.",
        "The actions were accelerations of the cup of {learn.actions_m_s2}, held for {learn.decision.min_s} "
        "to {learn.decision.max_s}.",
        'Exploration was "{learn.exploration.kind}", with epsilon = {learn.exploration.epsilon} that decays '
        "over {learn.exploration.decay_rollouts} rollouts.",
        "A rollout took at most {learn.rollout_s}; the reward was {learn.reward.goal} for the goal, "
        "{learn.reward.outside} for leaving the workspace and {learn.reward.timeout} for running out of "
        "time.",
        "Learning counted as solved after {learn.count.solved_streak} greedy successes in a row, at most "
        "{learn.count.max_rollouts} rollouts were run, and the frozen policy was evaluated in "
        "{frozen_rollouts} rollouts.",
    ),
)
