"""Any arm that LeRobot drives, as a controller of kendama: ``hardware=command`` speaks to this, this to LeRobot.

python lerobot_arm.py ARM.yaml KEY_FILE PORT          (in an environment of its own, in which lerobot is installed)
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import math
import signal
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from kendama_robot import Command, Description, Heard, Robot, State, read_key

UNITS = {"deg": math.pi / 180, "rad": 1.0}
RAMP_S, SETTLE_S = 0.5, 3.0  # an approach speeds up, and at least settles, for so long; at most for the second


@dataclass(frozen=True)
class Joint:
    """A joint of the robot's description: angle [rad] = sign unit (LeRobot's value - zero)."""

    name: str
    key: str  # LeRobot's, of the value
    unit: str  # deg, rad or a number of radians
    limits: tuple[float, float, float, float, float]  # lower, upper, velocity, acceleration, effort
    rest: float  # angle at which the arm may lose its torque
    zero: float = 0.0
    sign: int = 1


@dataclass(frozen=True)
class Arm:
    """Settings of an arm: ``robot`` as LeRobot configures it, from ``module``; ``hold`` is what else it is sent."""

    module: str
    robot: dict[str, Any]
    joints: list[Joint]
    period_s: float
    hold: dict[str, float] = field(default_factory=dict)
    watchdog_s: float = 0.25
    approach_rad_s: float = 0.3
    settled_rad: float = 0.05
    max_tracking_error_rad: float = 0.5


class LeRobotArm:
    """A robot of LeRobot in radians: ``sent_rad``, ``velocity_rad_s`` as commanded, ``at_rad`` as measured."""

    def __init__(self, robot: Any, about: Arm) -> None:
        self.robot, self.about, self.keys = robot, about, [one.key for one in about.joints]
        takes = set(robot.action_features)
        if lacking := sorted(set(self.keys) - (takes & set(robot.observation_features))):
            raise SystemExit(f"{robot} does not take and tell {lacking}; it takes {sorted(takes)}")
        speeds = [key.removesuffix(".pos") + ".vel" for key in self.keys]
        self.speeds = speeds if takes.issuperset(speeds) else []
        if left := sorted(takes - {*self.keys, *self.speeds, *about.hold}):
            raise SystemExit(f"give values under 'hold' for what else {robot} is to be sent: {left}")
        self.scale = np.array([one.sign * (UNITS.get(one.unit) or float(one.unit)) for one in about.joints])
        self.zero, self.rest = np.array([(one.zero, one.rest) for one in about.joints]).T
        self.limits = np.array([one.limits for one in about.joints]).T
        self.sent_rad = self.velocity_rad_s = self.at_rad = self.moved_rad_s = np.zeros(len(self.keys))
        self.at_s = -math.inf

    def connect(self) -> None:
        """Connect without a question, and hold the arm where it is; an arm that is not calibrated is refused."""
        takes = inspect.signature(self.robot.connect).parameters
        self.robot.connect(**({"calibrate": False} if "calibrate" in takes else {}))
        if not self.robot.is_calibrated:
            self.robot.disconnect()
            raise SystemExit(f"{self.robot} is not calibrated as its file says; run lerobot-calibrate first")
        self.read()
        self.send(self.at_rad)

    def read(self) -> None:
        """Measure angles, and velocities from their differences."""
        at_rad, now_s = self._angles(self.robot.get_observation()), time.monotonic()
        self.moved_rad_s, self.at_rad, self.at_s = (at_rad - self.at_rad) / (now_s - self.at_s), at_rad, now_s

    def check(self) -> None:
        """Hold the arm where it is and raise RuntimeError if a joint did not follow: something is in its path."""
        errors, allowed = np.abs(self.at_rad - self.sent_rad), self.about.max_tracking_error_rad
        if errors.max() > allowed:
            self.send(self.at_rad)
            name = self.about.joints[errors.argmax()].name
            raise RuntimeError(f"joint '{name}' is {errors.max():.3f} rad from its command; allowed: {allowed:g} rad")

    def send(self, position_rad: Any, velocity_rad_s: Any = 0.0) -> None:
        """Send a command within the limits of position, and note what LeRobot says that it sent."""
        goal_rad = np.clip(position_rad, *self.limits[:2])
        self.velocity_rad_s = np.zeros(len(self.keys)) + velocity_rad_s
        action = dict(zip(self.keys, (self.zero + goal_rad / self.scale).tolist(), strict=True)) | self.about.hold
        action |= zip(self.speeds, (self.velocity_rad_s / self.scale).tolist(), strict=False)
        done = self.robot.send_action(dict(action)) or action  # some robots return nothing
        self.sent_rad = np.where([done[key] == action[key] for key in self.keys], goal_rad, self._angles(done))

    def _angles(self, values: dict[str, Any]) -> Any:
        """Return angles (n,) [rad] of LeRobot's ``values``; raises ConnectionError where one is no number."""
        told = np.array([values[key] for key in self.keys], dtype=float)
        if not np.isfinite(told).all():
            raise ConnectionError(f"it tells {told}")
        return self.scale * (told - self.zero)

    def brake(self) -> None:
        """Slow down within the limits of acceleration for a period; at rest nothing is sent, and the servos hold."""
        change = self.limits[3] * self.about.period_s
        slower = self.velocity_rad_s - np.clip(self.velocity_rad_s, -change, change)
        if self.velocity_rad_s.any():
            self.send(self.sent_rad + slower * self.about.period_s, slower)

    def approach(self, target_rad: Any) -> bool:
        """Go on for a period, slowly in a straight line of joint space; return True when all of it is sent."""
        way_rad, period_s, most = np.subtract(target_rad, self.sent_rad), self.about.period_s, self.about.approach_rad_s
        fast, gap, gain = np.abs(self.velocity_rad_s).max(), max(np.abs(way_rad).max(), 1e-12), most / RAMP_S
        if fast > 1.01 * most:  # it was stopped in a swing
            self.brake()
            return False
        share = min(min(most, fast + gain * period_s, math.sqrt(2 * gain * gap)) * period_s / gap, 1.0)
        self.send(self.sent_rad + share * way_rad, share * way_rad / period_s if share < 1 else 0.0)
        return share >= 1

    def let_go(self) -> None:
        """Go to rest, slowly, and disconnect, whereupon most arms lose their torque."""
        with contextlib.suppress(Exception):
            while not self.approach(self.rest):
                time.sleep(self.about.period_s)
                self.read()
                self.check()
            time.sleep(RAMP_S)
        self.robot.disconnect()


def serve(arm: LeRobotArm, line: Robot) -> None:
    """Play a command per period, for ever; whatever LeRobot raises latches a stop, in which the arm holds."""
    period_s, t_s, due_s, there_s = arm.about.period_s, 0.0, time.monotonic(), 0.0
    target: tuple[float, ...] | None = None  # of a RESET under way; all of its path was sent there_s ago
    while True:
        due_s, heard, now = max(due_s, time.monotonic() - period_s) + period_s, Heard.NOTHING, Heard.STOP
        try:
            while now is not Heard.NOTHING or time.monotonic() < due_s:  # the newest of what comes in a period counts
                now = line.poll(max(due_s - time.monotonic(), 0.0))
                heard = heard if now is Heard.NOTHING else now
                if now is Heard.COMMAND:
                    arm.send(line.command.position_rad, line.command.velocity_rad_s)
            t_s += period_s
            target = None if heard is Heard.COMMAND or line.reason is not None else target
            if line.reason is not None or (heard is Heard.NOTHING and target is None):
                arm.brake()
                continue
            arm.read()
            if heard is Heard.RESET:
                target, there_s, arm.sent_rad = line.command.position_rad, 0.0, arm.at_rad
            arm.check()
            if target is not None:
                there_s = there_s + period_s if arm.approach(target) else 0.0
                if there_s > SETTLE_S:
                    raise RuntimeError(f"it rests at {arm.at_rad} rad, farther than settled_rad from its goal {target}")
                if there_s < RAMP_S or np.abs(arm.at_rad - target).max() > arm.about.settled_rad:
                    continue
                t_s, target = 0.0, None
            sent = Command(tuple(arm.sent_rad), tuple(arm.velocity_rad_s), line.command.acceleration_rad_s2)
            line.answer(State(t_s, sent, tuple(arm.at_rad), tuple(arm.moved_rad_s), (0.0,) * len(arm.keys)))
        except Exception as fault:  # if a plug-in's fault of any kind ended this process, the arm would fall
            target = None
            line.stop(f"{type(fault).__name__}: {fault}"[:300])


def main(path: str, key_file: str, port: int) -> None:
    """Open the arm of a YAML, and serve it until Ctrl+C or SIGTERM."""
    import draccus
    from lerobot.robots import RobotConfig, make_robot_from_config

    try:
        with open(path, encoding="utf-8") as file:
            about = draccus.load(Arm, file)
        importlib.import_module(about.module)
        arm = LeRobotArm(make_robot_from_config(draccus.decode(RobotConfig, about.robot)), about)
        names, limits = tuple(one.name for one in about.joints), tuple(map(tuple, arm.limits.tolist()))
        line = Robot(port, read_key(key_file), Description(names, limits, about.period_s, about.watchdog_s))
        arm.connect()
    except (OSError, ImportError, RuntimeError, ValueError, draccus.utils.DraccusException) as wrong:
        raise SystemExit(f"{path}: {wrong}") from None
    for end in (signal.SIGINT, signal.SIGTERM):
        signal.signal(end, lambda *_: sys.exit(0))
    try:
        print("listening", flush=True)
        serve(arm, line)
    finally:
        line.stop("the controller was ended")
        arm.let_go()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
