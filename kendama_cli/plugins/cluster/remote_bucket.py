"""A bucket of an object store as a shared place, by ``obstore``; an object is there whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import IO, Any

from kendama_cli.errors import MissingPartError, OfflineError, RemoteError, install_line
from kendama_cli.plugins.cluster.remote import LARGEST_READ, SMALL_BYTES, Reached
from kendama_cli.settings.store import StoreSettings

try:
    import obstore
    from obstore.store import from_url
except ImportError as missing:
    raise MissingPartError(
        "obstore", f"a shared store in a bucket needs the package obstore: {install_line('remote')}"
    ) from missing

REFUSALS = ("403 Forbidden", "401 Unauthorized", "AccessDenied", "InvalidAccessKeyId", "SignatureDoesNotMatch")
METADATA_SERVICE = "169.254.169.254"
"""Where a machine of the cloud gets its secret; asked where the environment has none."""


class BucketRemote:
    """See ``Remote``. The secret comes from the environment, as the provider's own tools have it."""

    def __init__(self, settings: StoreSettings) -> None:
        self.place = str(settings.remote)
        limit = timedelta(seconds=settings.timeout_s)
        config: Any = {} if settings.endpoint is None else {"endpoint": settings.endpoint}
        options: Any = {"timeout": max(limit, timedelta(minutes=5)), "connect_timeout": limit}
        options["allow_http"] = (settings.endpoint or "").startswith("http://")
        retry: Any = {"max_retries": 2, "retry_timeout": limit}
        try:
            self._store = from_url(self.place, config=config, client_options=options, retry_config=retry)
        except (obstore.exceptions.BaseError, ValueError) as error:
            raise RemoteError(self.place, f"store.remote={self.place}: {_first_line(error)}") from error

    def read(self, name: str) -> bytes | None:
        """See ``Remote``."""
        with Reached(self._absent):
            found = obstore.get(self._store, name)
            return bytes(found.bytes()) if found.meta["size"] <= LARGEST_READ else b""
        return None

    def fetch(self, name: str, target: Path) -> bool:
        """See ``Remote``."""
        with Reached(self._absent):
            _copy(obstore.get(self._store, name), target)
            return True
        return False

    def opened(self, name: str, scratch: Path) -> IO[bytes] | None:
        """See ``Remote``."""
        with Reached(self._absent):
            found = obstore.get(self._store, name)
            if found.meta["size"] <= SMALL_BYTES:
                return io.BytesIO(bytes(found.bytes()))
            _copy(found, scratch)
            return scratch.open("rb")
        return None

    def size(self, name: str) -> int | None:
        """See ``Remote``."""
        with Reached(self._absent):
            return int(obstore.head(self._store, name)["size"])
        return None

    def put(self, name: str, content: bytes | Path) -> None:
        """See ``Remote``."""
        with Reached(self._refuse):
            obstore.put(self._store, name, content)

    def names(self, prefix: str) -> Iterator[str]:
        """See ``Remote``."""
        with Reached(self._refuse):
            yield from self._below(prefix)

    def _below(self, folder: str) -> list[str]:
        """List a folder; where the library stumbles over a name that no path can have, whatever lies beside that."""
        try:
            return [str(one["path"]) for part in obstore.list(self._store, folder) for one in part]
        except obstore.exceptions.InvalidPathError:
            try:
                level = obstore.list_with_delimiter(self._store, folder)
            except obstore.exceptions.InvalidPathError:
                # it stands in this very folder: an empty name, '.' and '..' sort before every name of ours
                after = obstore.list(self._store, folder, offset=f"{folder}/0")
                return [str(one["path"]) for part in after for one in part]
        inner = [name for one in level["common_prefixes"] for name in self._below(str(one).rstrip("/"))]
        return [*(str(one["path"]) for one in level["objects"]), *inner]

    def _absent(self, error: BaseException) -> bool:
        """Return True if an object alone is not there; raises what ``error`` says otherwise."""
        missing = isinstance(error, FileNotFoundError | obstore.exceptions.NotFoundError)
        return (missing and "NoSuchBucket" not in str(error)) or self._refuse(error)

    def _refuse(self, error: BaseException) -> bool:
        """Tell an error of the library in ours; any other one goes on."""
        if not isinstance(error, obstore.exceptions.BaseError | OSError):
            return False
        if isinstance(error, obstore.exceptions.InvalidPathError):
            message = f"store.remote={self.place}: {_first_line(error)}; delete that object"
            raise RemoteError(self.place, message) from error
        text, begin = str(error), f"store.remote={self.place}:"
        if "NoSuchBucket" in text or isinstance(error, FileNotFoundError):
            raise RemoteError(self.place, f"{begin} there is no such bucket; make it, or name another") from error
        if METADATA_SERVICE in text:
            keys = "set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or what your provider asks for"
            raise RemoteError(self.place, f"{begin} the environment has no secret for it; {keys}") from error
        if any(word in text for word in REFUSALS):
            raise RemoteError(self.place, f"{begin} access is refused; check its secret and its rights") from error
        raise OfflineError(self.place, f"{begin} it cannot be reached ({_first_line(error)})") from error


def _copy(found: obstore.GetResult, target: Path) -> None:
    with target.open("wb") as stream:
        for part in found:
            stream.write(part)


def _first_line(error: BaseException) -> str:
    return str(error).strip().splitlines()[0][:160]
