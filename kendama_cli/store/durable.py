"""Writes that survive a crash: temporary file, fsync, rename, fsync of the folder. The only module that renames.

After a power cut or ``kill -9`` a name holds either its old content or the new content, whole.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from kendama_cli.errors import FormatError, ReadOnlyError, StoreError
from kendama_cli.schema.json_text import json_text
from kendama_cli.system.interface import share_with_group, system

SCRATCH = ".scratch"
"""Prefix of names that are not finished; whoever finds one without its writer may delete it."""
FORMAT = 1
"""Of sealed records: results and runs. 0 stands for those without a number, as 0.1 wrote them."""
SEALED = re.compile(
    rb'\{(?P<numbered>(?:"format": (?P<number>\d+), )?)"record": (?P<body>.*), "seal": "(?P<seal>[0-9a-f]{64})"\}\n'
)
UNWRITABLE = (errno.EROFS, errno.EACCES, errno.EPERM, errno.ENOSPC, errno.EDQUOT)
INDEX_FORMAT = 1
"""Of files in ``index/``; one of another format is as good as none."""
PART_BYTES = 1 << 16
"""So much of a file is read at a time: for larger parts the system gives and takes back fresh pages each time."""


@contextlib.contextmanager
def plain_disk_errors(path: Path, option: str = "--home") -> Iterator[None]:
    """Turn an operating-system error on ``path`` into one line with a next step; ``option`` names the folder."""
    try:
        yield
    except OSError as error:
        reason = {
            errno.ENOSPC: f"the disk is full; free some space or choose another folder with {option}",
            errno.EDQUOT: f"the disk quota is used up; free some space or choose another folder with {option}",
            errno.EROFS: f"the file system is read-only; choose another folder with {option}",
            errno.EACCES: f"permission denied; choose another folder with {option}",
        }.get(error.errno or 0, error.strerror or str(error))
        kind = ReadOnlyError if error.errno in UNWRITABLE else StoreError
        kept = " (finished stages are stored)" if option == "--home" else ""
        raise kind(str(path), f"cannot write {path}: {reason}{kept}") from error


def canonical_json(value: Any) -> bytes:
    """Return the one JSON text of a value as bytes."""
    return json_text(value).encode()


def is_text(value: str) -> bool:
    """Return True if ``value`` can be stored as UTF-8; a file name in another encoding cannot."""
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def sha256(data: bytes) -> str:
    """Return the hexadecimal SHA-256."""
    return hashlib.sha256(data).hexdigest()


def file_sha256(path: Path) -> str:
    """Return the hexadecimal SHA-256 of a file's content."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while part := stream.read(PART_BYTES):
            digest.update(part)
    return digest.hexdigest()


def read_file(path: Path) -> bytes | None:
    """Return the content of ``path``; None if there is no such file. Raises StoreError if it cannot be read now."""
    with readable(path):
        try:
            return path.read_bytes()
        except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
            return None


def exists(path: Path) -> bool:
    """Return True if anything exists at ``path``; raises StoreError if that cannot be determined now."""
    with readable(path):
        try:
            os.lstat(path)
        except (FileNotFoundError, NotADirectoryError):
            return False
        return True


def listed(folder: Path) -> list[Path]:
    """Return the content of ``folder``, sorted; empty if it is absent. Raises StoreError if it cannot be read now.

    ``Path.glob`` passes over a folder that it may not read, as if nothing were in it.
    """
    with readable(folder):
        try:
            return sorted(folder.iterdir(), key=lambda path: path.name)  # paths compare slowly
        except (FileNotFoundError, NotADirectoryError):
            return []


def names(folder: Path) -> list[str]:
    """Return the names of what ``folder`` holds, in no order; as ``listed``, at a fifth of its time."""
    with readable(folder):
        try:
            return os.listdir(folder)
        except (FileNotFoundError, NotADirectoryError):
            return []


@contextlib.contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn an operating-system error at reading ``path`` into one line: it says nothing about what is stored there."""
    try:
        yield
    except OSError as error:
        raise StoreError(
            str(path),
            f"cannot read {path} now: {error.strerror or error}; nothing was changed, mend that and try again",
        ) from error


def remove_tree(folder: Path, *, ignore_errors: bool = False) -> None:
    """Delete ``folder`` with all that is in it."""
    import shutil  # noqa: PLC0415 - slow to import, and a run with nothing to do deletes nothing

    shutil.rmtree(folder, ignore_errors=ignore_errors)


def remove(path: Path) -> None:
    """Delete a file or a folder; whoever dies in the middle of a folder leaves a name that is not finished.

    Raises StoreError where it cannot be deleted.
    """
    with plain_disk_errors(path):
        if path.is_dir() and not path.is_symlink():
            retired = path.parent / f"{SCRATCH}-{os.urandom(16).hex()}"
            if not path.name.startswith(SCRATCH):
                os.replace(path, retired)
            else:
                retired = path
            remove_tree(retired)
        else:
            path.unlink(missing_ok=True)


def make_folder(path: Path) -> Path:
    """Create ``path`` with its parents, durably."""
    if os.path.isdir(path):
        return path
    with plain_disk_errors(path):
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        path.mkdir(parents=True, exist_ok=True)
        for folder in reversed(missing):
            share_with_group(folder)
        for folder in missing:
            sync(folder.parent)
    return path


def write_file(path: Path, data: bytes, *, option: str = "--home") -> None:
    """Replace ``path`` by ``data``, durably; ``option`` is what the user names its folder by."""
    with _replacing(path, option) as stream:
        stream.write(data)


def copy_file(source: Path, target: Path) -> None:
    """Replace ``target`` by the content of ``source``, durably."""
    with _replacing(target) as stream, source.open("rb") as reader:
        while part := reader.read(PART_BYTES):
            stream.write(part)


@contextlib.contextmanager
def _replacing(path: Path, option: str = "--home") -> Iterator[IO[bytes]]:
    """Write to ``path`` durably: it holds what is written meanwhile; if that fails, it stays as it was."""
    make_folder(path.parent)
    scratch = path.parent / f"{SCRATCH}-{os.urandom(16).hex()}"
    with plain_disk_errors(path, option):
        try:
            with scratch.open("wb") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            share_with_group(scratch)
            os.replace(scratch, path)
            sync(path.parent)
        finally:
            scratch.unlink(missing_ok=True)


def write_index(path: Path, value: Mapping[str, Any]) -> None:
    """Replace a rebuildable index: whole or absent, not worth an fsync, silently lost where it cannot be kept."""
    scratch = path.parent / f"{SCRATCH}-{os.urandom(16).hex()}"
    try:
        make_folder(path.parent)
        body = canonical_json(value)
        scratch.write_bytes(_index_seal(body) + body)
        share_with_group(scratch)
        os.replace(scratch, path)
    except (OSError, StoreError, ValueError):  # ValueError: a value that JSON cannot hold, such as NaN
        with contextlib.suppress(OSError):
            scratch.unlink(missing_ok=True)


def read_index(path: Path) -> dict[str, Any] | None:
    """Return the index that ``write_index`` stored; None if it is absent, or any byte is not as this version writes
    it.
    """
    try:
        data = path.read_bytes()
        body = data[len(_index_seal(b"")) :]
        value = json.loads(body) if data.startswith(_index_seal(body)) else None
    except (OSError, ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None


def _index_seal(body: bytes) -> bytes:
    return f"kendama index {INDEX_FORMAT} {sha256(body)}\n".encode()


def publish_folder(scratch: Path, target: Path) -> None:
    """Move the finished folder ``scratch`` to ``target``, durably; a ``target`` that exists is replaced."""
    with plain_disk_errors(target):
        share_with_group(scratch)
        for file in sorted(scratch.iterdir()):
            share_with_group(file)
            sync(file)
        sync(scratch)
        make_folder(target.parent)
        retired = target.parent / f"{SCRATCH}-{os.urandom(16).hex()}" if target.exists() else None
        if retired is not None:
            os.replace(target, retired)
        os.replace(scratch, target)
        sync(target.parent)
        if retired is not None:  # before its new name is durable, its files would be missed under the old one
            remove_tree(retired, ignore_errors=True)


def write_sealed(path: Path, record: dict[str, Any]) -> None:
    """Write a JSON record with a digest over itself, durably."""
    write_file(path, _sealed(record))


def read_sealed(path: Path) -> dict[str, Any] | None:
    """Return the record of ``write_sealed``; None if it is missing or any byte of it differs.

    Raises StoreError where it cannot be read now, which is not to say that it is damaged, and FormatError where it is
    whole and of another format.
    """
    data = read_file(path)
    return None if data is None else unsealed(data, str(path))


def unsealed(data: bytes, location: str) -> dict[str, Any] | None:
    """Return the record in the data that ``write_sealed`` wrote at ``location``; None if any byte differs.

    Raises FormatError where it is whole and of another format.
    """
    body = sealed_body(data, location)
    try:
        record = None if body is None else json.loads(body)
    except (ValueError, RecursionError):
        return None
    return record if isinstance(record, dict) else None


def sealed_body(data: bytes, location: str) -> bytes | None:
    """Return the JSON of the record that ``unsealed`` returns, for a reader of a small part; raises as that does."""
    found = SEALED.fullmatch(data)
    if found is None or sha256(found["numbered"] + found["body"]) != found["seal"].decode():
        return None
    number = int(found["number"] or 0)
    if number != FORMAT:
        raise FormatError(location, "a record", number, FORMAT)
    return found["body"]


def _sealed(record: dict[str, Any]) -> bytes:
    # in the order given: metrics are shown in the order in which a stage gave them
    body = json.dumps(record, allow_nan=False, ensure_ascii=False)
    numbered = f'"format": {FORMAT}, '
    return f'{{{numbered}"record": {body}, "seal": "{sha256((numbered + body).encode())}"}}\n'.encode()


def sync(path: Path) -> None:
    """Flush a file or folder to the disk."""
    system().sync(path)
