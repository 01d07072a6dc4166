"""Executors, the machines on which stages compute: never part of a key.

They come by the entry point group ``kendama.executors``; ``makes`` is called with the executor's settings, the node
``store``, the home's store and a function that tells a person one line, and gives a context manager of a Cluster (see
``kendama_cli.pipeline.where``), or of None for this machine alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kendama_cli.schema.registry import ChosenSettings, Registry, Variant

EXECUTORS = Registry("kendama.executors", "executor")


ExecutorSettings = Annotated[ChosenSettings, EXECUTORS]
"""The node ``executor``: settings of any registered executor."""


@dataclass(frozen=True)
class LocalExecutor:
    """This machine."""

    kind: Literal["local"]


LOCAL = Variant(
    "local", settings="kendama_cli.settings.executor:LocalExecutor", makes="kendama_cli.pipeline.where:this_machine"
)
