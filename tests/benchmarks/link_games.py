"""Games of the PA10 through a camera on its forearm, beside fixed cameras, and without the link's pose.

    python -m tests.benchmarks.link_games FOLDER [fixed|one|both|unplaced] [FIRST LAST]

`fixed` has the stereo pair, `one` its left camera and one on the forearm, `both` two on the forearm 0.15 m apart. In
`unplaced`, the null model, the tracker holds the camera of `one` where the arm's home has it. A game is a line of
FOLDER/CAMERAS.jsonl, and is not played again; then the rates, and the median errors of the predicted catch, are
printed. The swing-ups are those of four tables (seeds 32000 to 32003), on the nominal arm.
"""

from __future__ import annotations

import dataclasses
import json
import pickle
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.control.camera_observer import CameraObserver
from kendama_cli.learning.decision import GreedyPolicy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.stages.learn.stage import Learn
from tests.control.arm_games import arm_games, nodes
from tests.memory_context import MemoryContext

AHEAD_S = (0.1, 0.2)


def policies(folder: Path) -> list[PolicyArtifact]:
    """Learn four tables, or read those of before."""
    file = folder / "policies.pickle"
    if not file.exists():
        node = nodes(folder / "home")
        learn = Learn(learn=node["learn"], game=node["game"])
        file.write_bytes(pickle.dumps([learn.run({}, MemoryContext(seed)).artifact for seed in range(32000, 32004)]))
    return cast(list[PolicyArtifact], pickle.loads(file.read_bytes()))


def seen_by(cameras: str, folder: Path) -> dict[str, Any]:
    """Return the settings with these cameras."""
    node = nodes(folder / "home", *([] if cameras == "fixed" else ["camera/rig=elbow"]))
    if cameras == "both":
        forearm = node["camera"].cameras[1]
        beside = dataclasses.replace(forearm, name="forearm_left", position_m=(-0.15, -0.15, 0.0))
        node["camera"] = dataclasses.replace(node["camera"], cameras=(beside, forearm))
    return node


def play(cameras: str, folder: Path, first: int, last: int) -> list[dict[str, Any]]:
    """Play the games of seeds ``first`` to ``last`` that the file lacks; return all of them."""
    tables, node, file = policies(folder), seen_by(cameras, folder), folder / f"{cameras}.jsonl"
    games = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    with arm_games(node, nominal=True) as runner:
        if cameras == "unplaced":
            arm, observer = RobotModel(node["robot"], node["game"].cup, 9.81), cast(CameraObserver, runner.observer)
            home = arm.link_pose("link_e2", arm.home_rad)
            observer.loop._placed = lambda model, _: model.carried(home.rotation, home.position_m - observer._origin_m)
        for seed in sorted(set(range(first, last)) - {game["seed"] for game in games}):
            game = runner.play(GreedyPolicy(tables[seed % 4], node["learn"]), seed=seed)
            errors = [game.prediction_error_m(ahead_s) for ahead_s in AHEAD_S]
            games.append({"seed": seed, "caught": game.caught, "outcome": game.outcome, "errors_m": errors})
            with file.open("a") as stream:
                stream.write(json.dumps(games[-1]) + "\n")
    return games


def main() -> None:
    """Play and print."""
    folder, chosen = Path(sys.argv[1]), sys.argv[2]
    folder.mkdir(exist_ok=True)
    first, last = (int(word) for word in sys.argv[3:5]) if len(sys.argv) > 3 else (32000, 32020)
    games = play(chosen, folder, first, last)
    caught, count = sum(game["caught"] for game in games), len(games)
    rate = success_interval(caught, count)
    errors = np.array([game["errors_m"] for game in games], dtype=float)
    medians = " ".join(
        f"{ahead_s:g} s before {1e3 * np.nanmedian(column):.2f} mm of {np.isfinite(column).sum()}"
        for ahead_s, column in zip(AHEAD_S, errors.T, strict=True)
    )
    print(f"{chosen}: caught {caught} of {count} [{rate.low:.2f}, {rate.high:.2f}]; {medians}")


if __name__ == "__main__":
    main()
