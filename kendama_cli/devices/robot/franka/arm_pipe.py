"""The pipe to the process that moves an arm, and that process."""

from __future__ import annotations

import socket
import subprocess
import sys
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from kendama_cli.devices.robot.franka.messages import Done, Failure, Message, Stands, decode, encode
from kendama_cli.errors import HardwareError
from kendama_cli.settings.hardware import FrankaHardware

Heard = TypeVar("Heard", Stands, Done)
BRAKING_S = 2.0
"""The process gets so long to brake the arm, once nobody commands any more."""


class ArmPipe:
    """Starts the process and speaks with it; the first failure stays, and is what every later call raises."""

    def __init__(self, hardware: FrankaHardware) -> None:
        self._host = hardware.host
        self._failure: str | None = None
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-m", "kendama_cli.devices.robot.franka.process", str(theirs.fileno())]
        self.process = subprocess.Popen(command, pass_fds=[theirs.fileno()])
        theirs.close()
        self._pipe: Connection[Any, Any] = Connection(ours.detach())

    def fail(self, problem: str) -> HardwareError:
        """Keep the first problem; the error to raise."""
        self._failure = self._failure or problem
        return HardwareError(self._failure)

    def send(self, said: Message) -> None:
        """Say it; raises HardwareError."""
        if self._failure is not None:
            raise HardwareError(self._failure)
        try:
            self._pipe.send_bytes(encode(said))
        except OSError:
            raise self.fail(self._last_words()) from None

    def hear(self, kind: type[Heard], wait_s: float) -> Heard:
        """What comes back; raises HardwareError where that is a failure, another kind, or nothing."""
        try:
            if not self._pipe.poll(wait_s):
                raise self.fail(f"the arm at {self._host} said nothing for {wait_s:g} s")
            heard = decode(self._pipe.recv_bytes())
        except (EOFError, OSError):
            raise self.fail(self._last_words()) from None
        except HardwareError as error:
            raise self.fail(str(error)) from None
        if isinstance(heard, Failure):
            raise self.fail(heard.problem)
        if not isinstance(heard, kind):
            raise self.fail(f"the process that moves the arm said {type(heard).__name__} out of turn")
        return heard

    def close(self) -> None:
        """Let go: the process brakes the arm and ends."""
        self._pipe.close()
        self._ended()

    def _last_words(self) -> str:
        """What the process said before it ended, or how it did."""
        try:
            while self._pipe.poll(0):
                if isinstance(heard := decode(self._pipe.recv_bytes()), Failure):
                    return heard.problem
        except (EOFError, OSError, HardwareError):
            pass
        return f"the process that moves the arm ended with {self._ended()}"

    def _ended(self) -> int:
        """Wait until the process has braked the arm and ended, kill it where it does not; its exit code."""
        try:
            return self.process.wait(BRAKING_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()
