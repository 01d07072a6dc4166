"""The arm's end of the pipe, in a process of its own: ``python -m kendama_cli.devices.robot.franka.process FD``.

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
from typing import Any

from kendama_cli.devices.robot.franka.control_loop import CYCLE_S, ControlLoop, Done, Wanted
from kendama_cli.devices.robot.franka.rate_limit import RateLimits
from kendama_cli.errors import HardwareError
from kendama_cli.settings.hardware import FrankaHardware

LIBRARY = "pylibfranka"
RECOVER = "recover"
"""What the pipe says beside commands; every failure comes back as text, and is the last that is said."""


def main() -> int:
    """Serve the pipe whose file descriptor is the argument; returns the exit code."""
    pipe: Connection[Any, Any] = Connection(int(sys.argv[1]))
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        settings, limits = pipe.recv()
        try:
            _serve(pipe, settings, limits)
        except HardwareError as error:
            pipe.send(str(error))
    return 0


def _serve(pipe: Connection[Any, Any], settings: FrankaHardware, limits: RateLimits) -> None:
    fci: Any = importlib.import_module(LIBRARY)
    errors = tuple(one for one in vars(fci).values() if isinstance(one, type) and issubclass(one, Exception))
    try:
        robot = fci.Robot(settings.host, getattr(fci.RealtimeConfig, f"k{settings.realtime.capitalize()}"))
        _set_collisions(robot, settings)
        pipe.send(list(robot.read_once().q))
        cycles = round(settings.control_period_s / CYCLE_S)
        loop = ControlLoop(limits, cycles, _listener(pipe), _teller(pipe), fci.JointPositions)
        gc.disable()
        while True:
            said = pipe.recv()
            if said == RECOVER:
                robot.automatic_error_recovery()
                pipe.send(list(robot.read_once().q))
                continue
            _require_idle(robot, settings)
            active = robot.start_joint_position_control(fci.ControllerMode.JointImpedance)
            loop.run(active, said, settings.reply_s)
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
                said: Wanted = pipe.recv()
                return said
        return None

    return next_command


def _teller(pipe: Connection[Any, Any]) -> Callable[[Done], None]:
    def tell(done: Done) -> None:
        with contextlib.suppress(OSError):
            pipe.send(done)

    return tell


def failure(host: str, told: str) -> str:
    """One line for what the library tells in several: the names of the errors where it has some."""
    names = re.findall(r"\w+(?:_\w+)+", " ".join(re.findall(r"\[(.*?)\]", told)))
    what = f"a reflex stopped it ({', '.join(dict.fromkeys(names))})" if names else " ".join(told.split())
    again = "look why, then 'kendama robot recover hardware=franka --arm', and run again"
    return f"the arm at {host}: {what.removeprefix('libfranka: ')}; {again}"


if __name__ == "__main__":
    sys.exit(main())
