"""A twin as a child process: started, connected to, and ended; and run as that process.

The process reads two lines from standard input, its secret in hexadecimal and its settings as JSON, writes one JSON
line with its address to standard output, and ends when standard input closes: whoever started it need only die to end
it. The secret is neither an argument nor in the environment, where other users could read it.
"""

from __future__ import annotations

import dataclasses
import json
import os
import secrets
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from typing import IO, Any

from kendama_cli.devices.robot.task import Task
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.seal import KEY_BYTES
from kendama_cli.devices.robot.udp.twin import serve_twin
from kendama_cli.errors import HardwareError, KendamaError
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.interact import InteractionTask
from kendama_cli.settings.robot import RobotSettings

_START_S = 60.0
"""A twin that has not opened its line by then never will."""
_END_S = 5.0


@contextmanager
def open_twin(hardware: TwinHardware, robot: RobotSettings, task: Task) -> Iterator[UdpRobot]:
    """Start a twin in a process of its own, which ends with this context; raises HardwareError if it does not start."""
    with _twin_process(hardware, robot, task) as process:
        client = UdpRobot(
            *process.address, process.secret, silence_s=hardware.silence_s, exit_reason=process.exit_reason
        )
        with closing(client):
            yield client


class _Twin:
    """A running twin process."""

    def __init__(self, process: subprocess.Popen[bytes], errors: IO[bytes]) -> None:
        self.address = ("", 0)
        self.secret = secrets.token_bytes(KEY_BYTES)
        self._process = process
        self._errors = errors

    def start(self, document: str) -> None:
        """Hand over key and settings and learn the address; raises HardwareError where no address comes."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        give_up = threading.Timer(_START_S, process.kill)
        give_up.start()
        try:
            process.stdin.write(f"{self.secret.hex()}\n{document}\n".encode())
            process.stdin.flush()
            line = process.stdout.readline()
        except BrokenPipeError:
            line = b""
        finally:
            give_up.cancel()
        if not line:
            raise HardwareError(f"the twin did not start: {self.exit_reason() or 'it closed its output'}")
        ready = json.loads(line)
        self.address = (ready["host"], ready["port"])

    def end(self) -> None:
        """Close its input, by which it ends; kill it where it does not."""
        process = self._process
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(BrokenPipeError):
                    pipe.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def exit_reason(self) -> str | None:
        """Return the reason why the process ended, or None while it lives."""
        try:
            code = self._process.wait(timeout=0.05)
        except subprocess.TimeoutExpired:
            return None
        how = f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
        self._errors.seek(0)
        said = self._errors.read()[-2000:].decode(errors="replace").strip().splitlines()
        return f"the twin's process {how}" + (f": {said[-1]}" if said else "")


@contextmanager
def _twin_process(hardware: TwinHardware, robot: RobotSettings, task: Task) -> Iterator[_Twin]:
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "kendama_cli.devices.robot.udp.twin_client"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            start_new_session=True,  # Ctrl-C is ours to handle; the twin ends when its input closes
        )
        twin = _Twin(process, errors)
        try:
            twin.start(settings_document(robot, task, hardware))
            yield twin
        finally:
            twin.end()


def settings_document(robot: RobotSettings, task: Task, hardware: TwinHardware) -> str:
    """Return the one JSON line with the simulation of a twin process."""
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
    while os.read(sys.stdin.fileno(), 4096):  # not the buffered reader: its lock would keep the process from ending
        pass
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
