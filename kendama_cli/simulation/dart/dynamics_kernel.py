"""Dynamics of a simulated arm, compiled: positions, inertia and bias from DART's angles. Arrays (n,), one a joint."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.chain_kernel import rotated_row
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.settings.game import CupSettings, GameSettings, SideTie
from kendama_cli.system.compiled import NONE, READ, READ_2D, WRITE, WRITE_2D, Array, compiled_as, float64

AXIS, ORIGIN, CENTER, INERTIA, MASS, ROTOR = 0, 3, 6, 9, 18, 19
"""Columns of the links (n, 20) in the posture of zeros, in the world: a joint's axis and a point of it, its link's
centre of mass, the inertia about that, row by row, and the mass; and the joint's rotor, which counts in H alone."""
ROOT, MIDDLE, TIE, OVER, KNOT = range(5)
"""Marks on the last link: its joint's origin, the cup's middle, its position (the tie, if on the axis), the point of
the axis 1 m over it, and a tie on the wall."""


@compiled_as(NONE(READ, READ, READ_2D, READ_2D, float64, WRITE_2D, WRITE, WRITE_2D, WRITE_2D, WRITE_2D))
def move_chain(  # noqa: PLR0912, PLR0915, PLR0917
    position_rad: Array,
    velocity_rad_s: Array,
    links: Array,
    marks: Array,
    gravity: float,
    inertia: Array,
    bias: Array,
    screws: Array,
    points: Array,
    mark_speeds: Array,
) -> None:
    """Compute the arm's dynamics and points: ``inertia`` H (n, n), ``bias`` C q' + g (n,), positions in the world.

    By products of exponentials, composite bodies and Newton and Euler, all in the world and about its origin, where a
    joint's motion is the screw (a, o x a) of its axis a through o (R. Featherstone, Rigid Body Dynamics Algorithms,
    2008, chapters 5 and 6). ``screws`` (n, 6); ``marks`` are points of the last link in the posture of zeros, and
    ``points`` the joints' origins and after them the marks, which move with ``mark_speeds``.
    """
    n = position_rad.size
    rotation, last, shift = np.eye(3), np.eye(3), np.zeros(3)
    bodies, loads = np.empty((n, 10)), np.empty((n, 6))  # mass, m c, J about the origin; torque and force
    w, u, dw, du = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    du[2] = gravity
    turned = np.empty(3)
    for i in range(n):
        link = links[i]
        x, y, z = link[AXIS], link[AXIS + 1], link[AXIS + 2]
        cosine, sine = math.cos(position_rad[i]), math.sin(position_rad[i])
        for r in range(3):  # Rodrigues' rotation about the axis, after the rotation so far
            p, q, s = rotation[r, 0], rotation[r, 1], rotation[r, 2]
            along = p * x + q * y + s * z
            screws[i, r] = along
            points[i, r] = p * link[ORIGIN] + q * link[ORIGIN + 1] + s * link[ORIGIN + 2] + shift[r]
            last[r, 0], last[r, 1], last[r, 2] = p, q, s
            rotation[r, 0], rotation[r, 1], rotation[r, 2] = rotated_row((p, q, s), (x, y, z), cosine, sine)
            for k in range(3):
                shift[r] += (last[r, k] - rotation[r, k]) * link[ORIGIN + k]
        a0, a1, a2 = screws[i, 0], screws[i, 1], screws[i, 2]
        o0, o1, o2 = points[i]
        b0, b1, b2 = o1 * a2 - o2 * a1, o2 * a0 - o0 * a2, o0 * a1 - o1 * a0
        screws[i, 3], screws[i, 4], screws[i, 5] = b0, b1, b2
        rate = velocity_rad_s[i]
        # what the motion so far makes of the screw, times the rate, then the motion of this link
        du[0] += (w[1] * b2 - w[2] * b1 + u[1] * a2 - u[2] * a1) * rate
        du[1] += (w[2] * b0 - w[0] * b2 + u[2] * a0 - u[0] * a2) * rate
        du[2] += (w[0] * b1 - w[1] * b0 + u[0] * a1 - u[1] * a0) * rate
        dw[0] += (w[1] * a2 - w[2] * a1) * rate
        dw[1] += (w[2] * a0 - w[0] * a2) * rate
        dw[2] += (w[0] * a1 - w[1] * a0) * rate
        for r in range(3):
            w[r] += screws[i, r] * rate
            u[r] += screws[i, 3 + r] * rate
        mass = link[MASS]
        for r in range(3):
            turned[r] = shift[r]
            for k in range(3):
                turned[r] += rotation[r, k] * link[CENTER + k]
        c0, c1, c2 = turned
        h0, h1, h2 = mass * c0, mass * c1, mass * c2
        body = bodies[i]
        body[0], body[1], body[2], body[3] = mass, h0, h1, h2
        at = 4
        for r in range(3):
            for k in range(3):
                last[r, k] = 0.0
                for m in range(3):
                    last[r, k] += rotation[r, m] * link[INERTIA + 3 * m + k]
        for r in range(3):
            for k in range(r + 1):
                body[at] = last[r, 0] * rotation[k, 0] + last[r, 1] * rotation[k, 1] + last[r, 2] * rotation[k, 2]
                body[at] -= mass * turned[r] * turned[k]
                if r == k:
                    body[at] += h0 * c0 + h1 * c1 + h2 * c2
                at += 1
        xx, xy, yy, xz, yz, zz = body[4], body[5], body[6], body[7], body[8], body[9]
        l0 = xx * w[0] + xy * w[1] + xz * w[2] + h1 * u[2] - h2 * u[1]
        l1 = xy * w[0] + yy * w[1] + yz * w[2] + h2 * u[0] - h0 * u[2]
        l2 = xz * w[0] + yz * w[1] + zz * w[2] + h0 * u[1] - h1 * u[0]
        p0 = mass * u[0] + w[1] * h2 - w[2] * h1
        p1 = mass * u[1] + w[2] * h0 - w[0] * h2
        p2 = mass * u[2] + w[0] * h1 - w[1] * h0
        load = loads[i]
        load[0] = xx * dw[0] + xy * dw[1] + xz * dw[2] + h1 * du[2] - h2 * du[1]
        load[1] = xy * dw[0] + yy * dw[1] + yz * dw[2] + h2 * du[0] - h0 * du[2]
        load[2] = xz * dw[0] + yz * dw[1] + zz * dw[2] + h0 * du[1] - h1 * du[0]
        load[0] += w[1] * l2 - w[2] * l1 + u[1] * p2 - u[2] * p1
        load[1] += w[2] * l0 - w[0] * l2 + u[2] * p0 - u[0] * p2
        load[2] += w[0] * l1 - w[1] * l0 + u[0] * p1 - u[1] * p0
        load[3] = mass * du[0] + dw[1] * h2 - dw[2] * h1 + w[1] * p2 - w[2] * p1
        load[4] = mass * du[1] + dw[2] * h0 - dw[0] * h2 + w[2] * p0 - w[0] * p2
        load[5] = mass * du[2] + dw[0] * h1 - dw[1] * h0 + w[0] * p1 - w[1] * p0
    for mark in range(marks.shape[0]):
        for r in range(3):
            points[n + mark, r] = shift[r]
            for k in range(3):
                points[n + mark, r] += rotation[r, k] * marks[mark, k]
        x, y, z = points[n + mark]
        mark_speeds[mark, 0] = u[0] + w[1] * z - w[2] * y
        mark_speeds[mark, 1] = u[1] + w[2] * x - w[0] * z
        mark_speeds[mark, 2] = u[2] + w[0] * y - w[1] * x
    for j in range(n - 1, -1, -1):
        if j + 1 < n:
            for k in range(10):
                bodies[j, k] += bodies[j + 1, k]
            for k in range(6):
                loads[j, k] += loads[j + 1, k]
        bias[j] = 0.0
        for k in range(6):
            bias[j] += screws[j, k] * loads[j, k]
        mass, h0, h1, h2, xx, xy, yy, xz, yz, zz = bodies[j]
        a0, a1, a2, b0, b1, b2 = screws[j]
        l0 = xx * a0 + xy * a1 + xz * a2 + h1 * b2 - h2 * b1
        l1 = xy * a0 + yy * a1 + yz * a2 + h2 * b0 - h0 * b2
        l2 = xz * a0 + yz * a1 + zz * a2 + h0 * b1 - h1 * b0
        p0 = mass * b0 + a1 * h2 - a2 * h1
        p1 = mass * b1 + a2 * h0 - a0 * h2
        p2 = mass * b2 + a0 * h1 - a1 * h0
        for i in range(j + 1):
            s = screws[i]
            inertia[i, j] = s[0] * l0 + s[1] * l1 + s[2] * l2 + s[3] * p0 + s[4] * p1 + s[5] * p2
            inertia[j, i] = inertia[i, j]
        inertia[j, j] += links[j, ROTOR]


@compiled_as(NONE(READ_2D, READ, READ, READ, WRITE))
def carry_rotors(screws: Array, velocity_rad_s: Array, change: Array, rotor: Array, force: Array) -> None:
    """Add to ``force`` (n,) what keeps DART's links, which carry their ``rotor``, to the law of geared ones.

        force_j += a_j . sum_{i >= j} m_i - J_j q_j'',   m_i = J_i (a_i (a_i . dw_i) + (a_i . w_i) w_i x a_i)

    DART knows no armature: each rotor J_i is in the link that it turns, about the axis a_i, so that impacts meet it,
    but the joints before it feel it too. ``change`` (n,) is q'' as it shall be with J_i on the diagonal alone; w_i and
    dw_i are the link's angular velocity and its change.
    """
    n = force.size
    w, dw, total, moments = np.zeros(3), np.zeros(3), np.zeros(3), np.empty((n, 3))
    for i in range(n):
        a0, a1, a2 = screws[i, 0], screws[i, 1], screws[i, 2]
        c0, c1, c2 = w[1] * a2 - w[2] * a1, w[2] * a0 - w[0] * a2, w[0] * a1 - w[1] * a0
        dw[0] += a0 * change[i] + c0 * velocity_rad_s[i]
        dw[1] += a1 * change[i] + c1 * velocity_rad_s[i]
        dw[2] += a2 * change[i] + c2 * velocity_rad_s[i]
        for r in range(3):
            w[r] += screws[i, r] * velocity_rad_s[i]
        gain = rotor[i] * (a0 * dw[0] + a1 * dw[1] + a2 * dw[2])
        spin = rotor[i] * (a0 * w[0] + a1 * w[1] + a2 * w[2])
        moments[i, 0], moments[i, 1], moments[i, 2] = (
            gain * a0 + spin * c0,
            gain * a1 + spin * c1,
            gain * a2 + spin * c2,
        )
    for j in range(n - 1, -1, -1):
        force[j] -= rotor[j] * change[j]
        for r in range(3):
            total[r] += moments[j, r]
            force[j] += screws[j, r] * total[r]


class ArmArrays:
    """Arrays of ``arm`` in a ``game``: constants, and what ``move_chain`` finds from them in a state of the joints.

    With ``links`` the ball may touch links and handle as well as the cup.
    """

    def __init__(self, arm: RobotModel, game: GameSettings, *, links: bool) -> None:
        chain, n = compiled_chain(arm, with_tool=True), len(arm.joint_names)
        zeros = np.zeros(n)
        pose, root_m = arm.tool_pose(zeros), arm.joint_positions_m(zeros)
        rotation, shift = arm.base_pose()
        columns = (chain.axes @ rotation.T, chain.origins @ rotation.T + shift, chain.centers_m @ rotation.T + shift)
        inertia = rotation @ chain.inertia_kg_m2 @ rotation.T
        self.links = np.hstack([*columns, inertia.reshape(n, 9), chain.mass_kg[:, None], chain.rotor_kg_m2[:, None]])
        axis, tie_m = pose.rotation[:, 2], pose.position_m
        marks = [root_m[-1], tie_m + axis * (game.cup.rim_m / 2), tie_m, tie_m + axis]
        if isinstance(game.cup.tie, SideTie):
            marks.append(tie_m + pose.rotation @ game.cup.tie_m)
        self.marks = np.array(marks)
        self.radii = _radii(arm, game, links=links)
        self._gravity_m_s2 = arm.gravity_m_s2
        self.inertia, self.bias, self.screws = np.zeros((n, n)), np.zeros(n), np.zeros((n, 6))
        self.points, self.speeds = np.zeros((n + len(marks), 3)), np.zeros((len(marks), 3))

    def move(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Find inertia, bias, screws and points of the joints' ``position_rad`` and ``velocity_rad_s`` (n,)."""
        found = self.inertia, self.bias, self.screws, self.points, self.speeds
        move_chain(position_rad, velocity_rad_s, self.links, self.marks, self._gravity_m_s2, *found)

    def mark_m(self, mark: int) -> Array:
        """Return the place (3,) of a mark on the last link (ROOT and so on)."""
        return self.points[len(self.bias) + mark]


def _radii(arm: RobotModel, game: GameSettings, *, links: bool) -> Array:
    """Return the radii at which the ball's centre touches: the capsules of links and handle, if any, and the cup."""
    cup: CupSettings = game.cup
    # staves are longer than the arc between them
    around_m = float(np.hypot(cup.outer_radius_m / np.cos(np.pi / cup.staves), cup.rim_m / 2))
    # the link's handle ends at the cup's position, half the cup's height beside the point that is taken for its end
    parts = [*arm.link_radius_m, HANDLE_RADIUS_M + cup.rim_m / 2] if links else [-np.inf] * (len(arm.joint_names) + 1)
    return np.array([*parts, around_m]) + game.ball.radius_m
