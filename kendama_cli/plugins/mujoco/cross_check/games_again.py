"""``kendama cross-check``: what another physics says of the games of a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.cli import render
from kendama_cli.errors import StageError, UsageError
from kendama_cli.log.messages import ReplayMessage
from kendama_cli.log.reader import LogFile, logged_settings
from kendama_cli.log.writer import McapLog, MemoryFile
from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import SLACK_S, SampledBody
from kendama_cli.pipeline.artifact_place import LOG
from kendama_cli.pipeline.record import find_run
from kendama_cli.pipeline.report import section_log
from kendama_cli.plugins.mujoco.cross_check.chain import CHAIN_KG, Variation
from kendama_cli.plugins.mujoco.cross_check.cup_track import CupTrack, swing_slack_s
from kendama_cli.plugins.mujoco.cross_check.messages import TOPICS, RefereeMessage
from kendama_cli.plugins.mujoco.cross_check.replay import replay
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.store import durable

ENDING = "/replay"
"""Topics that end so hold games that can be played again."""


@dataclass(frozen=True)
class LoggedGame:
    """One game of a run's log: the stage that played it, the game's settings there, and its replay."""

    stage: str
    settings: GameSettings
    replay: ReplayMessage


def referee(home: Path, run: str | None, variation: Variation, *, as_json: bool) -> None:
    """Play every logged game of a run again, show what came of it, and write a log beside the run.

    Raises UsageError where the run has no such games, MissingPartError without MuJoCo.
    """
    record = find_run(home, run)
    mujoco()
    games = list(logged_games(record))
    if not games:
        raise UsageError(
            f"run {record['run']} logs no game that could be played again; adapt's repeats and transfer's games can: "
            "'kendama run -p imitation' makes some"
        )
    seen = []
    for number, game in enumerate(games):
        seen.append(played_again(game, variation))
        render.note(f"referee: {number + 1}/{len(games)}, {_words(seen[-1])}")
    document = summary(seen)
    path = section_log(record, "referee")
    durable.make_folder(path.parent)
    write_log(path, seen, games[0].settings, document)
    if as_json:
        render.document(document)
        return
    rows = [
        [str(one[name]) if name == "stage" else render.figure(one[name]) for name in one] for one in document["games"]
    ]
    render.table(rows, head=list(document["games"][0]))
    render.prose(render.figures({name: value for name, value in document.items() if name != "games"}))


def logged_games(record: Mapping[str, Any]) -> Iterator[LoggedGame]:
    """Yield the games in the logs of a run's stages, in order."""
    for stage in record["stages"]:
        if stage["artifact"] is None:
            continue
        path = Path(stage["artifact"]) / LOG
        log = LogFile(path)
        settings = log.stage.get("settings", {}).get("game")
        for topic in log.topics:
            if topic.endswith(ENDING) and settings is not None:
                game = logged_settings(GameSettings, settings, "game", path)
                yield from (LoggedGame(stage["name"], game, one) for one in log.messages(topic, ReplayMessage).messages)


def played_again(game: LoggedGame, variation: Variation = Variation()) -> RefereeMessage:
    """Play one game again under the second physics, with what ``variation`` changes, beside our own."""
    one = game.replay
    rope_kg = variation.rope_kg or one.rope_kg or CHAIN_KG
    restitution = one.restitution if variation.restitution is None else variation.restitution
    t_s, cup_m, axis, ball_m = (np.array(list(value)) for value in (one.t_s, one.cup_m, one.cup_axis, one.ball_m))
    places, axes, balls = (value.reshape(-1, 3) for value in (cup_m, axis, ball_m))
    body = SampledBody(one.rope_m, one.ball_kg, (one.drag_n_s_m, one.drag_n_s2_m2), restitution, rope_kg)
    track = CupTrack(t_s, places, axes)
    met_s = _met_s(game.settings, track, balls, one.since_s) if variation.rigid else None
    seen = replay(
        game.settings,
        body,
        track if met_s is None else track.rigid(met_s),
        balls[0],
        one.since_s,
        surface=variation.surface,
        spin_hz=variation.spin_hz,
    )
    slack_s = swing_slack_s(game.settings, one.rope_m, track, balls, one.since_s)
    return RefereeMessage(
        stage=game.stage,
        index=one.index,
        ours_caught=one.caught,
        referee_caught=seen.caught,
        ours_miss_m=one.miss_m,
        referee_miss_m=float("nan") if seen.miss_m is None else seen.miss_m,
        swing_slack_s=slack_s,
        slack_in_swing=slack_s >= SLACK_S,
        rope_m=one.rope_m,
        t_s=t_s,
        cup_m=cup_m,
        cup_axis=axis,
        ours_m=ball_m,
        referee_m=columns_at(t_s - t_s[0], seen.t_s, seen.ball_m).ravel(),
    )


def _met_s(game: GameSettings, track: CupTrack, ball_m: Array, since_s: float) -> float | None:
    """Return when the ball (n, 3) first comes down to the rim after ``since_s``; None where it never does."""
    over_m = (ball_m - track.place_m)[:, 2] - game.cup.rim_m - game.ball.radius_m
    down = np.flatnonzero((over_m[:-1] > 0.0) & (over_m[1:] <= 0.0) & (track.t_s[1:] >= since_s))
    return float(track.t_s[down[0]]) if len(down) else None


def summary(seen: list[RefereeMessage]) -> dict[str, Any]:
    """Return the output of ``--json``; games whose rope hung slack in the swing are apart: there its mass decides."""
    games = [
        {
            "stage": one.stage,
            "index": one.index,
            "ours_miss_mm": _mm(one.ours_miss_m),
            "referee_miss_mm": _mm(one.referee_miss_m),
            "ours_caught": one.ours_caught,
            "referee_caught": one.referee_caught,
            "swing_slack_ms": 1e3 * one.swing_slack_s,
        }
        for one in seen
    ]
    return {
        "games": games,
        "caught_rate": sum(one.referee_caught for one in seen) / len(seen),
        "agreement_mm_p50": _agreement_mm([one for one in seen if not one.slack_in_swing]),
        "agreement_slack_mm_p50": _agreement_mm([one for one in seen if one.slack_in_swing]),
    }


def _agreement_mm(seen: list[RefereeMessage]) -> float | None:
    apart = [1e3 * abs(one.ours_miss_m - one.referee_miss_m) for one in seen]
    known = [value for value in apart if np.isfinite(value)]
    return float(np.median(known)) if known else None


def write_log(path: Path, seen: list[RefereeMessage], settings: GameSettings, document: Mapping[str, Any]) -> None:
    """Write the log beside the run, from which the report makes its section."""
    log = McapLog(TOPICS, MemoryFile())
    for number, one in enumerate(seen):
        log.write("/referee/game", float(number), one)
    caught = sum(one.referee_caught for one in seen)
    interval = success_interval(caught, len(seen))
    metrics = {
        "caught_rate": document["caught_rate"],
        "caught_rate_low": interval.low,
        "caught_rate_high": interval.high,
        "ours_caught_rate": sum(one.ours_caught for one in seen) / len(seen),
        "same_outcome_rate": sum(one.ours_caught == one.referee_caught for one in seen) / len(seen),
        "agreement_mm_p50": document["agreement_mm_p50"],
        "agreement_slack_mm_p50": document["agreement_slack_mm_p50"],
        "slack_in_swing": sum(one.slack_in_swing for one in seen),
        "games": len(seen),
    }
    whole = path.with_suffix(".tmp")
    try:
        log.finish(whole, stage="referee", settings={"game": dataclasses.asdict(settings)}, metrics=metrics)
        durable.write_file(path, whole.read_bytes())
    except OSError as error:
        raise StageError(f"the referee's log cannot be written to {path}: {error.strerror or error}") from None
    finally:
        whole.unlink(missing_ok=True)


def _mm(miss_m: float) -> float | None:
    return 1e3 * miss_m if np.isfinite(miss_m) else None


def _words(one: RefereeMessage) -> str:
    outcome = "caught" if one.referee_caught else "missed"
    ours = "as in ours" if one.referee_caught == one.ours_caught else "other than in ours"
    return f"{one.stage} {one.index} {outcome}, {ours}"
