"""A learner of my own, declared; nothing heavy is imported here."""

from kendama_cli.extension import Variant

LEARNER = Variant("mine", settings="my_learner.settings:Settings", makes="my_learner.learner:LEARNER")
