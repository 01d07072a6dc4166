"""Authentication of the line: datagrams under a key, and the session that both ends derive from a secret.

Every datagram is a header (magic, version, kind, session, counter), a payload, and a tag: BLAKE2s of 16 bytes over all
before it, keyed by 32 bytes (RFC 7693). A session begins so:

    commander  HELLO      its nonce                  under the secret
    robot      CHALLENGE  that nonce, the robot's    under the secret; the header names the session that is open, or 0
    commander  OPEN       its nonce                  under the session's key
    robot      WELCOME                               under the session's key, as everything from here on

The session's key is BLAKE2s of 32 bytes, keyed by the secret, over "kendama session" and both nonces. The robot draws
another nonce whenever a session has begun and whenever it starts, so that nothing recorded is ever valid again; within
a session the counter orders the commander's datagrams, and an answer bears the counter of what it answers.
"""

from __future__ import annotations

import os
import secrets
import shlex
import stat
import struct
from hashlib import blake2s
from hmac import compare_digest
from pathlib import Path

from kendama_cli.devices.robot.udp.protocol import VERSION, Datagram, Kind
from kendama_cli.errors import InputError

KEY_BYTES = 32
NONCE_BYTES = 16
TAG_BYTES = 16
MAGIC = b"KNDM"
_HEADER = struct.Struct("<4sHHQQ")
_PURPOSE = b"kendama session"
_KINDS = {int(kind): kind for kind in Kind}


class ForeignDatagramError(Exception):
    """Bytes that nobody who has the key has packed; they are counted, and never acted on."""


class Seal:
    """Packs datagrams under one key of 32 bytes, and unpacks what was packed under the same."""

    def __init__(self, key: bytes) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a key has {KEY_BYTES} bytes; this one has {len(key)}")
        self._keyed = blake2s(key=key, digest_size=TAG_BYTES)

    def pack(self, datagram: Datagram) -> bytes:
        """Pack ``datagram`` into bytes."""
        kind, session, counter = int(datagram.kind), datagram.session, datagram.counter
        bare = _HEADER.pack(MAGIC, VERSION, kind, session, counter) + datagram.payload
        return bare + self._tag(bare)

    def unpack(self, data: bytes) -> Datagram:
        """Unpack the datagram in ``data``; raises ForeignDatagramError for other bytes before any other work."""
        header = read_header(data)
        if header is None or not compare_digest(self._tag(data[:-TAG_BYTES]), data[-TAG_BYTES:]):
            raise ForeignDatagramError
        kind, session, counter = header
        return Datagram(kind, session, counter, data[_HEADER.size : -TAG_BYTES])

    def _tag(self, bare: bytes) -> bytes:
        keyed = self._keyed.copy()
        keyed.update(bare)
        return keyed.digest()


def read_header(data: bytes) -> tuple[Kind, int, int] | None:
    """Read kind, session and counter that ``data`` claims; None if it is not of this protocol."""
    if len(data) < _HEADER.size + TAG_BYTES:
        return None
    magic, version, kind, session, counter = _HEADER.unpack_from(data)
    known = _KINDS.get(kind)
    return None if magic != MAGIC or version != VERSION or known is None else (known, session, counter)


def session_seal(secret: bytes, commander_nonce: bytes, robot_nonce: bytes) -> Seal:
    """Return the seal of the session that these nonces began."""
    return Seal(blake2s(_PURPOSE + commander_nonce + robot_nonce, key=secret, digest_size=KEY_BYTES).digest())


def session_number(robot_nonce: bytes) -> int:
    """Return the number of the session that begins with ``robot_nonce``: its first eight bytes."""
    return int.from_bytes(robot_nonce[:8], "little")


def fresh_nonce() -> bytes:
    """Return random bytes; as the number of a session they are not 0, which stands for none."""
    while session_number(nonce := secrets.token_bytes(NONCE_BYTES)) == 0:
        pass
    return nonce


_MAX_BYTES = 4096


def read_key(path: str) -> bytes:
    """Read the key in ``path`` (~ is the home folder); raises InputError if it is none, or others may read it."""
    file = Path(path).expanduser()
    try:
        with file.open("rb") as stream:
            facts = os.fstat(stream.fileno())
            text = stream.read(_MAX_BYTES)
    except OSError as error:
        remedy = f"give the robot the key that this makes: kendama robot key {shlex.quote(path)}"
        raise InputError(str(file), f"the key cannot be read: {error.strerror}", remedy=remedy) from None
    if os.name == "posix" and stat.S_IMODE(facts.st_mode) & 0o077:
        mode = f"{stat.S_IMODE(facts.st_mode):04o}"
        raise InputError(
            str(file),
            f"other users may use this key: its mode is {mode}, allowed is 0600",
            remedy=f"'chmod 600 {file}', and make another key where somebody may have read it",
        )
    try:
        key = bytes.fromhex(text.decode("ascii").strip())
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise InputError(
            str(file),
            f"this is no key: allowed are {2 * KEY_BYTES} hexadecimal digits",
            remedy="'kendama robot key FILE' makes one",
        )
    return key


def make_key(path: str) -> Path:
    """Write a new key to ``path``, for its owner alone; raises InputError if a file is there, or none can be made."""
    file = Path(path).expanduser()
    if file.exists():
        raise InputError(str(file), "there is a file already", remedy="a key is never replaced; choose another")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        number = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as error:
        raise InputError(str(file), f"the key cannot be written: {error.strerror}") from None
    with os.fdopen(number, "w", encoding="ascii") as stream:
        stream.write(secrets.token_hex(KEY_BYTES) + "\n")
    return file
