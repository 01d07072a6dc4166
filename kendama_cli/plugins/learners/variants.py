"""Learners beside the core's, as declarations for the entry point group ``kendama.learners``."""

from kendama_cli.schema.registry import Variant

DYNA = Variant(
    "dyna",
    settings="kendama_cli.plugins.learners.settings:DynaSettings",
    makes="kendama_cli.plugins.learners.dyna:DYNA",
)
TILE_CODING = Variant(
    "tile_coding",
    settings="kendama_cli.plugins.learners.settings:TileCodingSettings",
    makes="kendama_cli.plugins.learners.tile_coding:TILE_CODING",
)
OPEN_LOOP = Variant(
    "open_loop",
    settings="kendama_cli.plugins.learners.settings:OpenLoopSettings",
    makes="kendama_cli.plugins.learners.open_loop:OPEN_LOOP",
)
MODEL_BASED = Variant(
    "model_based",
    settings="kendama_cli.plugins.learners.settings:ModelBasedSettings",
    makes="kendama_cli.plugins.learners.model_based:MODEL_BASED",
)
BAYES = Variant(
    "bayes",
    settings="kendama_cli.plugins.learners.settings:BayesSettings",
    makes="kendama_cli.plugins.learners.bayes:BAYES",
)
ELITE = Variant(
    "elite",
    settings="kendama_cli.plugins.learners.settings:EliteSettings",
    makes="kendama_cli.plugins.learners.elite:ELITE",
)
MONTE_CARLO = Variant(
    "monte_carlo",
    settings="kendama_cli.plugins.learners.settings:MonteCarloSettings",
    makes="kendama_cli.plugins.learners.whole_rollouts:MONTE_CARLO",
)
CLONE = Variant(
    "clone",
    settings="kendama_cli.plugins.learners.settings:CloneSettings",
    makes="kendama_cli.plugins.learners.whole_rollouts:CLONE",
)
