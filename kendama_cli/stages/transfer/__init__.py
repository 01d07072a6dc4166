"""The stage ``transfer``, declared."""

from __future__ import annotations

from kendama_cli.control.settings import TransferSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.transfer.messages import TOPICS

STAGE = StageDeclaration(
    name="transfer",
    title="Transfer to the robot",
    lead="Imitates the swing on the hardware, continues learning there, and plays full games through images.",
    run="kendama_cli.stages.transfer.stage:Transfer",
    returns="kendama_cli.artifacts.transfer_result:TransferResult",
    settings={"transfer": TransferSettings},
    topics=TOPICS,
    kind="moves",
    chapter="kendama_cli.stages.transfer.chapter:transfer_figures",
    replay="kendama_cli.stages.transfer.performance:replay",
    episodes="kendama_cli.stages.transfer.episodes:episodes",
    headline=(
        Headline("success_rate_after", "of swing-ups succeed on {robot}"),
        Headline("caught_rate", "of full games caught on {robot}"),
    ),
    brief="{caught_rate:.0%} of {games:game} caught (≥ {caught_rate_low:.2f})\n{imitation}",
    again="the arm {servo}; a later run leads by that from its first rollout on with transfer.servo={run}/{stage}",
    capped={"rollouts": "learned", "rollouts_from_scratch": "learned_from_scratch", "rollouts_to_solved": "solved"},
    metrics={
        "rollouts": "Number of rollouts that were learned on the robot.",
        "learned": "True if the policy reached its streak of successes on the robot.",
        "rollouts_to_solved": (
            "Number of rollouts on the robot before the frozen policy counts as solved; fewer is better."
        ),
        "solved": "True if the frozen policy reached the streak that counts as solved on the robot.",
        "rollouts_from_scratch": (
            "Number of rollouts that an empty table needed on the same robot: the baseline of the transfer."
        ),
        "learned_from_scratch": "True if the empty table reached its streak of successes too.",
        "success_rate_before": "Fraction of swing-ups that succeed on the robot before it learns there; 1 is best.",
        "success_rate_after": "Fraction of swing-ups that succeed on the robot after it has learned there; 1 is best.",
        "reverted": "True if learning made the table worse, so that the games used the original one.",
        "imitation": "Rollout at which the demonstrated swing was caught, and what its plays say of the arm.",
        "imitation_caught": "True if the demonstrated swing was caught on the robot.",
        "imitation_attempts": "Number of attempts at the demonstrated swing, each aimed by those before.",
        "imitation_caught_at": "Number of the rollout at which the demonstrated swing was caught; fewer is better.",
        "imitation_repeats": "Number of further plays of the demonstrated swing.",
        "imitation_caught_rate": "Fraction of further plays of the demonstrated swing that were caught; 1 is best.",
        "imitation_caught_rate_low": "Lower end of the exact 95 % interval of imitation_caught_rate.",
        "imitation_caught_rate_high": "Upper end of the exact 95 % interval of imitation_caught_rate.",
        "imitation_rope_scale": "Length of the rope that the failed attempts suggest, relative to the configured one.",
        "servo_lag_s": "Median lag of the arm's joints behind their commands, by which later commands lead.",
        "servo_sag_mm": "Distance at which the cup would rest from where it is commanded, as the swing begins.",
        "servo_dead_time_s": "Time after which the arm begins to follow a command; below zero for one that is held.",
        "servo": "Lag and sag of the arm's servo, in words, where this run has found them.",
        "imitation_resized": "True if the motion was adapted again for the rope that the attempts suggest.",
        "games": "Number of full games: swing-up, observed flight and catch.",
        "caught_rate": "Fraction of full games that end with the ball in the cup; 1 is best.",
        "caught_rate_low": "Lower end of the exact 95 % interval of caught_rate.",
        "caught_rate_high": "Upper end of the exact 95 % interval of caught_rate.",
        "swung_up_rate": "Fraction of full games in which the ball came over the cup; 1 is best.",
        "prediction_error_mm_p50": "Median error of the last predicted catch position in the games; smaller is better.",
        "latency_frames_p95": (
            "Largest 95 % quantile of the images that passed until a detection was used, over the games."
        ),
        "detection_rate": "Fraction of the images of the flights in which the ball was detected; 1 is best.",
        "missed_packets": "Number of control periods without an answer of the robot; 0 is best.",
    },
    topic_words={
        "/transfer/step": "State and action of the policy in one control period; negative rollouts are games.",
        "/transfer/rollout": "One rollout of the learning on the robot: reward, success and duration.",
        "/transfer/scratch/rollout": "One rollout of the baseline that learns on the robot from an empty table.",
        "/transfer/scene": "Shapes of arm, cup, ball and cameras, for Foxglove's 3D panel.",
        "/transfer/links": "Poses of the arm's links during the games.",
        "/transfer/exchange": (
            "Command that was sent, after all limits, and state that was measured in each control period."
        ),
        "/transfer/joints": "Positions, velocities and torques of the joints during the games.",
        "/transfer/cup": "Pose of the cup during the games.",
        "/transfer/ball": "Position of the ball during the games.",
        "/transfer/detection": "Ball that was detected in one image of one camera in a game.",
        "/transfer/estimate": "Predicted crossing of the rim plane after each image, with its covariance.",
        "/transfer/game": "Result of one game: outcome, prediction error, images, latency and impact.",
        "/transfer/replay": "Physical parameters and paths of each game, as 'kendama cross-check' needs them.",
        "/transfer/wrench": "Force and torque at the wrist's sensor during the games.",
        "/transfer/imitation/rollout": "One attempt at the demonstrated swing: its aim, and its miss or told outcome.",
        "/transfer/imitation/links": "Poses of the arm's links in the attempts at the demonstrated swing.",
        "/transfer/imitation/cup": "Pose of the cup in the attempts at the demonstrated swing.",
        "/transfer/imitation/ball": "Position of the ball in the attempts at the demonstrated swing.",
        "/transfer/imitation/wrench": (
            "Force and torque at the wrist's sensor in the attempts at the demonstrated swing."
        ),
        "/transfer/servo": "Lag, sag and dead time of the arm's servo, by which later commands lead.",
        "/transfer/image/*": "Camera images of the first game; * stands for the camera's name.",
    },
    figures={
        "transfer-reward": "Reward of each rollout on the robot; filled marks succeeded.",
        "transfer-scratch": "Reward of each rollout of the baseline that learns from an empty table.",
        "transfer-games": "Outcome of every game: caught, missed, or why there was no catch.",
        "transfer-prediction": "Error of the predicted catch over the remaining time, for every game.",
        "transfer-aim": "Miss and aim of each attempt at the demonstrated swing; filled marks were caught.",
        "transfer-imitation": "Paths of cup and ball in the last attempt at the demonstrated swing.",
        "transfer-path": "Paths of cup and ball in one game, with a mark every 60 ms.",
        "transfer-series": "Cup position, ball angle and chosen acceleration over time in one game.",
        "transfer-angles": "Joint angles in one game as they were sent and as they were measured.",
        "transfer-tracking": "Delay and root mean square error with which each joint follows its command.",
    },
    methods=(
        'Rollouts of the primitive on the robot "{hardware.kind}", aimed after a miss by where the ball came down: '
        "{imitation_attempts}.",
        'The policy was transferred to the robot "{hardware.kind}", where learning resumed for {rollouts} of at most '
        "{transfer.max_rollouts} rollouts.",
        "The greedy policy was evaluated in {transfer.evaluation_rollouts} rollouts before and after, then {games} "
        "full games were played with observation from {transfer.observation.source}.",
    ),
)
