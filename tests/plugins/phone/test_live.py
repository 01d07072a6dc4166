"""A phone as a player's hand, without a browser: its samples in, the cup's positions and the kept path out."""

from __future__ import annotations

import json
import ssl
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from kendama_cli.errors import InputError, UsageError
from kendama_cli.plugins.phone.live.hand import PhoneHand
from tests.plugins.phone.phones import UPRIGHT, bundled_swing, rms_m, take


def swung(seed, **how):
    how = {"rate_hz": 60.0, "rests_s": (1.5, 2.5), "lean_deg": 15.0, "held": UPRIGHT, **how}
    return take(np.random.default_rng(seed), bundled_swing(1 + seed % 12), **how)


def said(hand, one, until_s=np.inf, **extra):
    """Say a recording sample by sample; return rows t [s], lateral, up, tilt, held, and the lines shown."""
    rows, lines = [], []
    for t_s, force, rate in zip(one.t_s, one.force, one.rate, strict=True):
        if t_s < until_s:
            message = hand.take(json.dumps({"samples": [[1e3 * t_s, *force, *np.degrees(rate)]], **extra}))
            rows += [[row[0] / 1e3, *row[1:], message["held"]] for row in (message or {"samples": []})["samples"]]
            lines += [hand.hint] if not lines or lines[-1] != hand.hint else []
    return np.array(rows, dtype=float).reshape(-1, 5), lines


def test_the_drawn_cup_follows_and_the_kept_path_is_nearer():
    drawn, kept = [], []
    for seed in range(8):
        hand, one = PhoneHand(), swung(seed)
        rows, lines = said(hand, one)
        held = rows[rows[:, 4] > 0]
        true = CubicSpline(one.true_s, one.true_m)
        asked = true(held[:, 0]) - true(held[0, 0])
        drawn.append(np.sqrt(np.mean((held[:, 1] - asked[:, 0]) ** 2 + (held[:, 2] - asked[:, 2]) ** 2)))
        t_s, places, doubts = hand.path()
        began_s = held[0, 0] - 1.0
        at_s = one.t_s[np.searchsorted(one.t_s, began_s)] + t_s
        kept.append(rms_m(places[:, :3], true(np.minimum(at_s, one.true_s[-1]))))
        assert lines[:2] == ["Hold the phone still: top edge up, screen towards you.", lines[1]]
        assert lines[1].startswith("Ready")
        assert lines[-1].startswith("Ready")
        assert "neither is a bound" in doubts[0]
        # the path is not turned by half a turn against what was drawn
        assert np.corrcoef(np.interp(held[:, 0], at_s, places[:, 0]), held[:, 1])[0, 1] > 0.9
    assert np.median(drawn) < 0.04
    assert np.median(kept) < 0.01


def test_two_tries_begin_at_the_origin_each():
    hand, one = PhoneHand(), swung(1)
    said(hand, one)
    later = replace(one, t_s=one.t_s + one.t_s[-1] + 0.02)
    rows, _ = said(hand, later)
    held = rows[rows[:, 4] > 0]
    assert held[0, 1:4] == pytest.approx([0, 0, 0])
    assert hand.settled


def test_a_motion_without_a_rest_is_not_kept():
    hand = PhoneHand()
    said(hand, swung(1), until_s=2.6)
    assert not hand.settled
    with pytest.raises(InputError, match="not still at its end; hold the phone still"):
        hand.path()


def test_a_motion_that_is_cut_off_is_not_kept_as_the_one_before():
    hand, one = PhoneHand(), swung(1)
    said(hand, one)
    later = replace(one, t_s=one.t_s + one.t_s[-1] + 0.02)
    said(hand, later, until_s=later.t_s[0] + 2.6)
    with pytest.raises(InputError, match="not still at its end"):
        hand.path()


@pytest.mark.parametrize(
    ("how", "line"),
    [
        ({"rate_hz": 10.0}, "Only 10 samples a second arrive; 45 are needed"),
        ({"held": UPRIGHT * UPRIGHT}, "Hold the phone upright"),
        ({"held": UPRIGHT.inv()}, "The top edge points down"),
    ],
)
def test_a_phone_that_cannot_play_is_told_so(how, line):
    one = swung(1, rests_s=(3.0, 0.5))
    if "rate_hz" in how:
        one = replace(one, t_s=one.t_s[::6], force=one.force[::6], rate=one.rate[::6])
    else:
        turned = how["held"].inv() * UPRIGHT
        one = replace(one, force=turned.apply(one.force), rate=turned.apply(one.rate))
    hand = PhoneHand()
    said(hand, one, until_s=2.8)
    assert hand.hint.startswith(line)


def test_the_other_sign_is_turned_when_the_player_says_so():
    one = swung(1)
    hand = PhoneHand()
    said(hand, replace(one, force=-one.force), until_s=1.3)
    assert hand.hint.startswith("The top edge points down")
    said(hand, replace(one, force=-one.force), until_s=1.3, turned=True)
    assert hand.hint.startswith("Ready")


@pytest.mark.parametrize("text", ["", "[]", '{"samples": [[1, 2]]}', '{"samples": [["a", 0, 0, 0, 0, 0, 0]]}'])
def test_a_message_that_is_none_is_refused(text):
    with pytest.raises(UsageError, match="a message of the phone"):
        PhoneHand().take(text)


def test_the_certificate_serves_its_hosts_and_the_code_is_readable(tmp_path):
    pytest.importorskip("segno", reason="needs the extra 'phone'")
    join = pytest.importorskip("kendama_cli.plugins.phone.live.join").PhoneJoin()
    certificate, key, fingerprint = join.certificate(tmp_path, ("192.0.2.7", "laptop"))
    ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    assert key.stat().st_mode & 0o077 == 0
    assert len(fingerprint) == 95
    lines, picture = join.code("https://192.0.2.7:8443/join?token=abc")
    assert picture.startswith(b"<?xml")
    # half blocks, two rows of modules a line: drawn and read by a decoder of others
    rows = [line for line in lines.splitlines() if line]
    halves = {" ": (0, 0), "▀": (1, 0), "▄": (0, 1), "█": (1, 1)}
    plain = [line.replace("\x1b[0m", "") for line in rows]
    image = np.array([[halves[c][half] for c in line] for line in plain for half in (0, 1)], dtype=np.uint8) * 255
    large = np.kron(image, np.ones((8, 8), dtype=np.uint8))
    assert cv2.QRCodeDetector().detectAndDecode(large)[0] == "https://192.0.2.7:8443/join?token=abc"
