"""kendama: robot learning for the ball-in-a-cup game.

    import kendama_cli as kendama
    run = kendama.run("imitation", ["robot=iiwa"])

See kendama_cli.api for what is exported; it is imported when first asked for, so that the command line starts at once.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kendama_cli.api import (
        CameraModel,
        CatchPose,
        CatchPoseEstimator,
        Demonstration,
        DmpMotion,
        LogFile,
        MotionPlan,
        Policy,
        Run,
        Swing,
        SwingState,
        configuration,
        encode,
        environment,
        estimator,
        open_run,
        play,
        policy,
        run,
        runs,
        swing,
    )
    from kendama_cli.version import __version__

MOST_PIXELS = 1 << 26
"""Limit of a decoded image; OpenCV reads it when it is imported, and has one of three gigabytes."""
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MOST_PIXELS))

__all__ = [
    "CameraModel",
    "CatchPose",
    "CatchPoseEstimator",
    "Demonstration",
    "DmpMotion",
    "LogFile",
    "MotionPlan",
    "Policy",
    "Run",
    "Swing",
    "SwingState",
    "__version__",
    "configuration",
    "encode",
    "environment",
    "estimator",
    "open_run",
    "play",
    "policy",
    "run",
    "runs",
    "swing",
]


LIGHT = {
    "__version__": "kendama_cli.version",
    "Demonstration": "kendama_cli.artifacts.demonstration",
    "MotionPlan": "kendama_cli.artifacts.motion_plan",
    **dict.fromkeys(("configuration", "encode", "play"), "kendama_cli.api_models"),
}
"""Names that are imported from their own module: without pandas, the simulator and all else that runs need."""


def __getattr__(name: str) -> Any:
    if name not in __all__:
        from kendama_cli.schema.registry import declared, resolve  # noqa: PLC0415 - parts add functions: learn_on

        if name.startswith("_") or name not in (added := declared("kendama.api")):
            raise AttributeError(f"module 'kendama_cli' has no attribute '{name}'")
        return resolve(added[name], f"kendama_cli.{name}")
    import importlib  # noqa: PLC0415 - by name: numpy, pandas and OpenCV come only where the library is used

    return getattr(importlib.import_module(LIGHT.get(name, "kendama_cli.api")), name)
