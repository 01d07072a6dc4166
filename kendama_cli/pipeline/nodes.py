"""The top-level nodes of the configuration and the settings that each becomes.

A stage's declaration brings the nodes that are the stage's own; those that several stages read (the game, the robot,
...) come by the entry point group ``kendama.settings``, whose values are a schema as a declaration's are.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from kendama_cli.errors import ConfigError, KendamaError, MissingPartError
from kendama_cli.schema.declaration import NODES, find_stage, stage_names
from kendama_cli.schema.hints import unknown_key
from kendama_cli.schema.registry import comes_with, declared, missing_part, resolve
from kendama_cli.schema.settings import build_value

T = TypeVar("T")


class Remembered:
    """Results by what they were made of; objects count as the same where they are one object, which nobody changes."""

    def __init__(self) -> None:
        self._made: dict[tuple[object, ...], tuple[tuple[object, ...], Any]] = {}

    def once(self, what: str, of: tuple[object, ...], make: Callable[[], T]) -> T:
        """Return the result of ``make``, called once for each ``what`` and objects ``of``."""
        name = (what, *map(id, of))
        if name not in self._made:
            self._made[name] = (of, make())  # kept with the objects, whose ids are theirs as long as they live
        made: T = self._made[name][1]
        return made


class NodeSettings(dict[str, Any]):
    """Settings by node, and ``seed``."""

    def __missing__(self, name: str) -> Any:
        if line := comes_with(f"node '{name}'", NODES, name):
            raise MissingPartError(name, line)
        raise ConfigError(name, f"missing key '{name}': the configuration must choose one")


def node_schemas() -> tuple[dict[str, Any], KendamaError | None]:
    """Return the schema by node, and the error of a package whose declaration cannot be read.

    One broken package must not stop those who do not use it. Raises ConfigError where two bring one node.
    """
    schemas: dict[str, Any] = {}
    broken: KendamaError | None = None
    for part, name in [*((NODES, name) for name in declared(NODES)), *(("stage", name) for name in stage_names())]:
        try:
            brought = {name: resolve(declared(NODES)[name], f"node '{name}'")} if part == NODES else _of_stage(name)
        except KendamaError as error:
            broken = error
            continue
        for node, schema in brought.items():
            if schemas.setdefault(node, schema) is not schema and schemas[node] != schema:
                raise ConfigError(
                    node, f"node '{node}' is brought by two packages, as {schemas[node]!r} and {schema!r}; rename one"
                )
    return schemas, broken


def build_settings(config: Mapping[str, Any], known: Remembered | None = None) -> NodeSettings:
    """Build the settings by node, and ``seed``, from the composed configuration; raises ConfigError that names the
    key.

    Configurations of which ``known`` has seen a node already share that node's settings.
    """
    known = known or Remembered()
    schemas, broken = known.once("schemas", (), node_schemas)
    for name in config:
        if name != "seed" and name not in schemas and missing_part(NODES, name) is None:
            raise broken or unknown_key(str(name), [*schemas, "seed"])
    seed = config.get("seed")
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError("seed", f"'seed' is {seed!r}; allowed: a whole number, 0 or more; type seed=0")
    built = {
        name: known.once(f"node {name}", (value,), functools.partial(build_value, schemas[name], value, name))
        for name, value in config.items()
        if name in schemas  # the bundled configuration has the nodes of parts that may be missing, too
    }
    return NodeSettings({"seed": seed} | built)


def _of_stage(name: str) -> Mapping[str, Any]:
    declaration = find_stage(name)
    return {} if declaration is None else declaration.settings
