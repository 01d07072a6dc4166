"""The home and the shared store behind it: push, pull and verify."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import ConfigDir, Home, Json
from kendama_cli.config.site import Site, find_site

if TYPE_CHECKING:
    from kendama_cli.store.blob import Remote
    from kendama_cli.store.shared import RemoteDamage

RemotePlace = Annotated[
    str | None,
    typer.Option("--remote", metavar="PLACE", help="A folder, or s3://bucket/prefix [store.remote]."),
]


def push(remote: RemotePlace = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None) -> None:
    """Give every result of this home to the shared store."""
    from kendama_cli.store.shared import push as push_all
    from kendama_cli.store.store import Store

    site = find_site(home, config_dir)
    shared = opened(site, remote)
    count, new = push_all(Store(site.home), shared)
    if as_json:
        render.document({"results": count, "new": new})
    else:
        render.text(f"{count} results, {new} of them new in {shared.place}")


def pull(remote: RemotePlace = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None) -> int:
    """Bring every result of the shared store into this home; what is damaged there stays there."""
    from kendama_cli.store.shared import pull as pull_all
    from kendama_cli.store.store import Store

    site = find_site(home, config_dir)
    shared = opened(site, remote)
    count, damage = pull_all(Store(site.home), shared)
    if as_json:
        render.document({"new": count, "damaged": [dataclasses.asdict(one) for one in damage]})
    else:
        render.text(f"{count} new results from {shared.place}")
        _tell(shared, damage)
    return 1 if damage else 0


def verify(site: Site, place: str, *, as_json: bool) -> int:
    """Read every byte of the shared store at ``place``, and name what is damaged."""
    from kendama_cli.store.shared import verify_remote
    from kendama_cli.store.store import Store

    shared = opened(site, place)
    count, damage = verify_remote(Store(site.home), shared)
    if as_json:
        render.document({"read": count, "damaged": [dataclasses.asdict(one) for one in damage]})
    elif damage:
        _tell(shared, damage)
    else:
        render.text(f"every byte of {count} results and artifacts in {shared.place} is as it was written")
    return 1 if damage else 0


def opened(site: Site, place: str | None) -> Remote:
    """The shared store at ``place``, or that of the configuration; raises UsageError where neither names one."""
    from kendama_cli.config.compose import composed
    from kendama_cli.errors import UsageError
    from kendama_cli.schema.settings import build_value
    from kendama_cli.settings.store import StoreSettings
    from kendama_cli.store.remote import open_remote

    node = composed(site, [])["store"]
    remote = open_remote(build_value(StoreSettings, node if place is None else {**node, "remote": place}, "store"))
    if remote is None:
        raise UsageError("no shared store is named; add --remote /mnt/shared/kendama, or --remote s3://bucket/prefix")
    return remote


def _tell(remote: Remote, damage: Sequence[RemoteDamage]) -> None:
    for one in damage:
        render.text(f"{one.name}: {one.problem}")
    if damage:
        render.error(f"{len(damage)} damaged in {remote.place}; none is used; delete them there and push them again")
