"""A person at a haptic device, as a process: a hand's impedance follows a planned swing, and gives to what it feels.

``python -m tests.plugins.teleoperation.haptic.operator_model SCALE [FAULT [PHANTOM]]`` prints its port. The hand is a
mass of 1 kg on a spring of 400 N/m and a damper of 30 Ns/m about the plan; FAULT is nan, jump, frozen, silence or
leave, half a second into it. It speaks OpenIGTLink itself; with PHANTOM, the program made of vrpn_phantom.cpp, that
speaks VRPN.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np

from kendama_cli.errors import HardwareError
from kendama_cli.plugins.shared.streams.openigtlink import TRANSFORM, MessageStream, string, transform
from kendama_cli.plugins.teleoperation.haptic.device_protocols import HapticLine
from tests.plugins.teleoperation.play.table_top import swing

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


class OpenIgtlinkSide:
    """Stylus and switch as TRANSFORM [mm] and STRING."""

    def __init__(self, connected: socket.socket) -> None:
        self._line = HapticLine(connected, MessageStream().feed)

    def say(self, place: np.ndarray, grip: bool = True) -> None:
        self._line.send(transform("Stylus", tuple((1e3 * place).tolist())) + string("Stylus-grip", str(int(grip))))

    def felt(self) -> Iterator[np.ndarray]:
        for message in self._line.receive():
            if message.kind == "TRANSFORM" and message.device == "Stylus-force":
                yield np.array(TRANSFORM.unpack(message.content)[9:])


class VrpnSide:
    """The VRPN library's own device, whose y points up and whose z points to the person."""

    def __init__(self, program: str, port: int) -> None:
        self.process = subprocess.Popen([program, str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._to, self._from, self._pending = self.process.stdin, self.process.stdout, b""
        self.wait("ready")

    def wait(self, word: str) -> None:
        os.set_blocking(self._from.fileno(), True)
        while self._from.readline().decode().strip() != word:  # the library says things of its own
            assert self.process.poll() is None
        os.set_blocking(self._from.fileno(), False)

    def say(self, place: np.ndarray, grip: bool = True) -> None:
        x, y, z = place.tolist()
        self._to.write(f"{x:.9f} {z:.9f} {-y:.9f} {int(grip)}\n".encode())

    def felt(self) -> Iterator[np.ndarray]:
        *lines, self._pending = (self._pending + (self._from.read() or b"")).split(b"\n")
        for line in lines:
            if line == b"dropped":
                raise HardwareError("the client has gone")
            if line.startswith(b"force"):
                x, y, z, _ = map(float, line.split()[1:])
                yield np.array([x, -z, y])


def operate(side: OpenIgtlinkSide | VrpnSide, scale: float, fault: str) -> None:
    """Grip, swing, and let go; the device's own loop is never late, so what comes late comes all at once."""
    person, force, steps = Operator(scale), np.zeros(3), 0
    began, frozen = time.perf_counter(), np.zeros(3)
    while (now_s := time.perf_counter() - began) < person.t_s[-1] + 1.5:
        force = [force, *side.felt()][-1]
        faulty = fault if now_s > WAIT_S else ""
        if faulty == "silence":
            time.sleep(1)
        if faulty == "leave":
            return
        while steps * PERIOD_S < now_s:
            person.step(force.copy())
            steps += 1
            jump_m = steps % 2  # there and back: after a stall one alone is a motion
            spoiled = {"nan": person.place * np.nan, "jump": person.place + jump_m, "frozen": frozen}
            said = spoiled.get(faulty, person.place)
            side.say(said)
            frozen = said
        time.sleep(PERIOD_S / 2)
    side.say(person.place, grip=False)
    time.sleep(0.5)


def main() -> None:
    """Serve one client."""
    scale, (fault, program) = float(sys.argv[1]), (*sys.argv[2:], "", "")[:2]
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        if not program:
            print(port, flush=True)
            connected, _ = server.accept()
            with connected:
                operate(OpenIgtlinkSide(connected), scale, fault)
            return
    side = VrpnSide(program, port)
    try:
        print(port, flush=True)
        side.wait("connected")
        operate(side, scale, fault)
    finally:
        side.process.kill()
        side.process.wait(timeout=20)


if __name__ == "__main__":
    main()
