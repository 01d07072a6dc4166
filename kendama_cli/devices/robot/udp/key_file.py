"""The secret that a robot and its commander share, as a file: 32 random bytes in hexadecimal, for its owner alone."""

from __future__ import annotations

import os
import secrets
import stat
from pathlib import Path

from kendama_cli.devices.robot.udp.seal import KEY_BYTES
from kendama_cli.errors import InputError

_LARGEST = 4096


def read_key(path: str) -> bytes:
    """Read the key in ``path`` (~ is the home folder); raises InputError if it is none, or others may read it."""
    file = Path(path).expanduser()
    try:
        with file.open("rb") as stream:
            facts = os.fstat(stream.fileno())
            text = stream.read(_LARGEST)
    except OSError as error:
        remedy = f"make one with 'kendama robot key {path}' and give the robot the same"
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
