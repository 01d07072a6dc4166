"""Speed of the search for a placement on the compiled chain, and on pinocchio beside it.

``python -m tests.benchmarks.placement`` prints name, value, unit and ratio: one process, warmed up, the same problem,
random numbers and tolerances. Both sides share the search, the clearance and the limits; following the cup's path and
the motion's efforts are the chain kernel's on one side and pinocchio's (``pip install '.[benchmarks]'``), called from
Python sample by sample, on the other. The motion is the shipped demonstrations' average, the arm the PA10.

Measured on two busy cores: 3.9 s against 54 s, 13.9 times as long, with the same least cost to six digits (0.574485).
Pinocchio's own calls take microseconds; a search makes millions of them from Python. That is what the kernel is for.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.robot_model import chain_kernel as kernel
from kendama_cli.robot_model.inverse_kinematics import weighted_step
from kendama_cli.robot_model.placement import placement_search
from kendama_cli.robot_model.placement.find_placement import find_placement
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.placement import LineSettings, Placement
from tests.motion.swings import settings as encode_settings
from tests.simulation.dart.bench_robot import ROOT, adapt_values, bench_arm, kendama_game

EFFORT = 0.01
"""Share of the shipped search: both sides spend their time in the same way at any."""


class Pinocchio:
    """``follow`` and ``peaks`` of the chain kernel by pinocchio, for the one chain that a search has."""

    def __init__(self, chain: kernel.Chain) -> None:
        import pinocchio as pin  # noqa: PLC0415 - optional

        self._pin, self._chain = pin, chain
        self._model = pin.Model()
        last, parent = np.zeros(3), 0
        for i, (axis, origin) in enumerate(zip(chain.axes, chain.origins, strict=True)):
            place = pin.SE3(np.eye(3), origin - last)
            parent = self._model.addJoint(parent, pin.JointModelRevoluteUnaligned(axis), place, f"joint {i}")
            inertia = pin.Inertia(chain.mass_kg[i], chain.centers_m[i] - origin, chain.inertia_kg_m2[i])
            self._model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
            last = origin
        self._model.gravity.linear = np.array([0.0, 0.0, -chain.gravity_m_s2])
        self._data, self._tip = self._model.createData(), parent

    def _task(self, tool: kernel.ToolGeometry, angles: Array) -> tuple[Array, Array]:
        pin, data = self._pin, self._data
        pin.computeJointJacobians(self._model, data, angles)
        place = data.oMi[self._tip]
        arm = place.rotation @ (tool.tie_m - self._chain.origins[-1])
        up = place.rotation @ tool.axis
        jacobian = pin.getJointJacobian(self._model, data, self._tip, pin.LOCAL_WORLD_ALIGNED)
        linear = jacobian[:3] + np.cross(jacobian[3:].T, arm).T
        turn = np.array([up[1], -up[0]])
        if up[2] < 0:
            turn /= max(float(np.linalg.norm(turn)), 1e-9)
        return np.concatenate([place.translation + arm, turn]), np.vstack([linear, jacobian[3:5]])

    def follow(
        self, _: kernel.Chain, tool: kernel.ToolGeometry, start: kernel.IkSettings, path_m: Array, whole: bool
    ) -> tuple[Array, Array]:
        """As the kernel's, step for step."""
        home = self._task(tool, start.home)[0][:3]
        angles, missed = np.empty((len(path_m), len(start.home))), np.empty(len(path_m))
        last = start.home.copy()
        for k, place in enumerate(path_m):
            for _step in range(kernel.MOST_STEPS):
                value, jacobian = self._task(tool, last)
                change = np.concatenate([home + place - value[:3], value[3:]])
                missed[k] = np.abs(change).max()
                if missed[k] < kernel.TOLERANCE:
                    break
                step = weighted_step(jacobian, change, start.weights, kernel.DAMPING)
                last = last + step * min(1.0, kernel.LONGEST_STEP_RAD / max(float(np.abs(step).max()), 1e-12))
            angles[k] = last
            if missed[k] > kernel.REACHED and not whole:
                angles[k:], missed[k:] = last, np.inf
                break
        return angles, missed

    def peaks(self, chain: kernel.Chain, tool: kernel.ToolGeometry, curve: kernel.Curve) -> tuple[Array, Array, Array]:
        """As the kernel's; the load is a point mass at the tie point."""
        pin, q, h = self._pin, curve.angles, curve.step
        model = self._model.copy()
        load = pin.Inertia(tool.mass_kg, tool.tie_m - chain.origins[-1], np.zeros((3, 3)))
        model.appendBodyToJoint(self._tip, load, pin.SE3.Identity())
        data = model.createData()
        slope, v = (q[2:] - q[:-2]) / (2 * h), curve.velocity[1:-1, None]
        speed, bend = slope * v, (q[2:] - 2 * q[1:-1] + q[:-2]) / h**2 * v**2
        strongest, hardest = np.zeros(q.shape[1]), np.zeros(q.shape[1])
        for sign in (1.0, -1.0)[: 1 if curve.acceleration == 0.0 else 2]:
            change = bend + sign * slope * curve.acceleration
            strongest = np.maximum(strongest, np.abs(change).max(axis=0))
            for k in range(0, len(change), kernel.EFFORT_EVERY):
                torque = pin.rnea(model, data, q[k + 1], speed[k], change[k])
                ratio = speed[k] / chain.stribeck_rad_s
                dry = chain.coulomb_nm + chain.stribeck_nm * np.exp(-ratio * ratio)
                torque = torque + chain.viscous_nm_s * speed[k] + dry * np.sign(speed[k])
                hardest = np.maximum(hardest, np.abs(torque))
        return np.abs(speed).max(axis=0), strongest, hardest


@contextmanager
def on_pinocchio() -> Iterator[None]:
    """The search follows paths and takes efforts by pinocchio while this lasts."""
    ours = placement_search.follow, placement_search.peaks
    made: dict[int, Pinocchio] = {}

    def of(chain: kernel.Chain) -> Pinocchio:
        if id(chain) not in made:
            made[id(chain)] = Pinocchio(chain)
        return made[id(chain)]

    placement_search.follow = lambda chain, *rest: of(chain).follow(chain, *rest)
    placement_search.peaks = lambda chain, *rest: of(chain).peaks(chain, *rest)
    try:
        yield
    finally:
        placement_search.follow, placement_search.peaks = ours


def shipped_motion() -> MotionPlan:
    """The primitive of the bundled demonstrations."""
    swings = []
    for file in sorted((ROOT / "data/demonstrations").glob("swing-*.csv")):
        rows = np.loadtxt(file, delimiter=",", skiprows=3)
        swings.append(Demonstration(file.stem, rows[:, 0], rows[:, 1:4]))
    return encode_demonstrations(swings, encode_settings())


def search(plan: MotionPlan) -> tuple[float, float, Placement]:
    """Seconds of one ``find_placement``, the least cost that it found, and where."""
    values, costs = adapt_values(), [np.inf]
    began = time.perf_counter()
    found = find_placement(
        bench_arm(),
        kendama_game(),
        plan,
        values["lead_in_m_s2"],
        line=LineSettings(**values["line"]),
        effort=EFFORT,
        progress=lambda done, total, cost: costs.append(cost),
    )
    return time.perf_counter() - began, costs[-1], found


def main() -> None:
    """Print the table."""
    plan = shipped_motion()
    search(plan)
    spent, cost, _ = search(plan)
    print(f"{'search on the compiled chain':34s} {spent:8.2f} s   least cost {cost:.6f}")
    try:
        with on_pinocchio():
            theirs, their_cost, _ = search(plan)
    except ImportError:
        print("pinocchio is not installed: no peer")
        return
    ratio = f"{theirs / spent:.1f} x the chain's"
    print(f"{'search on pinocchio':34s} {theirs:8.2f} s   least cost {their_cost:.6f}   {ratio}")


if __name__ == "__main__":
    main()
