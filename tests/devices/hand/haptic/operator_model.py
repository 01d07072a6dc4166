"""A person at a haptic device, as a process: a hand's impedance follows a planned swing, and gives to what it feels.

``python -m tests.devices.hand.haptic.operator_model SCALE [FAULT]`` prints its port. The hand is a mass of 1 kg on a
spring of 400 N/m and a damper of 30 Ns/m about the plan; FAULT is nan, jump, silence or leave, half a second into it.
"""

from __future__ import annotations

import socket
import sys
import time

import numpy as np

from kendama_cli.devices.hand.haptic.igtl import MATRIX, IgtlLine, string, transform
from tests.devices.hand.play.table_top import swing

MASS_KG, STIFFNESS_N_M, DAMPING_N_S_M, PERIOD_S, WAIT_S = 1.0, 400.0, 30.0, 0.001, 0.5


def operate(line: IgtlLine, scale: float, fault: str) -> None:
    """Grip, swing, and let go."""
    t_s, places = swing()
    place, speed, force = np.zeros(3), np.zeros(3), np.zeros(3)
    began, steps = time.perf_counter(), 0
    until_s = t_s[-1] + 1.5
    while (now_s := time.perf_counter() - began) < until_s:
        for kind, name, body in line.receive():
            if kind == "TRANSFORM" and name == "Stylus-force":
                force = np.array(MATRIX.unpack(body)[9:])
        while steps * PERIOD_S < now_s:
            at_s = steps * PERIOD_S - WAIT_S
            aside, up = (np.interp(at_s, t_s, column) / scale for column in places.T)
            pull = STIFFNESS_N_M * (np.array([aside, 0, up]) - place) - DAMPING_N_S_M * speed + force
            # the plan's own acceleration is fed forward, as arms do
            later = np.array(
                [np.interp(at_s + h, t_s, column) / scale for h in (-0.01, 0, 0.01) for column in places.T]
            )
            change = (later[4:6] - 2 * later[2:4] + later[:2]) / 0.01**2
            rate = (later[4:6] - later[:2]) / 0.02
            pull += np.array(
                [MASS_KG * change[0] + DAMPING_N_S_M * rate[0], 0, MASS_KG * change[1] + DAMPING_N_S_M * rate[1]]
            )
            speed = speed + pull / MASS_KG * PERIOD_S
            place = place + speed * PERIOD_S
            steps += 1
        faulty = now_s > 0.5
        if faulty and fault == "silence":
            time.sleep(1)
        if faulty and fault == "leave":
            return
        said = place * np.nan if faulty and fault == "nan" else place + 5 * (faulty and fault == "jump")
        line.send(transform("Stylus", tuple(said.tolist())) + string("Stylus-grip", "1"))
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
            operate(IgtlLine(connected), scale, fault)


if __name__ == "__main__":
    main()
