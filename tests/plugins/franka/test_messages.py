"""Messages come out of the pipe as they went in, and bytes that are no message are one clear line."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from kendama_cli.errors import HardwareError
from kendama_cli.plugins.franka.messages import (
    Begin,
    Done,
    Failure,
    Message,
    Recover,
    Stands,
    Wanted,
    decode,
    encode,
)
from tests.plugins.franka.arm import FRANKA
from tests.plugins.franka.test_control_loop import LIMITS

NUMBERS = np.array([0.1, -2.0 / 3.0, 1e-300, 5e-324, -0.0, 3.0, np.pi])


@pytest.mark.parametrize(
    "message",
    [
        Begin(FRANKA, LIMITS),
        Recover(),
        Wanted(NUMBERS, -NUMBERS),
        Stands(NUMBERS),
        Done(*(NUMBERS + k for k in range(7)), np.arange(6.0), 12),
        Failure("a reflex stopped it"),
    ],
    ids=lambda message: type(message).__name__,
)
def test_every_message_survives_to_the_last_bit(message: Message) -> None:
    back = decode(encode(message))
    assert type(back) is type(message)
    assert repr(dataclasses.asdict(back)) == repr(dataclasses.asdict(message))
    assert encode(back) == encode(message)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x80\x04\x95",  # how a pickle begins
        b"{}",
        b'["Nobody", {}]',
        b'["Stands", {"nothing": [1]}]',
        b'["Wanted", {"position_rad": [0]}]',
        json.dumps(["Begin", {"hardware": {"kind": "franka"}, "limits": {}}]).encode(),
    ],
)
def test_bytes_that_are_no_message_are_one_clear_line(data: bytes) -> None:
    with pytest.raises(HardwareError, match="said what is no message") as caught:
        decode(data)
    assert "\n" not in str(caught.value)
