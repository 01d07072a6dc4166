"""A person at a haptic device, as a process: a hand's impedance follows a planned swing, and gives to what it feels.

``python -m tests.devices.hand.haptic.operator_model SCALE [FAULT]`` prints its port. The hand is a mass of 1 kg on a
spring of 400 N/m and a damper of 30 Ns/m about the plan; FAULT is nan, jump, frozen, silence or leave, half a second
into it. Places are sent in mm, as OpenIGTLink has them.
"""

from __future__ import annotations

import socket
import sys
import time

import numpy as np

from kendama_cli.devices.hand.haptic.haptic_line import HapticLine
from kendama_cli.devices.hand.openigtlink import TRANSFORM, string, transform
from tests.devices.hand.play.table_top import swing

MASS_KG, STIFFNESS_N_M, DAMPING_N_S_M, PERIOD_S, WAIT_S = 1.0, 400.0, 30.0, 0.001, 0.5


class Operator:
    """A hand that follows the plan; ``place`` (3,) is the stylus'."""

    def __init__(self, scale: float) -> None:
        self.t_s, places = swing()
        self._plan, self.place, self._speed, self._steps = places / scale, np.zeros(3), np.zeros(3), 0

    def step(self, force: np.ndarray) -> None:
        """A millisecond under the force that it feels; the plan's own speed and acceleration are fed forward."""
        at_s = self._steps * PERIOD_S - WAIT_S
        before, now, after = (
            np.array([np.interp(at_s + h, self.t_s, column) for column in self._plan.T]) for h in (-0.01, 0, 0.01)
        )
        asked = STIFFNESS_N_M * (now - self.place[[0, 2]]) + DAMPING_N_S_M * ((after - before) / 0.02)
        pull = force - DAMPING_N_S_M * self._speed
        pull[[0, 2]] += asked + MASS_KG * (after - 2 * now + before) / 0.01**2
        pull[1] -= STIFFNESS_N_M * self.place[1]
        self._speed = self._speed + pull / MASS_KG * PERIOD_S
        self.place = self.place + self._speed * PERIOD_S
        self._steps += 1


def operate(line: HapticLine, scale: float, fault: str) -> None:
    """Grip, swing, and let go."""
    person, force, steps = Operator(scale), np.zeros(3), 0
    began = time.perf_counter()
    while (now_s := time.perf_counter() - began) < person.t_s[-1] + 1.5:
        for message in line.receive():
            if message.kind == "TRANSFORM" and message.device == "Stylus-force":
                force = np.array(TRANSFORM.unpack(message.content)[9:])
        while steps * PERIOD_S < now_s:
            person.step(force.copy())
            steps += 1
        faulty = now_s > 0.5
        if faulty and fault == "silence":
            time.sleep(1)
        if faulty and fault == "leave":
            return
        while faulty and fault == "frozen":
            line.send(transform("Stylus", tuple((1e3 * person.place).tolist())))
            time.sleep(PERIOD_S)
        jump_m = float(faulty and fault == "jump" and steps % 2)  # there and back: after a stall one alone is a motion
        said = person.place * np.nan if faulty and fault == "nan" else person.place + jump_m
        line.send(transform("Stylus", tuple((1e3 * said).tolist())) + string("Stylus-grip", "1"))
        time.sleep(PERIOD_S / 2)
    line.send(string("Stylus-grip", "0"))
    time.sleep(0.5)


def main() -> None:
    """Serve one client."""
    scale, fault = float(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else ""
    with socket.create_server(("127.0.0.1", 0)) as server:
        print(server.getsockname()[1], flush=True)
        connected, _ = server.accept()
        with connected:
            operate(HapticLine(connected), scale, fault)


if __name__ == "__main__":
    main()
