"""A controller without a robot: is where it was commanded to be a period ago.

python stand_in.py KEY_FILE PORT [WATCHDOG_S]
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import replace

from kendama_robot import Description, Heard, Robot, State, read_key

PERIOD_S = 0.004
SPEED, BRAKING = 1.0, 20.0
"""How fast it goes to where a RESET wants it [rad/s], and how it slows down where no command comes [rad/s^2]."""


def main(key_file: str, port: int, watchdog_s: float = 0.25) -> None:
    limits = ((-3.0,) * 7, (3.0,) * 7, (2.0,) * 7, (20.0,) * 7, (50.0,) * 7)
    names = ("s1", "s2", "s3", "e1", "e2", "w1", "w2")
    line = Robot(port, read_key(key_file), Description(names, limits, PERIOD_S, watchdog_s))
    at = target = (0.0,) * 7
    speed, heard, t_s = (0.0,) * 7, Heard.NOTHING, 0.0
    print("listening", flush=True)
    due_s = time.monotonic()
    while True:
        due_s += PERIOD_S
        while (left_s := due_s - time.monotonic()) > 0:  # the newest of what comes within the period counts
            now = line.poll(left_s)
            heard = now if now is not Heard.NOTHING else heard
        was = at
        if line.reason is not None or heard not in (Heard.RESET, Heard.COMMAND):  # no command: brake within the limits
            heard, t_s = Heard.NOTHING, t_s + PERIOD_S
            speed = tuple(math.copysign(max(abs(one) - BRAKING * PERIOD_S, 0.0), one) for one in speed)
            at = tuple(a + one * PERIOD_S for a, one in zip(at, speed, strict=True))
        elif heard is Heard.RESET:
            target, speed, t_s = line.command.position_rad, (0.0,) * 7, 0.0
            at = tuple(
                a + max(-SPEED * PERIOD_S, min(SPEED * PERIOD_S, b - a)) for a, b in zip(at, target, strict=True)
            )
        else:
            at, speed, t_s = line.command.position_rad, line.command.velocity_rad_s, t_s + PERIOD_S
        moved = tuple((a - b) / PERIOD_S for a, b in zip(at, was, strict=True))
        if heard is Heard.COMMAND or (heard is Heard.RESET and at == target):
            sent = replace(line.command, effort_nm=())  # it adds no effort
            line.answer(State(t_s, sent, at, moved, (0.0,) * 7))
            heard = Heard.NOTHING


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), *map(float, sys.argv[3:]))
