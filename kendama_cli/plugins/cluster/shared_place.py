"""The shared store that a command names, or that of the configuration."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

from kendama_cli.cli import render
from kendama_cli.config.site import Site

if TYPE_CHECKING:
    from kendama_cli.settings.store import StoreSettings
    from kendama_cli.store.store import SharedDamage


def verify(site: Site, place: str, *, as_json: bool) -> int:
    """Read every byte of the shared store at ``place``, and name what is damaged."""
    from kendama_cli.pipeline.where import open_shared
    from kendama_cli.store.store import Store

    shared = open_shared(store_settings(site, place), render.note)
    assert shared is not None
    count, damage = shared.verify(Store(site.home))
    if as_json:
        render.document({"read": count, "damaged": [dataclasses.asdict(one) for one in damage]})
    elif damage:
        show_damage(shared.place, damage)
    else:
        render.text(f"every byte of {count} results and artifacts in {shared.place} is as it was written")
    return 1 if damage else 0


def store_settings(site: Site, place: str | None) -> StoreSettings:
    """Return the settings of the shared store at ``place``, or those of the configuration.

    Raises UsageError where neither names one.
    """
    from kendama_cli.config.compose import composed
    from kendama_cli.errors import UsageError
    from kendama_cli.schema.settings import build
    from kendama_cli.settings.store import StoreSettings

    node = composed(site, [])["store"]
    settings = build(StoreSettings, node if place is None else {**node, "remote": place}, "store")
    if settings.remote is None:
        raise UsageError("no shared store is named; add --remote /mnt/shared/kendama, or --remote s3://bucket/prefix")
    return settings


def show_damage(place: str, damage: Sequence[SharedDamage]) -> None:
    """Print what of the shared store at ``place`` is damaged, and what to do."""
    for one in damage:
        render.text(f"{one.name}: {one.problem}")
    if damage:
        render.error(f"{len(damage)} damaged in {place}; none is used; delete them there and push them again")
