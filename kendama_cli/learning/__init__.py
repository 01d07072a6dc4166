"""The learners that come with kendama, as declarations for the entry point group ``kendama.learners``.

``makes`` names a LearnerMaker (``kendama_cli/learning/interface.py``).
"""

from kendama_cli.schema.registry import Variant

TABLE = Variant(
    "table",
    settings="kendama_cli.learning.learner_settings:TableSettings",
    makes="kendama_cli.learning.sarsa:TABLE",
)
HARMONIC_SEARCH = Variant(
    "harmonic_search",
    settings="kendama_cli.learning.learner_settings:HarmonicSearchSettings",
    makes="kendama_cli.learning.harmonic_search:HARMONIC_SEARCH",
)
