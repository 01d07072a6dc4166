"""WHERE results are shared: never part of a key."""

from __future__ import annotations

import re
from dataclasses import dataclass

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting

OBJECT_STORES = ("s3", "gs", "az")


@dataclass(frozen=True)
class StoreSettings:
    """The node ``store``: what stands behind the home folder."""

    remote: str | None = setting("folder or URL of a shared store: /mnt/shared/kendama, s3://bucket/prefix; null: none")
    endpoint: str | None = setting("address of an object store that is not the cloud's own; null: the cloud's")
    timeout_s: float = setting("after so long without an answer the store counts as out of reach [s]", above=0)

    def __post_init__(self) -> None:
        if self.endpoint is not None and not re.fullmatch(r"https?://[\w.\-\[\]:]+(/.*)?", self.endpoint):
            raise ConfigError("endpoint", f"'endpoint' is '{self.endpoint}'; allowed: an address like http://host:9000")
        if self.remote is None:
            return
        scheme, separator, rest = self.remote.partition("://")
        if not self.remote or (separator and (scheme not in OBJECT_STORES or not rest.strip("/"))):
            raise ConfigError(
                "remote",
                f"'remote' is '{self.remote}'; allowed: a folder, or a URL with a bucket, such as s3://bucket/prefix "
                f"({', '.join(OBJECT_STORES)})",
            )
