"""A twin as a child process: ``python -m kendama_cli.devices.robot.udp.twin_process``.

The process reads two lines from standard input, its secret in hexadecimal and its settings as JSON, writes one JSON
line with its address to standard output, and ends when standard input closes: whoever started it need only die to end
it. The secret is neither an argument nor in the environment, where other users could read it.
"""

from __future__ import annotations

import dataclasses
import json
import os
import sys
import threading
from collections.abc import Mapping
from typing import Any

from kendama_cli.devices.robot.task import Task
from kendama_cli.devices.robot.udp.twin import serve_twin
from kendama_cli.errors import KendamaError
from kendama_cli.motion.task_settings import InteractionTask
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.robot import RobotSettings


def settings_document(robot: RobotSettings, task: Task, hardware: TwinHardware) -> str:
    """The one JSON line that says what a twin process simulates."""
    kind = "interaction" if isinstance(task, InteractionTask) else "game"
    parts: dict[str, Any] = {"robot": robot, kind: task, "hardware": hardware}
    return json.dumps({name: dataclasses.asdict(part) for name, part in parts.items()})


def main() -> int:
    """Serve what standard input asks for; returns the exit code."""
    parent = os.getppid()
    try:
        secret = bytes.fromhex(sys.stdin.readline())
        document = json.loads(sys.stdin.readline())
        robot = build_value(RobotSettings, document["robot"], "robot")
        task: Task
        if "interaction" in document:
            task = build_value(InteractionTask, document["interaction"], "interaction")
        else:
            task = build_value(GameSettings, document["game"], "game")
        hardware = build_value(TwinHardware, document["hardware"], "hardware")
        threading.Thread(target=_end_with_input, daemon=True).start()
        serve_twin(robot, task, hardware, secret, on_ready=_announce, keep_going=lambda: os.getppid() == parent)
    except KendamaError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    except (ValueError, KeyError) as error:
        sys.stderr.write(f"the twin process needs secret and settings, a line each, on standard input: {error}\n")
        return 2
    return 0


def _announce(ready: Mapping[str, Any]) -> None:
    sys.stdout.write(json.dumps(dict(ready)) + "\n")
    sys.stdout.flush()


def _end_with_input() -> None:
    """Wait for the end of standard input, which comes even when the parent was killed, and end at once."""
    while os.read(sys.stdin.fileno(), 4096):  # not the buffered reader: its lock would bar the way out of the process
        pass
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
