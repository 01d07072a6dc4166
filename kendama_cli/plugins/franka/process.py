"""The arm's end of the pipe, in a process of its own: ``python -m kendama_cli.plugins.franka.process FD``.

The library holds the interpreter while it waits for the arm, and one millisecond leaves no room for somebody else's
work: so nothing but the loop runs here. The process ends when the pipe does, whatever became of whoever started it.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import re
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

import numpy as np

from kendama_cli.errors import HardwareError
from kendama_cli.plugins.franka.control_loop import CYCLE_S, ControlLoop
from kendama_cli.plugins.franka.messages import (
    Begin,
    Done,
    Failure,
    Message,
    Recover,
    Stands,
    Wanted,
    decode,
    encode,
)
from kendama_cli.plugins.franka.rate_limit import RateLimits
from kendama_cli.plugins.franka.settings import FrankaHardware

LIBRARY = "pylibfranka"
Heard = TypeVar("Heard", Begin, Wanted)


def main() -> int:
    """Serve the pipe whose file descriptor is the argument; returns the exit code."""
    pipe: Connection[Any, Any] = Connection(int(sys.argv[1]))
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        try:
            begin = _only(Begin, decode(pipe.recv_bytes()))
            _serve(pipe, begin.hardware, begin.limits)
        except HardwareError as error:
            _say(pipe, Failure(str(error)))
    return 0


def _serve(pipe: Connection[Any, Any], settings: FrankaHardware, limits: RateLimits) -> None:
    fci: Any = importlib.import_module(LIBRARY)
    errors = tuple(one for one in vars(fci).values() if isinstance(one, type) and issubclass(one, Exception))
    try:
        robot = fci.Robot(settings.host, getattr(fci.RealtimeConfig, f"k{settings.realtime.capitalize()}"))
        _set_collisions(robot, settings)
        _say(pipe, Stands(np.array(robot.read_once().q)))
        cycles = round(settings.control_period_s / CYCLE_S)
        loop = ControlLoop(limits, cycles, _listener(pipe), _teller(pipe), fci.JointPositions)
        gc.disable()
        while True:
            said = decode(pipe.recv_bytes())
            if isinstance(said, Recover):
                robot.automatic_error_recovery()
                _say(pipe, Stands(np.array(robot.read_once().q)))
                continue
            _require_idle(robot, settings)
            active = robot.start_joint_position_control(fci.ControllerMode.JointImpedance)
            loop.run(active, _only(Wanted, said), settings.reply_s)
    except HardwareError:
        raise
    except errors as error:
        raise HardwareError(failure(settings.host, str(error))) from None


def _set_collisions(robot: Any, settings: FrankaHardware) -> None:
    torques, forces = [settings.collision_nm] * 7, [settings.collision_n] * 6
    robot.set_collision_behavior(torques, torques, forces, forces)


def _require_idle(robot: Any, settings: FrankaHardware) -> None:
    """Raise HardwareError where the arm would not move now."""
    state = robot.read_once()
    mode = state.robot_mode.name
    if mode != "Idle":
        raise HardwareError(failure(settings.host, f"its mode is {mode}, {state.last_motion_errors}"))


def _listener(pipe: Connection[Any, Any]) -> Callable[[float], Wanted | None]:
    def next_command(wait_s: float) -> Wanted | None:
        with contextlib.suppress(EOFError, OSError):  # whoever commands has gone: the arm brakes
            if pipe.poll(wait_s):
                return _only(Wanted, decode(pipe.recv_bytes()))
        return None

    return next_command


def _teller(pipe: Connection[Any, Any]) -> Callable[[Done], None]:
    def tell(done: Done) -> None:
        with contextlib.suppress(OSError):
            _say(pipe, done)

    return tell


def _only(kind: type[Heard], said: Message) -> Heard:
    """Return the message; raises HardwareError if it is of another kind."""
    if not isinstance(said, kind):
        raise HardwareError(f"the process that moves the arm was told {type(said).__name__} out of turn")
    return said


def _say(pipe: Connection[Any, Any], message: Message) -> None:
    pipe.send_bytes(encode(message))


def failure(host: str, told: str) -> str:
    """Return one line for an error of the library in several: the names of the errors, if it has some."""
    names = re.findall(r"\w+(?:_\w+)+", " ".join(re.findall(r"\[(.*?)\]", told)))
    what = f"a reflex stopped it ({', '.join(dict.fromkeys(names))})" if names else " ".join(told.split())
    again = "look why, then 'kendama robot recover hardware=franka --arm', and run again"
    return f"the arm at {host}: {what.removeprefix('libfranka: ')}; {again}"


if __name__ == "__main__":
    sys.exit(main())
