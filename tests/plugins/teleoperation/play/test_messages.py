"""Messages that a socket may send."""

import pytest

from kendama_cli.errors import UsageError
from kendama_cli.plugins.teleoperation.play.messages import About, Ease, Hand, parse


def test_the_three_kinds_of_message():
    hand = parse('{"type": "hand", "samples": [[1000, 0.1, 0.2, 0]], "held": true, "by": "pen"}')
    assert isinstance(hand, Hand)
    assert (hand.samples[0].t_s, hand.samples[0].up_m, hand.held) == (1.0, 0.2, True)
    assert isinstance(parse('{"type": "ease", "gravity": 1, "rope": 1, "cup": 1.5}'), Ease)
    assert parse('{"type": "rename", "name": "a-001", "value": "b"}') == About("rename", "a-001", "b")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not JSON"),
        ("[" * 100_000, "not JSON"),
        (b"\xff\xfe", "not JSON"),
        ("[]", "no object"),
        ("{}", "of the kind 'None'"),
        ('{"type": "format c:"}', "allowed: hand, ease, rename, choose, delete, show"),
        ('{"type": "hand"}', "no list of 1 to 1000"),
        ('{"type": "hand", "samples": []}', "no list of 1 to 1000"),
        ('{"type": "hand", "samples": [[1, 2, 3]]}', "not four finite numbers"),
        ('{"type": "hand", "samples": [[1, 2, NaN, 0]]}', "not four finite numbers"),
        ('{"type": "hand", "samples": [[1, true, 0, 0]]}', "not four finite numbers"),
        ('{"type": "hand", "samples": [[1, 1e99, 0, 0]]}', "not four finite numbers"),
        ('{"type": "hand", "samples": [[1, 1e9, 0, 0]]}', "beyond 1000 m"),
        ('{"type": "ease", "gravity": "low"}', "'gravity' is not a finite number"),
        ('{"type": "delete"}', "'delete' needs the name of a try"),
    ],
)
def test_what_is_no_message_is_told_in_a_line(text, words):
    with pytest.raises(UsageError, match=words) as told:
        parse(text)
    assert "\n" not in str(told.value)
