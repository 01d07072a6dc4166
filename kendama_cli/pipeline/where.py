"""WHERE a run works: which store stands behind the home, and which machines compute. Neither is part of a key."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.plan import WHERE
from kendama_cli.settings.executor import LocalExecutor
from kendama_cli.store.shared import open_shared
from kendama_cli.store.store import Store
from kendama_cli.system.interface import Starter

Tell = Callable[[str], None]
"""Has a person read one line."""


class Cluster(Starter, Protocol):
    """Starts the workers of stages on other machines, many at once."""

    at_once: int
    """So many runs of a sweep keep it busy."""


def with_executor(overrides: Sequence[str], on: str | None) -> list[str]:
    """``overrides`` with the choice that ``--on`` is in place of theirs; before those that say more of it."""
    if on is None:
        return list(overrides)
    return [f"executor={on}", *(text for text in overrides if text.partition("=")[0] != "executor")]


def of_results(overrides: Sequence[str]) -> list[str]:
    """Those of ``overrides`` that may change a result: a record and its name need no others."""
    return [text for text in overrides if text.partition("=")[0].partition(".")[0] not in WHERE]


def open_store(home: Path, settings: Mapping[str, Any], tell: Tell) -> Store:
    """The store in ``home`` with what the node ``store`` has stand behind it."""
    return Store(home, open_shared(settings["store"], tell))


@contextlib.contextmanager
def open_cluster(store: Store, settings: Mapping[str, Any], tell: Tell) -> Iterator[Cluster | None]:
    """The machines that the node ``executor`` names; None for this one alone.

    Raises UsageError where no shared store is named through which they could take and give, ClusterError where they
    cannot be reached, MissingPartError where a library is missing.
    """
    executor = settings["executor"]
    if isinstance(executor, LocalExecutor):
        yield None
        return
    if store.shared is None:
        raise UsageError(
            f"executor={executor.kind} needs a place through which machines give each other results: set "
            "store.remote=/mnt/shared/kendama (a folder that all mount) or store.remote=s3://bucket/prefix"
        )
    from kendama_cli.pipeline.cluster import connected  # noqa: PLC0415 - Dask

    # between two runs of a sweep, too, its workers need what the home keeps for them
    with store.in_use(), connected(executor, settings["store"], store, tell) as cluster:
        yield cluster
