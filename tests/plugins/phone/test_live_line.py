"""The line of phones over HTTPS: who is let in, what is refused, and what the command says aloud."""

from __future__ import annotations

import json
import ssl
import time
import urllib.error
import urllib.request

import pytest

from kendama_cli.plugins.teleoperation.play.messages import LONGEST

UNVERIFIED = ssl.create_default_context()
UNVERIFIED.check_hostname, UNVERIFIED.verify_mode = False, ssl.CERT_NONE
STILL = {"samples": [[20.0 * k, 0.0, 9.8, 0.0, 0.0, 0.0, 0.0] for k in range(80)]}


def asked(game, session, body, token=None, player="bo"):
    """Post a phone's message; return status and what is answered."""
    base, _, query = game.joining.partition("/join?token=")
    address = f"{base}/joined?token={query if token is None else token}&player={player}&session={session}"
    try:
        with urllib.request.urlopen(address, body.encode(), timeout=20, context=UNVERIFIED) as answer:
            return answer.status, json.loads(answer.read())
    except urllib.error.HTTPError as refused:
        return refused.code, refused.read().decode()


def test_the_network_is_told_aloud_with_address_code_and_fingerprint(game):
    said = "\n".join(game.said)
    assert "open to your network on purpose, over HTTPS: phones join at https://" in said
    assert "SHA-256" in said
    assert said.count("\u2588") > 100
    assert game.address.startswith("http://127.0.0.1:")


def test_a_phone_without_the_token_or_beyond_measure_is_refused(game):
    assert asked(game, "a", json.dumps(STILL), token="wrong")[0] == 403
    assert asked(game, "a", " " * (LONGEST + 1))[0] == 413
    with pytest.raises(urllib.error.URLError, match="CERTIFICATE_VERIFY_FAILED"):
        urllib.request.urlopen(game.joining, timeout=20)


def test_a_phone_at_rest_is_told_that_it_may_swing(game):
    status, answer = asked(game, "b", json.dumps(STILL))
    assert status == 200
    assert answer == [{"type": "hint", "line": "Ready: swing to the left and right of the screen."}]


def test_several_phones_play_at_once_and_a_name_moves_to_its_last_phone(game):
    for session, player in (("x", "ada"), ("y", "ben"), ("z", "ada")):
        assert asked(game, session, json.dumps(STILL), player=player)[0] == 200
    until_s = time.monotonic() + 20
    said = []
    while not any(one["type"] == "ended" for one in said):
        assert time.monotonic() < until_s
        said += asked(game, "x", '{"samples": []}', player="ada")[1]
    assert said[-1]["line"] == "'ada' plays in another window now"
    assert {"ada plays", "ben plays"} <= set(game.said)


def test_a_phone_that_says_nonsense_is_ended_with_the_reason(game):
    asked(game, "c", json.dumps(STILL))
    _, answer = asked(game, "c", "{}")
    assert answer[-1]["type"] == "ended"
    assert "no list of samples" in answer[-1]["line"]


def test_a_name_without_a_letter_is_ended_with_the_reason(game):
    said = []
    for _ in range(20):
        said += asked(game, "d", '{"samples": []}', player="--")[1]
        if any(one["type"] == "ended" for one in said):
            break
    assert any("no letter or digit" in one["line"] for one in said)
