"""The one import of DART: where its system library is missing, one line says what brings it."""

from __future__ import annotations

from typing import Any

from kendama_cli.errors import MissingPartError

try:
    import dartpy
except ImportError as error:  # the wheel links against libGL although nothing here draws
    if "libGL" in str(error):
        raise MissingPartError(
            "libGL.so.1", "the simulator DART needs the system library libGL.so.1: apt-get install libgl1"
        ) from error
    raise MissingPartError("dartpy", f"the simulator DART cannot be loaded ({error}): pip install dartpy") from error

__all__ = ["awake_world", "dartpy"]


def awake_world(step_s: float, gravity_m_s2: float) -> Any:
    """An empty world with gravity along -z that never puts a body to sleep, as DART's does by default.

    Contacts are Bullet's, never FCL's, DART's default, which takes capsules for spheres and lets a fast ball tunnel.
    """
    world = dartpy.simulation.World()
    world.setTimeStep(step_s)
    world.setGravity([0.0, 0.0, -gravity_m_s2])
    sleep = world.getDeactivationOptions()
    sleep.mEnabled = False
    world.setDeactivationOptions(sleep)
    world.getConstraintSolver().setCollisionDetector(dartpy.collision.BulletCollisionDetector())
    return world
