"""An artifact's folder as one file, the same bytes from the same artifact: an uncompressed tar, its manifest first.

What comes back out of one is what the digest says or nothing: a pack may have been written by anybody.
"""

from __future__ import annotations

import hashlib
import io
import tarfile
from pathlib import Path
from typing import IO, Any

from kendama_cli.errors import FormatError
from kendama_cli.store import durable
from kendama_cli.store.store import MANIFEST, manifest_in

LARGEST_MANIFEST = 1 << 20


def pack(folder: Path, manifest: dict[str, Any], target: IO[bytes]) -> None:
    """Write the artifact in ``folder``, whose manifest is ``manifest``, to ``target``."""
    with tarfile.open(fileobj=target, mode="w:", format=tarfile.GNU_FORMAT) as archive:
        for name in (MANIFEST, *sorted(manifest["files"])):
            member = tarfile.TarInfo(name)  # no owner, no times
            member.size = (folder / name).stat().st_size
            with (folder / name).open("rb") as stream:
                archive.addfile(member, stream)


def unpack(source: IO[bytes], digest: str, folder: Path) -> str | None:
    """Write what ``source`` packs into ``folder``; what is wrong, where that is not the artifact ``digest``.

    Raises FormatError where it is whole and of another format.
    """
    try:
        with tarfile.open(fileobj=source, mode="r:") as archive:
            return _unpack(archive, digest, folder)
    except FormatError:
        raise
    except (tarfile.TarError, ValueError, EOFError) as error:
        return f"it is no pack of an artifact ({' '.join(str(error).split())})"


def _unpack(archive: tarfile.TarFile, digest: str, folder: Path) -> str | None:
    first = archive.next()
    if first is None or first.name != MANIFEST or not first.isreg() or first.size > LARGEST_MANIFEST:
        return "its manifest is missing"
    data = _content(archive, first).read()
    manifest = manifest_in(data, digest, str(folder / MANIFEST))
    if manifest is None:
        return "the manifest's bytes are not those that its name says"
    (folder / MANIFEST).write_bytes(data)
    missing = dict(manifest["files"])
    while member := archive.next():
        facts = missing.pop(member.name, None)
        if facts is None or Path(member.name).name != member.name or not member.isreg():
            return f"'{member.name}' is none of its files"
        if member.size != facts["size"] or _copied(_content(archive, member), folder / member.name) != facts["sha256"]:
            return f"the bytes of '{member.name}' are not those written"
    return f"'{next(iter(missing))}' is missing" if missing else None


def _content(archive: tarfile.TarFile, member: tarfile.TarInfo) -> IO[bytes]:
    return archive.extractfile(member) or io.BytesIO()


def _copied(source: IO[bytes], target: Path) -> str:
    """Copy; the SHA-256 of what was copied."""
    digest = hashlib.sha256()
    with target.open("wb") as stream:
        while part := source.read(durable.PART_BYTES):
            digest.update(part)
            stream.write(part)
    return digest.hexdigest()


def packed_bytes(manifest: dict[str, Any]) -> int:
    """Return the size of the pack of an artifact."""
    data = durable.canonical_json(manifest)
    sizes = [len(data), *(int(facts["size"]) for facts in manifest["files"].values())]
    blocks = sum(1 + -(-size // tarfile.BLOCKSIZE) for size in sizes) + 2  # a header each, and two at the end
    return -(-blocks * tarfile.BLOCKSIZE // tarfile.RECORDSIZE) * tarfile.RECORDSIZE
