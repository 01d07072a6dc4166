"""Dynamics of a simulated arm by compiled code, from the positions and velocities that DART gives."""

from __future__ import annotations

import numpy as np

from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, GameSettings, SideTie
from kendama_cli.simulation.dart import dynamics_kernel


class ArmDynamics:
    """Inertia H (n, n), bias C q' + g (n,), screws (n, 6) and points of ``arm`` after ``observe``.

    The arrays are those on which compiled code works (dynamics_kernel.move_chain): they change with every call. From
    the constants ``links``, ``marks`` and ``radii`` compiled code finds the same for itself (step_kernel.step_forces).
    """

    def __init__(self, arm: RobotModel, game: GameSettings | None, *, links: bool) -> None:
        chain, n = compiled_chain(arm, with_tool=True), len(arm.joint_names)
        zeros = np.zeros(n)
        pose, root_m = arm.tool_pose(zeros), arm.joint_places_m(zeros)
        rotation, shift = arm.base_pose()
        columns = (chain.axes @ rotation.T, chain.origins @ rotation.T + shift, chain.centers_m @ rotation.T + shift)
        inertia = rotation @ chain.inertia_kg_m2 @ rotation.T
        self.links = np.hstack([*columns, inertia.reshape(n, 9), chain.mass_kg[:, None], chain.rotor_kg_m2[:, None]])
        cup = game.cup if game is not None else None
        axis, tie_m = pose.rotation[:, 2], pose.position_m
        middle_m = tie_m + axis * (cup.rim_m / 2 if cup is not None else 0.0)
        marks = [root_m[-1], middle_m, tie_m, tie_m + axis]
        if cup is not None and isinstance(cup.tie, SideTie):
            marks.append(tie_m + pose.rotation @ cup.tie_m)
        self.marks = np.array(marks)
        self._gravity_m_s2 = arm.gravity_m_s2
        self.radii = np.full(n + 2, -1.0) if game is None else _radii(arm, game, links=links)
        self.inertia, self.bias, self.screws = np.zeros((n, n)), np.zeros(n), np.zeros((n, 6))
        self.points, self.mark_speeds = np.zeros((n + len(self.marks), 3)), np.zeros_like(self.marks)

    def carry_rotors(self, velocity_rad_s: Array, acceleration_rad_s2: Array, force_nm: Array) -> Array:
        """Return ``force_nm`` (n,) plus the rotors' part for DART (dynamics_kernel.carry_rotors) after ``observe``."""
        force = np.array(force_nm)
        dynamics_kernel.carry_rotors(
            self.screws, velocity_rad_s, acceleration_rad_s2, self.links[:, dynamics_kernel.ROTOR], force
        )
        return force

    def observe(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Take the arm's state (n,) from DART."""
        dynamics_kernel.move_chain(
            position_rad, velocity_rad_s, self.links, self.marks, self._gravity_m_s2, self.inertia, self.bias,
            self.screws, self.points, self.mark_speeds,
        )  # fmt: skip


def _radii(arm: RobotModel, game: GameSettings, *, links: bool) -> Array:
    """Return the radii at which the ball's centre touches: the capsules of links and handle, if any, and the cup."""
    cup: CupSettings = game.cup
    # staves are longer than the arc between them
    around_m = float(np.hypot(cup.outer_radius_m / np.cos(np.pi / cup.staves), cup.rim_m / 2))
    # the link's handle ends at the cup's position, half the cup's height beside the point that is taken for its end
    parts = [*arm.link_radius_m, HANDLE_RADIUS_M + cup.rim_m / 2] if links else [-np.inf] * (len(arm.joint_names) + 1)
    return np.array([*parts, around_m]) + game.ball.radius_m
