"""The learners that come with kendama, as declarations for the entry point group ``kendama.learners``.

``makes`` names a LearnerMaker (``kendama_cli/learning/interface.py``).
"""

from kendama_cli.schema.registry import Variant

SARSA = Variant(
    "sarsa",
    settings="kendama_cli.learning.learner_settings:SarsaSettings",
    makes="kendama_cli.learning.sarsa:SARSA",
)
DYNA = Variant(
    "dyna",
    settings="kendama_cli.learning.learner_settings:DynaSettings",
    makes="kendama_cli.learning.dyna:DYNA",
)
TILE_CODING = Variant(
    "tile_coding",
    settings="kendama_cli.learning.learner_settings:TileCodingSettings",
    makes="kendama_cli.learning.tile_coding:TILE_CODING",
)
LUCKY = Variant(
    "lucky",
    settings="kendama_cli.learning.learner_settings:LuckySettings",
    makes="kendama_cli.learning.lucky:LUCKY",
)
RANDOM = Variant(
    "random",
    settings="kendama_cli.learning.learner_settings:RandomSettings",
    makes="kendama_cli.learning.lucky:RANDOM",
)
PUMP = Variant(
    "pump",
    settings="kendama_cli.learning.learner_settings:PumpSettings",
    makes="kendama_cli.learning.pump:PUMP",
)
OPEN_LOOP = Variant(
    "open_loop",
    settings="kendama_cli.learning.learner_settings:OpenLoopSettings",
    makes="kendama_cli.learning.open_loop:OPEN_LOOP",
)
MODEL_BASED = Variant(
    "model_based",
    settings="kendama_cli.learning.learner_settings:ModelBasedSettings",
    makes="kendama_cli.learning.model_based:MODEL_BASED",
)
