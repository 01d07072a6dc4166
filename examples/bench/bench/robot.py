"""Arm of two joints without inertia that reaches every command at once."""

import dataclasses
from contextlib import contextmanager

import numpy as np

from kendama_cli.extension import Exchange, HardwareError, JointCommand, JointLimits, RobotState, limit_command


class Bench:
    joint_names = ("shoulder", "elbow")
    period_s = 0.004
    realtime = False
    missed = 0

    def __init__(self, compliance_rad_nm):
        ones = np.ones(2)
        self.limits = JointLimits(-3 * ones, 3 * ones, 2 * ones, 20 * ones, 50 * ones)
        self._compliance_rad_nm, self._halted = compliance_rad_nm, False
        self.reset(np.zeros(2), 0)

    def reset(self, position_rad, seed):
        self._refuse_when_halted()
        self._last, self._t_s = JointCommand(np.asarray(position_rad), np.zeros(2), np.zeros(2)), 0.0
        return self._exchange()

    def exchange(self, command):
        self._refuse_when_halted()
        limit_nm = self.limits.effort_nm
        try:
            sent = limit_command(self._last, command, self.limits, self.period_s)
        except HardwareError:  # not finite, or absurdly large
            self.halt()
            raise
        self._last = dataclasses.replace(sent, effort_nm=np.clip(command.effort_nm, -limit_nm, limit_nm))
        self._t_s += self.period_s
        return self._exchange()

    def halt(self):
        self._halted = True

    def close(self):
        self.halt()

    def _exchange(self):
        angles = self._last.position_rad + self._compliance_rad_nm * self._last.effort_nm
        cup = np.array([np.sin(angles).sum(), 0.0, np.cos(angles).sum()])
        state = RobotState(
            angles, self._last.velocity_rad_s, self._last.effort_nm, np.zeros(6), cup, cup - [0, 0, 0.4], False
        )
        return Exchange(self._last, state, self._t_s)

    def _refuse_when_halted(self):
        if self._halted:
            raise HardwareError("the bench is halted: open it again")


@contextmanager
def open_robot(settings, robot, task):
    bench = Bench(settings.compliance_rad_nm)
    try:
        yield bench
    finally:
        bench.close()
