"""The one import of DART; where it cannot be loaded, one line says what brings it."""

from __future__ import annotations

from typing import Any

from kendama_cli.errors import MissingPartError
from kendama_cli.robot_model.display import load_display_libraries

STOOD_IN = load_display_libraries()
"""Display libraries that this system lacks and that objects of our own stand in for."""

try:
    import dartpy
except ImportError as error:
    if "libGL" in str(error) or "libX11" in str(error):  # on a machine for which we ship no stand-in
        raise MissingPartError(
            "libGL.so.1", f"the simulator DART needs libGL.so.1 and libX11.so.6 ({error}): apt-get install libgl1"
        ) from error
    raise MissingPartError("dartpy", f"the simulator DART cannot be loaded ({error}): pip install dartpy") from error

__all__ = ["STOOD_IN", "awake_world", "dartpy"]


def awake_world(step_s: float, gravity_m_s2: float) -> Any:
    """Return an empty world with gravity along -z that never puts a body to sleep, as DART's does by default.

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
