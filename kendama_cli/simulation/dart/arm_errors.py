"""Errors of a simulation and its arm: ball, rope and air differ, the arm lags, and its cup is not quite in position."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.motion import minimum_jerk
from kendama_cli.robot_model.arm_motion import CONTROL_S
from kendama_cli.robot_model.inverse_kinematics import weighted_step
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class WorldErrors:
    """Errors of one world against its controller's beliefs (see settings.robot.Imperfection).

    The rope is ``rope_scale`` times as long as the game's, and ``ball_start_m`` is the ball's offset as it hangs.
    ``joint_friction_nm`` is Coulomb friction of every joint beyond the known one, ``joint_friction_fraction`` the share
    of each joint's known friction that comes on top of it; ``restitution`` that of ball and cup, None as in the game;
    ``mass_scale`` and ``drag_scale`` are factors on the ball's mass and on the air's force; ``tie_friction_m`` is the
    moment of the rope's friction at its tie over its tension, ``gravity_tilt_rad`` how far gravity leans toward +x for
    the ball; the arm's stiff drive would not show it (g sin 1 deg / Kp is 0.05 mm). ``ball_start_y_m`` and
    ``gravity_tilt_y_rad`` are the same along y. ``wrist_rotor_scale`` is a factor on the rotors of the last
    WRIST_JOINTS joints, of which the arm's drive knows.
    """

    rope_scale: float = 1.0
    ball_start_m: float = 0.0
    joint_friction_nm: float = 0.0
    joint_friction_fraction: float = 0.0
    restitution: float | None = None
    mass_scale: float = 1.0
    drag_scale: float = 1.0
    tie_friction_m: float = 0.0
    gravity_tilt_rad: float = 0.0
    ball_start_y_m: float = 0.0
    gravity_tilt_y_rad: float = 0.0
    wrist_rotor_scale: float = 1.0


NO_ERRORS = WorldErrors()
WRIST_JOINTS = 3


KNOT_S = 0.02
"""The cup's error is carried to the joints this often and interpolated between: eight times in a period of 6 Hz."""
ONSET_S = 0.3
"""The cup's error grows from nothing within this time, so that the arm begins at rest."""


@dataclass(frozen=True)
class ArmErrors:
    """Errors of one arm against its model: a lag of first order, and a slow error of the cup along the world's x.

    e(t) = cup_error_m sin(2 pi cup_error_hz t + cup_error_phase_rad),   grown from nothing within ONSET_S

    The cup errs along y in the same way. Its links swing behind their motors at ``resonance_hz`` (0: they are rigid),
    and ``lost_commands`` of its commands are lost, ``lost_burst`` in a row (see ElasticJoints and CommandLoss).
    """

    lag_s: float = 0.0
    cup_error_m: float = 0.0
    cup_error_hz: float = 1.0
    cup_error_phase_rad: float = 0.0
    cup_error_y_m: float = 0.0
    cup_error_y_hz: float = 1.0
    cup_error_y_phase_rad: float = 0.0
    resonance_hz: float = 0.0
    resonance_damping: float = 0.05
    lost_commands: float = 0.0
    lost_burst: float = 1.0


class ErringArm:
    """Reference of an erring drive in the place of the samples of ``joints``, or of commands in their place.

    The cup's error is carried to the joints along ``joints``: dq = J^+ e, the cup's tilt as it is. It is no command,
    so that the drive's limits do not bound it; the angles are read with an error by as much as makes the arm err by dq.
    So it is with the swing of links on elastic joints, but for their encoders, which are on the motors.
    """

    def __init__(
        self,
        arm: RobotModel,
        joints: JointTrajectory,
        errors: ArmErrors,
        step_s: float,
        rng: np.random.Generator | None = None,
    ) -> None:
        """Take the ``rng`` of whose child the lost commands are sampled."""
        start = joints.position_rad[0]
        rest = np.zeros_like(start)
        self._delay = DriveDelay((start, rest, rest, rest), latency_s=0.0, lag_s=errors.lag_s, step_s=step_s)
        self._none, self._stiffness = rest, arm.settings.stiffness_1_s2
        self._reading_errors: Array | None = None
        self._links: ElasticJoints | None = None
        self._loss: CommandLoss | None = None
        if errors.cup_error_m > 0 or errors.cup_error_y_m > 0:
            self._reading_errors = _deviating(*_joint_offsets(arm, joints, errors), self._stiffness)
        if errors.resonance_hz > 0:
            self._links = ElasticJoints(len(start), errors.resonance_hz, errors.resonance_damping, step_s)
        if errors.lost_commands > 0 and rng is not None:
            steps = round(CONTROL_S / step_s)
            self._loss = CommandLoss(errors.lost_commands, errors.lost_burst, steps, rng.spawn(1)[0])

    def follows(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the reference (n,) of positions, velocities and accelerations at the next sample."""
        if self._loss is not None:
            position, velocity, acceleration = self._loss.arrived(position, velocity, acceleration)
        position, velocity, acceleration, _ = self._delay.delayed((position, velocity, acceleration, self._none))
        return position, velocity, acceleration

    def reading_error(self, step: int, acceleration_rad_s2: Array) -> Array:
        """Return the reading error (n,) of the angles for the drive's controller before the sample ``step``.

        ``acceleration_rad_s2`` (n,) is that of the motors until then: it makes the links swing on.
        """
        reading: Array = self._none if self._reading_errors is None else self._reading_errors[step - 1]
        if self._links is None:
            return reading
        return reading + _deviating(*self._links.swung(acceleration_rad_s2), self._stiffness)

    def encoder_error(self, step: int) -> Array:
        """Return the reading error (n,) of the encoders before the sample ``step``; they are on the motors."""
        reading: Array = self._none if self._reading_errors is None else self._reading_errors[step - 1]
        return reading if self._links is None else reading - self._links.deflection_rad


def _deviating(position: Array, speed: Array, change: Array, stiffness_1_s2: float) -> Array:
    """Return the reading error by which computed torque deviates by dq from its reference; arrays of any one shape.

    dq'' + Kd dq' + Kp (dq + m) = 0,   m = -dq - (Kd dq' + dq'') / Kp,   Kd = 2 sqrt Kp
    """
    return -position - (2 * math.sqrt(stiffness_1_s2) * speed + change) / stiffness_1_s2


def _joint_offsets(arm: RobotModel, joints: JointTrajectory, errors: ArmErrors) -> tuple[Array, Array, Array]:
    """Return the joint offsets (n, joints) with their first two derivatives at every sample of ``joints``."""
    t_s = joints.t_s - joints.t_s[0]
    every = max(1, round(KNOT_S / float(t_s[1] - t_s[0])))
    knots = np.append(np.arange(0, len(t_s) - 1, every), len(t_s) - 1)
    along = 2 * math.pi * errors.cup_error_hz * t_s[knots] + errors.cup_error_phase_rad
    across = 2 * math.pi * errors.cup_error_y_hz * t_s[knots] + errors.cup_error_y_phase_rad
    onset = minimum_jerk.step(t_s[knots] / ONSET_S)
    error_m = np.zeros((len(knots), 6))
    error_m[:, 0] = errors.cup_error_m * onset * np.sin(along)
    error_m[:, 1] = errors.cup_error_y_m * onset * np.sin(across)
    offsets = [
        weighted_step(arm.tool_jacobian(joints.position_rad[k]), e, arm.redundancy_weights)
        for k, e in zip(knots, error_m, strict=True)
    ]
    curve = CubicSpline(t_s[knots], np.array(offsets))
    return curve(t_s), curve(t_s, 1), curve(t_s, 2)


class Backlash:
    """Joints (n,) that follow their motors through a play of ``width_rad`` from end to end.

        link' = clip(link, motor - width / 2, motor + width / 2)

    A link that is not pushed rests. ``gap_rad`` (n,) is how far the motors are ahead of the links.
    """

    def __init__(self, start_rad: Array, width_rad: float) -> None:
        self._half_rad = 0.5 * width_rad
        self._link = np.array(start_rad)
        self.gap_rad: Array = np.zeros_like(self._link)

    def follows(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the links' positions, velocities and accelerations (n,) for those of the motors."""
        link = np.clip(self._link, position - self._half_rad, position + self._half_rad)
        pushed = link != self._link
        self._link = link
        self.gap_rad = position - link
        return link, np.where(pushed, velocity, 0.0), np.where(pushed, acceleration, 0.0)


Reference = tuple[Array, Array, Array, Array]
"""Positions, velocities, accelerations and the torque to add (n,), at the end of one step."""


class DriveDelay:
    """A pure delay of ``latency_s``, then a lag of first order with the time constant ``lag_s`` (0: none)."""

    def __init__(self, start: Reference, *, latency_s: float, lag_s: float, step_s: float) -> None:
        self._waiting = [start] * round(latency_s / step_s)
        self._share = 1.0 if lag_s <= 0 else 1.0 - math.exp(-step_s / lag_s)
        self._last = start

    def delayed(self, reference: Reference) -> Reference:
        """Return the drive's reference in the step for which ``reference`` was commanded."""
        self._waiting.append(reference)
        target = self._waiting.pop(0)
        if self._share < 1.0:
            q, v, a, effort = (old + self._share * (new - old) for old, new in zip(self._last, target, strict=True))
            target = (q, v, a, effort)
        self._last = target
        return target


class CommandLoss:
    """Loss of the ``fraction`` of commands, ``burst`` in a row on average, sampled from ``rng``.

    A channel of two states (E. N. Gilbert, Bell System Technical Journal 39, 1960): from bad to good with 1 / burst,
    from good to bad with fraction / (burst (1 - fraction)). The first command arrives.
    """

    def __init__(self, fraction: float, burst: float, steps: int, rng: np.random.Generator) -> None:
        """Count ``steps`` steps a command."""
        self._rng, self._steps, self._ends = rng, steps, 1.0 / burst
        self._begins = fraction / (burst * (1.0 - fraction))
        self._count, self._bad = 0, False
        self._last: Array = np.zeros(0)

    def arrived(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the reference (n,) for the next step: what is sent, or the last position, at rest."""
        if self._count and self._count % self._steps == 0:
            self._bad ^= bool(self._rng.random() < (self._ends if self._bad else self._begins))
        self._count += 1
        if self._bad:
            rest = np.zeros_like(self._last)
            return self._last, rest, rest
        self._last = position
        return position, velocity, acceleration


class ElasticJoints:
    """Deflections d = q_link - q_motor of n joints, each a damped spring that its motor's acceleration excites.

        d'' + 2 zeta w d' + w^2 d = -q_motor'',   w = 2 pi ``resonance_hz``, zeta = ``damping``

    All joints have one frequency, that of the whole arm's first mode. A step of ``step_s`` is exact for an acceleration
    that is constant in it. Weight and rope, which deflect them too, are left out.
    """

    def __init__(self, joints: int, resonance_hz: float, damping: float, step_s: float) -> None:
        w = 2 * math.pi * resonance_hz
        self._spring = np.array([w * w, 2 * damping * w])
        system = np.zeros((3, 3))  # d, d' and the constant acceleration
        system[0, 1], system[1, :2], system[1, 2] = 1.0, -self._spring, -1.0
        self._step = expm(step_s * system)[:2]
        self._state = np.zeros((3, joints))

    @property
    def deflection_rad(self) -> Array:
        """The deflections (n,) now."""
        return np.asarray(self._state[0])

    def swung(self, acceleration_rad_s2: Array) -> tuple[Array, Array, Array]:
        """Return the deflections (n,) now, their velocities and accelerations, and step on.

        The motors accelerate by ``acceleration_rad_s2`` (n,) in the coming step.
        """
        position, velocity, self._state[2] = self._state[0], self._state[1], acceleration_rad_s2
        change = -self._spring @ self._state[:2] - acceleration_rad_s2
        stepped = self._step @ self._state
        swung = position.copy(), velocity.copy(), change
        self._state[:2] = stepped
        return swung
