"""A serial line with an SO-101's six servos, in LeRobot's environment: python feetech_line.py SO101.xml FOLDER.

Registers, firmware and motor are those of servolab (PyPI), the arm is Menagerie's in MuJoCo. Feetech's packets (ff ff,
id, length, instruction, parameters, sum) are answered on a pty, whose name is printed; so are angles at a torque-off.
"""

from __future__ import annotations

import json
import os
import sys
import time
import tty
from contextlib import suppress
from pathlib import Path

import mujoco
from servolab.ports.mujoco_port import MujocoPort

STALL_NM = 2.94
READ, WRITE, SYNC_READ, SYNC_WRITE = 2, 3, 0x82, 0x83
TORQUE_ENABLE, GOAL = 40, 42


def motorised(path: str, out: Path) -> str:
    """Write the arm with motors of the servo's torque in the place of its position actuators, and return the file."""
    spec = mujoco.MjSpec.from_file(path)
    for number, actuator in enumerate(spec.actuators, 1):
        actuator.set_to_motor()
        actuator.forcelimited, actuator.ctrlrange = False, [-STALL_NM, STALL_NM]
        spec.add_numeric(name=f"servo_id:{actuator.name}", data=[number], size=1)
        spec.joint(actuator.target).damping = [
            0.02,
            0,
            0,
        ]  # the rest of Menagerie's is the motor's back-EMF, which servolab has
    spec.option.timestep = 0.001
    spec.compile()
    out.write_text(spec.to_xml())
    return str(out)


def calibrate(arm: MujocoPort, path: Path) -> None:
    """Write a file as lerobot-calibrate does, of an arm whose joints are at zero at the encoders' centres."""
    made = {}
    for number, servo in arm.motors.items():
        low, high = arm.model.jnt_range[arm.model.joint(servo.joint_name).id]
        ticks = (
            [0, 4095]
            if servo.joint_name == "wrist_roll"
            else [round(2048 + q * 2048 / 3.14159265) for q in (low, high)]
        )
        for name, value in zip(("min_position_limit", "max_position_limit"), ticks, strict=True):
            servo.set(name, value)
        made[servo.joint_name] = {
            "id": number, "drive_mode": 0, "homing_offset": 0, "range_min": ticks[0], "range_max": ticks[1]
        }  # fmt: skip
    path.write_text(json.dumps(made))


class Line:
    """The bus: one answer per packet."""

    def __init__(self, arm: MujocoPort) -> None:
        self.arm = arm

    def answer(self, motor: int, kind: int, given: bytes) -> bytes:
        if kind == SYNC_READ:
            return b"".join(self.status(one, bytes(self.arm.read(one, given[0], given[1]))) for one in given[2:])
        if kind == SYNC_WRITE:
            for i in range(2, len(given), given[1] + 1):
                self.write(given[i], given[0], given[i + 1 : i + 1 + given[1]])
            return b""
        if motor not in self.arm.motors:
            return b""
        if kind == READ:
            return self.status(motor, bytes(self.arm.read(motor, given[0], given[1])))
        if kind == WRITE:
            self.write(motor, given[0], given[1:])
        return self.status(motor)

    def write(self, motor: int, address: int, data: bytes) -> None:
        if address == TORQUE_ENABLE and data[0] == 0 and motor == 1:
            angles = [float(self.arm.data.qpos[one.qpos_index]) for one in self.arm.motors.values()]
            print("released", *(f"{q:.4f}" for q in angles), flush=True)
        self.arm.write(motor, address, list(data))

    @staticmethod
    def status(motor: int, data: bytes = b"") -> bytes:
        body = bytes([motor, len(data) + 2, 0, *data])
        return b"\xff\xff" + body + bytes([~sum(body) & 0xFF])


def main(model: str, folder: str) -> None:
    with suppress(OSError):
        os.nice(-10)  # servos do not wait for other programs
    arm = MujocoPort(motorised(model, Path(folder) / "motorised.xml"), show=False)
    calibrate(arm, Path(folder) / "test.json")
    master, slave = os.openpty()
    tty.setraw(slave)
    print(os.ttyname(slave), flush=True)
    line, heard = Line(arm), b""
    while True:
        heard += os.read(master, 4096)
        while (at := heard.find(b"\xff\xff")) >= 0 and len(heard) >= at + 4 and len(heard) >= at + 4 + heard[at + 3]:
            packet, heard = heard[at : at + 4 + heard[at + 3]], heard[at + 4 + heard[at + 3] :]
            if ~sum(packet[2:-1]) & 0xFF == packet[-1]:
                said = line.answer(packet[2], packet[4], packet[5:-1])
                time.sleep(10e-6 * (len(packet) + len(said)))  # ten bits a byte at 1 Mbit/s
                os.write(master, said)


if __name__ == "__main__":
    main(*sys.argv[1:])
