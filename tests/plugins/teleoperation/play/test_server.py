"""The server as players meet it: over its own sockets, with all that can go wrong on them."""

from __future__ import annotations

import contextlib
import json
import threading
import time
import urllib.error
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed

from tests.plugins.teleoperation.play.table_top import caught_swing, hand

pytestmark = pytest.mark.realtime


def get(address):
    try:
        with urllib.request.urlopen(address, timeout=10) as answer:
            return answer.status, answer.read().decode(), answer.headers
    except urllib.error.HTTPError as refused:
        return refused.code, refused.read().decode(), refused.headers


def swing(line, until=None):
    """Drag the bundled swing, as fast as it catches, at its own pace; the last state."""
    samples = hand(caught_swing()[0])[:until]
    began, state = time.monotonic(), None
    for k in range(0, len(samples), 4):
        part = samples[k : k + 4]
        time.sleep(max(0.0, part[-1].t_s - samples[0].t_s - (time.monotonic() - began)))
        rows = [[1000 * one.t_s, one.aside_m, one.up_m, one.tilt_rad] for one in part]
        line.say(type="hand", samples=rows, held=True)
        state = line.hear("state")
    return state


def test_the_page_needs_the_token_and_loads_nothing_from_elsewhere(game):
    status, page, headers = get(game.address)
    assert status == 200
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "http" not in page.replace("http-equiv", "")
    for wrong in (f"http://{game.place}/", game.address[:-1], f"http://{game.place}/?token=é".replace("é", "%C3%A9")):
        status, said, _ = get(wrong)
        assert status == 403
        assert "has expired or is not complete: open the one that 'kendama play' printed last" in said
        assert said.count("\n") == 1
    assert get(f"http://{game.place}/assets/../server.py")[0] == 404
    assert "127.0.0.1" in game.place


def test_a_swing_is_caught_counted_shown_named_and_deleted(game):
    with game.line("Ben") as line:
        assert line.hear("table")["folder"] == str(game.folder / "plays" / "ben")
        state = swing(line)
        assert state["outcome"] == "caught"
        kept = line.latest["tries"]["tries"]
        assert [(one["name"], one["outcome"], one["chosen"]) for one in kept] == [("ben-001", "caught", True)]
        line.say(type="show", name="ben-001")
        shown = line.hear("replay")
        assert len(shown["times"]) == len(shown["frames"]) > 200
        line.say(type="rename", name="ben-001", value="first one")
        assert line.hear("tries")["tries"][0]["name"] == "ben-first-one"
        line.say(type="delete", name="ben-001")
        assert "there is no try 'ben-001' of ben" in line.hear("error")["line"]
        line.say(type="delete", name="ben-first-one")
        line.hear("tries")
        assert line.hear("tries")["tries"] == []
    assert list((game.folder / "plays" / "ben").iterdir()) == []


def test_a_page_that_closes_in_the_middle_leaves_its_try(game):
    with game.line("Cleo") as line:
        swing(line, until=200)
    deadline = time.monotonic() + 10
    while not (found := list((game.folder / "plays").glob("cleo/*.csv"))) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert "# outcome: interrupted\n# chosen: no\n" in found[0].read_text()
    assert "# note: the page was closed, or its line was lost\n" in found[0].read_text()


def test_two_windows_of_one_player_do_not_fight(game):
    with game.line("dora") as first, game.line("Dora") as second:
        assert first.goodbye() == (4000, "'dora' plays in another window now")
        assert swing(second, until=40)["phase"] == "playing"


@pytest.mark.parametrize(
    ("message", "code", "words"),
    [
        ("nonsense", 4000, "a message of the page is not JSON"),
        (json.dumps({"type": "hand", "samples": [[float("nan")] * 4]}), 4000, "not four finite numbers"),
        ("x" * 100_000, 1009, ""),
    ],
)
def test_a_message_that_is_none_ends_the_line_and_keeps_the_try(game, message, code, words):
    name = f"eve-{code}-{len(message)}"
    with game.line(name) as line:
        swing(line, until=200)
        line.socket.send(message)
        closed, reason = line.goodbye()
    assert closed == code
    assert words in reason
    time.sleep(0.3)
    assert len(list((game.folder / "plays" / name).glob("*.csv"))) == 1
    assert sum(said.startswith(f"{name}: a ") for said in game.said) == 1


def test_a_wrong_token_or_name_is_told(game):
    with game.line("frank", token="old") as line:
        code, reason = line.goodbye()
        assert (code, "has expired" in reason) == (4000, True)
    with game.line("%20") as line:
        assert "has no letter or digit" in line.goodbye()[1]
    with game.line("../../etc") as line:
        assert line.hear("table")["player"] == "etc"


def test_a_player_may_have_a_name_in_any_script(game):
    with game.line("%D0%90%D0%BD%D0%BD%D0%B0") as line:
        assert line.hear("table")["player"] == "анна"
        assert swing(line)["outcome"] == "caught"
        assert [one["name"] for one in line.latest["tries"]["tries"]] == ["анна-001"]
        line.say(type="choose", name="анна-001", value="no")
        assert not line.hear("tries")["tries"][0]["chosen"]
    assert (game.folder / "plays" / "анна" / "анна-001.csv").exists()


def test_a_try_that_cannot_be_written_is_told_before_it_and_after(game):
    (game.folder / "plays" / "kim").write_text("in the way")
    with game.line("Kim") as line:
        told = line.hear("error")
        assert "tries cannot be kept in" in told["line"]
        assert told["stays"]
        assert swing(line)["outcome"] == "caught"
        assert "this try (caught) could not be kept" in line.latest["error"]["line"]


MALICE = (
    {"type": "hand", "held": True, "samples": [[0, 0, 0, 0], [6e6, 0, 0, 0], [0, 0, 0, 0]]},
    {"type": "hand", "held": True, "samples": [[240 * k, 0, 0, 0] for k in range(999)] + [[0, 0, 0, 0]]},
    {"type": "ease", "gravity": 0.5, "rope": 1, "cup": 1},
)


def test_whatever_one_page_says_again_and_again_others_play_on_and_ctrl_c_ends_it(games):
    game = games()

    def shout(message, over):
        with game.line("mallory") as bad, contextlib.suppress(ConnectionClosed):
            while not over.is_set():
                bad.say(**message)

    for number, message in enumerate(MALICE):
        over = threading.Event()
        thread = threading.Thread(target=shout, args=(message, over))
        thread.start()
        with game.line(f"nina-{number}") as line:
            assert swing(line, until=60)["phase"] == "playing"
        if number == len(MALICE) - 1:
            assert game.end() == 0
        over.set()
        thread.join()


def test_a_folder_that_cannot_hold_tries_is_told_before_the_first_swing(games, tmp_path):
    (tmp_path / "plays").write_text("in the way")
    refused = games()
    assert refused.process.wait(timeout=30) == 2
    refused._reader.join(timeout=5)
    assert len(refused.said) == 1
    assert "tries cannot be kept in" in refused.said[0]
    assert "set play.folder" in refused.said[0]


def test_a_classroom_is_told_what_is_opened_and_more_players_than_the_machine_bears(games):
    game = games("--host", "0.0.0.0", "play.max_players=1")
    with game.line("gina") as first, game.line("hans") as line:
        assert "1 play already" in line.goodbye()[1]
        first.hear("table")
    assert "0.0.0.0" not in game.address
    assert game.end() == 0
    assert "open to the network, unencrypted: whoever can reach port" in game.said[0]
    assert game.said[-1] == "ended; 'kendama run capture=play' goes on with what was kept"


def test_a_taken_port_and_a_wrong_address_are_told_in_a_line(game, games):
    for options, words in (
        (["--port", game.place.partition(":")[2]], "choose another --port, or 0 for a free one"),
        (["--host", "no.such.host.invalid"], "cannot listen on no.such.host.invalid:0"),
    ):
        refused = games(*options)
        assert refused.process.wait(timeout=30) == 2
        refused._reader.join(timeout=5)
        assert words in refused.said[-1]
        assert len(refused.said) == 1
