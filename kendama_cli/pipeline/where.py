"""WHERE a run works: which store stands behind the home, and which machines compute. Neither is part of a key."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.plan import WHERE
from kendama_cli.schema.registry import declared, resolve
from kendama_cli.settings.executor import EXECUTORS, LocalExecutor
from kendama_cli.settings.store import STORES, StoreSettings
from kendama_cli.store.store import Shared, Store
from kendama_cli.system.interface import Starter

Tell = Callable[[str], None]
"""Shows a person one line."""


class Cluster(Starter, Protocol):
    """Starter of the workers of stages on other machines, many at once."""

    at_once: int
    """So many runs of a sweep keep it busy."""


def with_executor(overrides: Sequence[str], on: str | None) -> list[str]:
    """Return ``overrides`` with the choice of ``--on`` in place of theirs, before those that set its details."""
    if on is None:
        return list(overrides)
    return [f"executor={on}", *(text for text in overrides if text.partition("=")[0] != "executor")]


def of_results(overrides: Sequence[str]) -> list[str]:
    """Return the ``overrides`` that may change a result: a record and its name need no others."""
    return [text for text in overrides if text.partition("=")[0].partition(".")[0] not in WHERE]


def open_store(home: Path, settings: Mapping[str, Any], tell: Tell) -> Store:
    """Return the store in ``home`` with the shared store behind it that the node ``store`` names."""
    return Store(home, open_shared(settings["store"], tell))


def open_shared(settings: StoreSettings, tell: Tell) -> Shared | None:
    """Return the shared store that ``settings`` name; None where they name none.

    It comes by the entry point group ``kendama.stores``: its name is the scheme of ``store.remote``, ``file`` for a
    folder, its value is called with ``settings`` and ``tell``, and returns a ``Shared``.
    """
    if settings.remote is None:
        return None
    found: Shared = resolve(declared(STORES)[settings.scheme], f"store.remote={settings.remote}")(settings, tell)
    return found


@contextlib.contextmanager
def open_cluster(store: Store, settings: Mapping[str, Any], tell: Tell) -> Iterator[Cluster | None]:
    """Open the machines that the node ``executor`` names; None for this one alone.

    Raises UsageError where no shared store is named through which they could exchange results, ClusterError where they
    cannot be reached, MissingPartError where a library is missing.
    """
    executor = settings["executor"]
    here = isinstance(executor, LocalExecutor)
    if not here and store.shared is None:
        raise UsageError(
            f"executor={executor.kind} needs a store through which machines exchange results: set "
            "store.remote=/mnt/shared/kendama (a folder that all mount) or store.remote=s3://bucket/prefix"
        )
    # between two runs of a sweep, too, its workers need what the home keeps for them
    held = contextlib.nullcontext() if here else store.in_use()
    with held, EXECUTORS.maker(executor.kind)(executor, settings["store"], store, tell) as cluster:
        yield cluster


def this_machine(
    executor: LocalExecutor, shared: StoreSettings, store: Store, tell: Tell
) -> contextlib.AbstractContextManager[None]:
    """Return the context of ``executor=local``, which opens no other machine."""
    return contextlib.nullcontext()
