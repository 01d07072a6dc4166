"""WHERE results are shared: never part of a key."""

from __future__ import annotations

import re
from dataclasses import dataclass

from kendama_cli.errors import ConfigError, MissingPartError
from kendama_cli.schema.registry import comes_with, declared
from kendama_cli.schema.settings import setting

STORES = "kendama.stores"
"""The entry point group of what can stand behind a home: a name is a scheme of ``store.remote``, ``file`` a folder."""


@dataclass(frozen=True)
class StoreSettings:
    """The node ``store``: a shared store behind the home folder."""

    remote: str | None = setting(
        "Folder or URL of a shared store, such as /mnt/shared/kendama or s3://bucket/prefix; null for none."
    )
    endpoint: str | None = setting("Address of an object store other than the cloud's own; null takes the cloud's.")
    timeout_s: float = setting("The store counts as unreachable when it has not answered for this long [s].", above=0)

    def __post_init__(self) -> None:
        if self.endpoint is not None and not re.fullmatch(r"https?://[\w.\-\[\]:]+(/.*)?", self.endpoint):
            raise ConfigError("endpoint", f"'endpoint' is '{self.endpoint}'; allowed: an address like http://host:9000")
        if self.remote is None:
            return
        if self.scheme not in declared(STORES) and (line := comes_with(f"remote={self.remote}", STORES, self.scheme)):
            raise MissingPartError(self.scheme, f"store.{line}")
        rest = self.remote.partition("://")[2]
        if not self.remote or self.scheme not in declared(STORES) or (self.scheme != "file" and not rest.strip("/")):
            raise ConfigError(
                "remote",
                f"'remote' is '{self.remote}'; allowed: a folder, or a URL with a bucket, such as s3://bucket/prefix "
                f"({', '.join(name for name in sorted(declared(STORES)) if name != 'file')})",
            )

    @property
    def scheme(self) -> str:
        """The name of the store in its entry point group; ``file`` where ``remote`` is a folder."""
        scheme, separator, _ = (self.remote or "").partition("://")
        return scheme if separator else "file"
