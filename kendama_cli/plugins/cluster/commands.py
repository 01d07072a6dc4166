"""``kendama cache push`` and ``pull``: results between the home and a shared store."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from kendama_cli.cli import render
from kendama_cli.cli.options import ConfigDir, Home, Json, RemotePlace
from kendama_cli.config.site import Site, find_site
from kendama_cli.plugins.cluster.shared_place import show_damage, store_settings
from kendama_cli.schema.units import count_of

if TYPE_CHECKING:
    from kendama_cli.plugins.cluster.remote import Remote


def push(remote: RemotePlace = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None) -> None:
    """Give every result of this home to the shared store.

    Example: kendama cache push
    """
    from kendama_cli.plugins.cluster.shared import push as push_all
    from kendama_cli.store.store import Store

    site = find_site(home, config_dir)
    shared = _opened(site, remote)
    count, new = push_all(Store(site.home), shared)
    if as_json:
        render.document({"results": count, "new": new})
    else:
        render.text(f"{count_of(count, 'result')}, {new} of them new in {shared.place}")


def pull(remote: RemotePlace = None, as_json: Json = False, home: Home = None, config_dir: ConfigDir = None) -> int:
    """Bring every result of the shared store into this home; what is damaged there stays there.

    Example: kendama cache pull
    """
    from kendama_cli.plugins.cluster.shared import pull as pull_all
    from kendama_cli.store.store import Store

    site = find_site(home, config_dir)
    shared = _opened(site, remote)
    count, damage = pull_all(Store(site.home), shared)
    if as_json:
        render.document({"new": count, "damaged": [dataclasses.asdict(one) for one in damage]})
    else:
        render.text(f"{count} new results from {shared.place}")
        show_damage(shared.place, damage)
    return 1 if damage else 0


def _opened(site: Site, place: str | None) -> Remote:
    from kendama_cli.plugins.cluster.remote import open_remote

    remote = open_remote(store_settings(site, place))
    assert remote is not None
    return remote
