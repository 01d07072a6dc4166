"""A key is 32 random bytes that nobody else can read, or it is refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from kendama_cli.devices.robot.udp.seal import make_key, read_key
from kendama_cli.errors import InputError


def test_a_key_that_was_made_is_read_and_is_its_owners_alone(tmp_path: Path) -> None:
    keys = [make_key(str(tmp_path / "new folder" / name)) for name in ("a", "b")]
    assert len({read_key(str(file)) for file in keys}) == 2
    assert all(len(read_key(str(file))) == 32 and file.stat().st_mode & 0o777 == 0o600 for file in keys)


def test_a_key_is_never_replaced(tmp_path: Path) -> None:
    file = make_key(str(tmp_path / "key"))
    before = file.read_bytes()
    with pytest.raises(InputError, match="there is a file already; a key is never replaced"):
        make_key(str(file))
    assert file.read_bytes() == before


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o620, 0o602])
def test_a_key_that_others_may_use_is_refused(tmp_path: Path, mode: int) -> None:
    file = make_key(str(tmp_path / "key"))
    file.chmod(mode)
    with pytest.raises(InputError, match=f"its mode is {mode:04o}, allowed is 0600; 'chmod 600"):
        read_key(str(file))


@pytest.mark.parametrize("text", ["", "ab" * 31, "ab" * 33, "zz" * 32, "ä" * 64])
def test_what_is_no_key_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "key"
    file.touch(0o600)
    file.write_text(text)
    with pytest.raises(InputError, match="this is no key: allowed are 64 hexadecimal digits"):
        read_key(str(file))


def test_a_key_that_is_not_there_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="the key cannot be read: No such file or directory; give the robot the key that"
    ):
        read_key(str(tmp_path / "none"))


def test_a_key_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="the key cannot be written: "):
        make_key(str(tmp_path / "file" / "key"))
