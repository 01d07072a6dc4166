"""The stage ``adapt``, declared."""

from __future__ import annotations

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration
from kendama_cli.stages.adapt.messages import TOPICS

STAGE = StageDeclaration(
    name="adapt",
    title="Adaptation",
    lead="Searches the time scale of the primitive at which the arm catches the ball in simulation.",
    run="kendama_cli.stages.adapt.stage:Adapt",
    returns="kendama_cli.artifacts.motion_plan:CatchMotion",
    settings={"adapt": AdaptSettings},
    topics=TOPICS,
    chapter="kendama_cli.stages.adapt.chapter:adaptation_figures",
    film="kendama_cli.stages.adapt.chapter:film",
    replay="kendama_cli.stages.adapt.chapter:replay",
    headline=(
        Headline("success_rate", "of perturbed repeats caught by the adapted swing"),
        Headline("tau_scale", "time scale tau of the catch"),
    ),
    brief="{success_rate:.0%} of {repeats} caught (≥ {success_rate_low:.2f}), tau {tau_scale:.2f}",
    metrics={
        "caught": "True if the chosen motion catches in the undisturbed simulation.",
        "caught_later": "True if the ball came into the cup off the rim or on a later descent.",
        "failure_reason": "Reason why no motion catches, and what limits it; empty after a catch.",
        "tau_scale": "Time scale tau of the catch, relative to the demonstration; larger is slower.",
        "rollouts": "Number of simulated rollouts that the search took.",
        "catch": "Method of the catch: visual moves the cup to the observed ball, open_loop plays the plan.",
        "uncertainty": "Name of the uncertainty from which the perturbed repeats are sampled.",
        "repeats": "Number of perturbed repeats in which the chosen motion was evaluated.",
        "success_rate": "Fraction of perturbed repeats that the chosen motion catches; 1 is best.",
        "success_rate_low": "Lower end of the 95 % interval of the success rate.",
        "success_rate_high": "Upper end of the 95 % interval of the success rate.",
        "search": "Method of the search, as set by adapt.search.",
        "rollouts_to_robust": "Number of rollouts until enough perturbed repeats were caught; empty if never.",
        "predicted_success": "Success rate that the search expected of its choice; near the measured rate is good.",
        "tau_windows": "Number of ranges of tau in which the motion catches.",
        "evaluations": "Number of perturbed simulations that evaluated motions during a policy search.",
        "rollouts_to_first_catch": "Number of rollouts until the first catch; empty if there is none.",
        "heading_deg": "Direction of the swing about the vertical at which the arm plays it.",
        "amplitude": "Size of the motion relative to the demonstration.",
        "goal_shift_mm": "Distance by which the motion's goal was moved to catch.",
        "signed_miss_mm": "Offset of the ball from the cup's centre in the rim plane along the swing; 0 is best.",
        "lateral_miss_mm": "Offset of the ball from the cup's centre in the rim plane across the swing; 0 is best.",
        "swing_slack_ms": (
            "Longest time for which the rope is slack before the flight; a long one makes the catch uncertain."
        ),
        "apex_mm": "Highest point of the ball's flight above the rim; a higher one leaves more time to correct.",
        "planned_speed_over_limit": "Highest planned joint velocity divided by its limit; at most 1 is possible.",
        "speed_over_limit": "Highest joint velocity in simulation divided by its limit; at most 1 is possible.",
        "effort_over_limit": "Highest joint torque in simulation divided by its limit; at most 1 is possible.",
    },
    topic_words={
        "/adapt/rollout": "One rollout of the search: tau, size, goal shift, signed miss and outcome.",
        "/adapt/candidate": "Rollout of a candidate in one perturbed simulation that evaluates it.",
        "/adapt/explored": "One rollout of a policy search: generation, tau, cost, miss and shape.",
        "/adapt/evaluation": "Repeat that evaluates what a policy search has found after a number of rollouts.",
        "/adapt/window": "Range of tau that catches, its chosen centre and the slack time of the rope.",
        "/adapt/repeat": "One perturbed repeat of the chosen motion: outcome, miss and shift of the cup.",
        "/adapt/replay": "Physical parameters and paths of each repeat, as 'kendama cross-check' needs them.",
        "/adapt/perturbation": "Kendama, air and arm that were sampled for one repeat.",
        "/adapt/scene": "Shapes of arm, pedestal, handle, cup and ball, for Foxglove's 3D panel.",
        "/adapt/links": "Poses of the arm's links in the chosen rollout.",
        "/adapt/joints": "Positions, velocities and torques of the joints in the chosen rollout.",
        "/adapt/cup": "Pose of the cup in the chosen rollout.",
        "/adapt/ball": "Position of the ball in the chosen rollout.",
        "/adapt/reference": "Commanded pose of the cup in the chosen rollout.",
    },
    figures={
        "adapt-search": (
            "Miss of the ball over the time scale tau, one mark a rollout; the motion catches in the shaded windows."
        ),
        "adapt-policy": "Cost of each rollout of a policy search; filled marks caught.",
        "adapt-catch": "Paths of cup and ball in the swing plane around the catch, with a mark every 60 ms.",
        "adapt-tracking": (
            "Distance of the driven cup from the commanded cup over time; a small one means that the arm follows."
        ),
        "adapt-joints": "Joint velocities of the arm in the chosen rollout.",
        "adapt-repeats": "Misses of the perturbed repeats in rising order; filled marks caught.",
        "compare-search": "Miss over tau in each run of a comparison; dashed lines are the chosen tau.",
        "compare-swing": "Chosen swings of each group around the catch, in the swing plane.",
        "compare-repeats": "Misses of the perturbed repeats in each group of a comparison.",
    },
    methods=(
        "The primitive was adapted in simulation on the arm {robot.name}: its time scale tau was searched "
        "over {adapt.tau_range} in steps of {adapt.tau_step}, refined to {adapt.tau_resolution}.",
        "The game has a rope of {game.rope.length_m}, a ball of {game.ball.mass_kg} and radius "
        "{game.ball.radius_m}, and a cup of radius {game.cup.radius_m} and depth {game.cup.depth_m}.",
        "A candidate was evaluated in {repeats} simulations perturbed by the uncertainty "
        '"{adapt.uncertainty.name}"; the mode of the catch was "{adapt.catch}".',
    ),
)
