"""Datagrams under a key: what is packed is unpacked under the same key, and nothing else is ever believed."""

from __future__ import annotations

import struct
from hashlib import blake2s

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.seal import (
    ForeignDatagramError,
    Seal,
    fresh_nonce,
    read_header,
    session_number,
    session_seal,
)

KEY = bytes(range(32))
NUMBERS = st.integers(0, 2**64 - 1)


@given(st.sampled_from(list(Kind)), NUMBERS, NUMBERS, st.binary(max_size=600))
def test_what_is_packed_is_unpacked(kind: Kind, session: int, counter: int, payload: bytes) -> None:
    datagram = Datagram(kind, session, counter, payload)
    assert Seal(KEY).unpack(Seal(KEY).pack(datagram)) == datagram


@given(st.binary(max_size=80))
def test_arbitrary_bytes_are_foreign(data: bytes) -> None:
    with pytest.raises(ForeignDatagramError):
        Seal(KEY).unpack(data)


@given(st.data())
def test_every_flipped_bit_and_every_other_length_is_noticed(data: st.DataObject) -> None:
    whole = bytearray(Seal(KEY).pack(Datagram(Kind.COMMAND, 7, 3, bytes(48))))
    if data.draw(st.booleans()):
        bit = data.draw(st.integers(0, 8 * len(whole) - 1))
        whole[bit // 8] ^= 1 << bit % 8
    elif data.draw(st.booleans()):
        whole += data.draw(st.binary(min_size=1, max_size=50))
    else:
        del whole[data.draw(st.integers(0, len(whole) - 1)) :]
    with pytest.raises(ForeignDatagramError):
        Seal(KEY).unpack(bytes(whole))


def test_the_layout_is_fixed_and_little_endian_and_its_tag_is_rfc_7693s() -> None:
    data = Seal(KEY).pack(Datagram(Kind.RESET, 0x0102030405060708, 9, b"ab"))
    assert data[:4] == b"KNDM"
    assert struct.unpack_from("<HHQQ", data, 4) == (protocol.VERSION, 5, 0x0102030405060708, 9)
    assert data[24:26] == b"ab"
    assert data[26:] == blake2s(data[:26], key=KEY, digest_size=16).digest()
    assert read_header(data) == (Kind.RESET, 0x0102030405060708, 9)


@given(st.binary(min_size=32, max_size=32).filter(lambda key: key != KEY))
def test_another_key_unpacks_nothing(other: bytes) -> None:
    with pytest.raises(ForeignDatagramError):
        Seal(other).unpack(Seal(KEY).pack(Datagram(Kind.HALT, 1, 1)))


@pytest.mark.parametrize("length", [0, 16, 31])
def test_a_key_that_is_too_short_seals_nothing(length: int) -> None:
    with pytest.raises(ValueError, match=f"a key has 32 bytes; this one has {length}"):
        Seal(bytes(length))


@pytest.mark.parametrize("part", ["secret", "commander", "robot"])
def test_a_session_is_sealed_by_secret_and_both_nonces(part: str) -> None:
    given = {"secret": KEY, "commander": bytes(16), "robot": b"\1" * 16}
    changed = {**given, part: bytes([given[part][0] ^ 1]) + given[part][1:]}
    sealed = session_seal(*given.values()).pack(Datagram(Kind.OPEN, 1, 1))
    assert session_seal(*given.values()).unpack(sealed).kind is Kind.OPEN
    with pytest.raises(ForeignDatagramError):
        session_seal(*changed.values()).unpack(sealed)


def test_nonces_differ_and_number_a_session() -> None:
    nonces = [fresh_nonce() for _ in range(1000)]
    assert len(set(nonces)) == 1000
    assert all(session_number(nonce) for nonce in nonces)


@pytest.mark.parametrize(("at", "value"), [(0, b"JUNK"), (4, b"\x04\x00"), (6, b"\x63\x00")])
def test_another_protocol_version_or_kind_is_foreign_by_its_header(at: int, value: bytes) -> None:
    data = Seal(KEY).pack(Datagram(Kind.HALT, 1, 1))
    assert read_header(data[:at] + value + data[at + len(value) :]) is None
