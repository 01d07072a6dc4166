"""Task-space impedance: the tool of a torque-controlled arm behaves like a mass on springs and dampers.

With pose x (position and orientation), the arm H q'' + C q' + g + xi = tau + J^T f, and the tool's own inertia, which
is kept as it is, Lambda = (J H^-1 J^T)^-1, Jbar = H^-1 J^T Lambda (Khatib 1987, doi:10.1109/JRA.1987.1087068):

    qr' = Jbar xd',   qr'' = Jbar (xd'' - J' qr')
    tau = J^T (D (xd' - x') + K e + f_wanted) + H qr'' + (1 - J^T Jbar^T) tau_posture + [C qr' + g + xi]

The bracket is the robot's own compensation. C acts on qr', not on q' (Slotine and Li 1987,
doi:10.1177/027836498700600303): only so does q'^T (H' - 2 C) q' = 0 make the energy of arm and springs fall wherever
the reference rests, in contact too. D follows from Lambda and K by double diagonalisation (Albu-Schaeffer et al. 2003,
doi:10.1109/ROBOT.2003.1242165): every mode of the tool is damped alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dsygvd

from kendama_cli.motion.rotation import log_of
from kendama_cli.plugins.interact.interface import JointTorque, TaskReference, TaskState
from kendama_cli.schema.arrays import Array

LEAST_MOBILITY = 2e-3
"""Least eigenvalue of J H^-1 J^T that counts, as a share of the mean: where the arm is stretched out nothing moves it
the way that it cannot go. Postures that arms work in have 1e-2 and more, and keep the exact law."""

LEAST_SINE = 1e-9


def pose_error(reference: TaskReference, state: TaskState, *, spin_free: bool) -> Array:
    """Return the error of the pose (6,): a displacement [m] and a rotation [rad] to the desired one, in the world.

    The turn is the quaternion's log; with ``spin_free`` the least one that brings the tool's z where it shall point.
    """
    if spin_free:
        now, wanted = state.tool_rotation[:, 2], reference.rotation[:, 2]
        turn = np.array([now[i - 2] * wanted[i - 1] - now[i - 1] * wanted[i - 2] for i in range(3)])
        sine = math.sqrt(float(turn @ turn))
        if sine > LEAST_SINE:
            turn *= math.atan2(sine, float(now @ wanted)) / sine
    else:
        turn = log_of(reference.rotation @ state.tool_rotation.T)
    return np.concatenate([reference.position_m - state.tool_m, turn])


def task_inertia(jacobian: Array, inertia: Array) -> tuple[Array, Array]:
    """Return Lambda (m, m) and Jbar (n, m) of a Jacobian (m, n) and H (n, n)."""
    response = np.linalg.solve(inertia, jacobian.T)
    eased, ways = np.linalg.eigh(jacobian @ response)
    made = (ways / np.maximum(eased, LEAST_MOBILITY * eased.mean())) @ ways.T
    return made, response @ made


def modal_damping(inertia: Array, stiffness: Array, ratio: float) -> Array:
    """Return D = 2 ratio Q sqrt(k) Q^T, where Lambda = Q Q^T and K = Q k Q^T: ``ratio`` of critical in every mode."""
    # what scipy.linalg.eigh calls, whose checks take five times as long
    squares, modes, failed = dsygvd(stiffness, inertia, uplo="L")
    if failed:
        raise np.linalg.LinAlgError("the task's inertia is not positive definite")
    q = inertia @ modes
    return np.asarray((q * (2.0 * ratio * np.sqrt(np.maximum(squares, 0.0)))) @ q.T)


@dataclass(frozen=True)
class Impedance:
    """The law with its gains: K = diag(``stiffness``) (6,) [N/m, Nm/rad], damping ratio, stiffness of the posture."""

    stiffness: Array
    damping_ratio: float
    posture_1_s2: float
    reach_m: float
    """along ``force_axis`` no spring acts within this distance of the reference"""
    spin_free: bool
    """whether the turn about the tool's own z is left to the posture, as a round tool does not need it"""

    def command(self, state: TaskState, reference: TaskReference, posture_rad: Array, push_n: Array) -> JointTorque:
        """Return the torque now; ``push_n`` (3,) is f_wanted."""
        # the task's coordinates: the world's x, y, z, and turns about the tool's own x, y, and z where it is held
        rows = np.zeros((5 if self.spin_free else 6, 6))
        rows[:3, :3] = np.eye(3)
        rows[3:, 3:] = state.tool_rotation.T[: len(rows) - 3]
        jacobian = rows @ state.jacobian
        inertia, inverse = task_inertia(jacobian, state.inertia)
        damping = modal_damping(inertia, np.diag(self.stiffness[: len(rows)]), self.damping_ratio)
        error = pose_error(reference, state, spin_free=self.spin_free)
        pull = rows @ self._springs(error, reference.force_axis, reference.force_share)
        pull[:3] += push_n
        force = damping @ (rows @ reference.velocity - jacobian @ state.velocity_rad_s) + pull
        velocity = inverse @ (rows @ reference.velocity)
        acceleration = inverse @ (rows @ (reference.acceleration - state.jacobian_rate @ velocity))
        away = self.posture_1_s2 * (posture_rad - state.position_rad)
        posture = state.inertia @ (away - 2.0 * math.sqrt(self.posture_1_s2) * state.velocity_rad_s)
        torque = jacobian.T @ (force - inverse.T @ posture) + posture + state.inertia @ acceleration
        return JointTorque(torque, velocity)

    def _springs(self, error: Array, axis: Array, share: float) -> Array:
        """Return K e (6,), from which ``axis`` u (3,) is taken out to ``share`` s: (1 - s u u^T) K (1 - s u u^T) e.

        Beyond ``reach_m`` along it a spring acts all the same: a tool that meets nothing does not run away.
        """
        along = float(axis @ error[:3])
        pull: Array = self.stiffness * np.concatenate([error[:3] - share * along * axis, error[3:]])
        beyond = along - min(max(along, -self.reach_m), self.reach_m)
        stiffness = float(axis**2 @ self.stiffness[:3])
        pull[:3] += share * (stiffness * beyond - float(axis @ pull[:3])) * axis
        return pull
