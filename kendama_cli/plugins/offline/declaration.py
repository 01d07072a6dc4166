"""The stages ``fit`` and ``offline``, declared: models from four minutes of data, and a policy from one of them."""

from __future__ import annotations

from kendama_cli.plugins.offline.messages import FIT_TOPICS, OFFLINE_TOPICS
from kendama_cli.plugins.offline.settings import FitSettings, OfflineSettings
from kendama_cli.schema.declaration import Headline, StageDeclaration

FIT = StageDeclaration(
    name="fit",
    title="Models from fixed data",
    lead="Records a swinging ball in a world that no model knows, and fits models to it.",
    run="kendama_cli.plugins.offline.fit:Fit",
    returns="kendama_cli.plugins.offline.artifact:FittedModels",
    settings={"fit": FitSettings},
    topics=FIT_TOPICS,
    chapter="kendama_cli.plugins.offline.chapter:prediction_figures",
    headline=(Headline("identified_error_mm", "mm error of the identified model after a second"),),
    brief="after a second: identified {identified_error_mm:.0f} mm, network {network_error_mm:.0f} mm",
    metrics={
        "identified_error_mm": (
            "Root mean square distance of the ball from its prediction after a second, by the identified rope and drag."
        ),
        "network_error_mm": "The same distance by the black-box network.",
        "wrong_error_mm": "The same distance by the model with wrong constants.",
        "rope_error_mm": "Identified length of the rope minus the true one.",
        "drag_error": "Identified drag at 3 m/s over the true one, minus 1.",
    },
    topic_words={"/fit/prediction": "Angle of the ball in fresh rollouts: in the world, and predicted by each model."},
    figures={"fit-prediction": "Angle of the ball in a fresh rollout, and its predictions, each second anew."},
)

OFFLINE = StageDeclaration(
    name="offline",
    title="A policy from a model alone",
    lead="Learns the swing-up in one model alone, and plays the frozen policy in the world.",
    run="kendama_cli.plugins.offline.stage:Offline",
    returns="kendama_cli.artifacts.policy:PolicyArtifact",
    settings={"offline": OfflineSettings},
    topics=OFFLINE_TOPICS,
    chapter="kendama_cli.plugins.offline.chapter:policy_figures",
    headline=(Headline("world_caught_rate", "of swing-ups in the world end in the cup"),),
    brief="caught in the model {model_caught_rate:.0%}, in the world {world_caught_rate:.0%}",
    metrics={
        "rollouts_to_solved": "Number of rollouts in the model before it is solved there, or the cap.",
        "solved": "True if the policy is solved in the model.",
        "model_caught_rate": "Fraction of rollouts of the frozen policy that end in the cup in the model; 1 is best.",
        "model_caught_rate_low": "Lower end of the exact 95 % interval of model_caught_rate.",
        "model_caught_rate_high": "Upper end of the exact 95 % interval of model_caught_rate.",
        "world_caught_rate": "Fraction of rollouts of the frozen policy that end in the cup in the world; 1 is best.",
        "world_caught_rate_low": "Lower end of the exact 95 % interval of world_caught_rate.",
        "world_caught_rate_high": "Upper end of the exact 95 % interval of world_caught_rate.",
        "random_success_rate": "Fraction of random harmonics that succeed in the world: the baseline.",
    },
    capped={"rollouts_to_solved": "solved"},
    topic_words={
        "/offline/rollout": "One rollout in the model: reward, explored or greedy, success and duration.",
        "/offline/swing": "Cup and ball under the frozen policy without noise, in the model and in the world.",
    },
    figures={
        "offline-reward": "Reward of each rollout in the model; the world is not asked.",
        "offline-swing": "Path of the ball under the frozen policy, in the model and in the world.",
    },
)
