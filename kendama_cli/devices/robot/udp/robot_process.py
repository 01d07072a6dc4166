"""A simulated robot as a child process: started, connected to, and ended; and run as that process.

The process reads two lines from standard input, its secret in hexadecimal and its settings as JSON, writes one JSON
line with its address to standard output, and ends when standard input closes: whoever started it need only die to end
it. The secret is neither an argument nor in the environment, where other users could read it.
"""

from __future__ import annotations

import json
import os
import secrets
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from typing import IO, Any, Protocol

from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.seal import KEY_BYTES
from kendama_cli.errors import HardwareError, KendamaError

_START_S = 60.0
"""A process that has not opened its line by then never will."""
_END_S = 5.0


class Serve(Protocol):
    """Serve the robot of a document (see ``robot_process``) as ``serve_robot`` does."""

    def __call__(
        self,
        document: Mapping[str, Any],
        secret: bytes,
        *,
        on_ready: Callable[[Mapping[str, Any]], None],
        keep_going: Callable[[], bool],
    ) -> None:
        """Return when ``keep_going()`` is false; raises KendamaError, or KeyError of a document that lacks a part."""


@contextmanager
def robot_process(name: str, module: str, document: str, *, silence_s: float) -> Iterator[UdpRobot]:
    """Start ``module`` as a process that serves a robot, which ends with this context, and connect to it.

    ``name`` names the robot in messages, ``document`` is the one JSON line with its settings. Raises HardwareError if
    it does not start.
    """
    with _process(name, module, document) as process:
        client = UdpRobot(*process.address, process.secret, silence_s=silence_s, exit_reason=process.exit_reason)
        with closing(client):
            yield client


class _RobotProcess:
    """A running process of a robot."""

    def __init__(self, name: str, process: subprocess.Popen[bytes], errors: IO[bytes]) -> None:
        self.address = ("", 0)
        self.secret = secrets.token_bytes(KEY_BYTES)
        self._name = name
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
            raise HardwareError(f"{self._name} did not start: {self.exit_reason() or 'it closed its output'}")
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
        return f"{self._name}'s process {how}" + (f": {said[-1]}" if said else "")


@contextmanager
def _process(name: str, module: str, document: str) -> Iterator[_RobotProcess]:
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            start_new_session=True,  # Ctrl-C is ours to handle; the process ends when its input closes
        )
        robot = _RobotProcess(name, process, errors)
        try:
            robot.start(document)
            yield robot
        finally:
            robot.end()


def serve_input(name: str, serve: Serve) -> int:
    """Serve what standard input asks for, as such a process; returns the exit code."""
    parent = os.getppid()
    try:
        secret = bytes.fromhex(sys.stdin.readline())
        document = json.loads(sys.stdin.readline())
        threading.Thread(target=_end_with_input, daemon=True).start()
        serve(document, secret, on_ready=_announce, keep_going=lambda: os.getppid() == parent)
    except KendamaError as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    except (ValueError, KeyError) as error:
        sys.stderr.write(f"{name}'s process needs secret and settings, a line each, on standard input: {error}\n")
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
