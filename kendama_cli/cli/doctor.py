"""What is installed, what is missing, and what each optional part would need."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import platform
import subprocess
import sys
from dataclasses import dataclass

import kendama_cli
from kendama_cli.errors import KendamaError, install_line
from kendama_cli.robot_model.display import SONAMES
from kendama_cli.schema.declaration import NODES, STAGES
from kendama_cli.schema.registry import declared, resolve


@dataclass(frozen=True)
class Part:
    """One thing that kendama needs or can use; ``state`` is ok, missing or optional."""

    name: str
    state: str
    detail: str


REQUIRED = {
    "dartpy": "kendama_cli.robot_model.dart_library",
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "opencv-python-headless": "cv2",
    "pandas": "pandas",
    "pyarrow": "pyarrow",
    "mcap": "mcap",
    "foxglove-schemas-protobuf": "foxglove_schemas_protobuf",
    "hydra-core": "hydra",
    "matplotlib": "matplotlib",
}
EXTRAS = {
    "example-robot-data": f"robot=ur5, ur10, panda, xarm7: {install_line('robots')}",
    "starlette": f"kendama play: {install_line('play')}",
    "obstore": f"store.remote=s3://bucket/prefix: {install_line('remote')}",
    "distributed": f"--on dask, --on slurm: {install_line('dask')}",
    "gymnasium": f"the learning environment for others' agents: {install_line('gym')}",
}
DEVICES = {
    "capture=mocap": "a motion capture system that streams rigid bodies",
    "capture=haptic": "a haptic device behind an OpenIGTLink server",
    "camera=device": "a camera that OpenCV can open",
    "hardware=rsi": "a KUKA controller with RobotSensorInterface: docs/rsi.md",
    "hardware=command": "a controller that speaks the protocol of docs/protocol.md",
}


BLOCKS = ("hands", "cameras", "robots", "controllers", "detectors", "learners")
GROUPS = (STAGES, NODES, *(f"kendama.{block}" for block in BLOCKS))
"""The entry point groups by which packages bring parts."""


def examine() -> list[Part]:
    """Try every part; an import that fails is told with what brings it."""
    cores = os.cpu_count() or 1
    found = [Part("kendama", "ok", f"{kendama_cli.__version__}, Python {platform.python_version()}, {cores} cores")]
    found += [_library(name, module) for name, module in REQUIRED.items()]
    found += [*_display_libraries(), _embree()]
    found += [_extra(name, needs) for name, needs in EXTRAS.items()]
    found += [Part(name, "optional", f"needs {needs}") for name, needs in DEVICES.items()]
    return found + [part for group in GROUPS for part in _declared(group)]


def _declared(group: str) -> list[Part]:
    """What packages declare in ``group``, in one line; and a line for each declaration that cannot be imported."""
    names, broken = [], []
    for name, target in sorted(declared(group).items()):
        try:
            resolve(target, f"'{name}' of {group}")
            names.append(name)
        except KendamaError as error:
            broken.append(Part(name, "missing", str(error)))
    return [*([Part(group, "ok", ", ".join(names))] if names else []), *broken]


def _extra(name: str, serves: str) -> Part:
    try:
        return Part(name, "ok", importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Part(name, "optional", serves)


def _embree() -> Part:
    """Required but where there is no wheel of it: cameras without it draw everything but meshes."""
    part = _library("embreex", "embreex.rtcore_scene")
    if part.state == "missing" and sys.platform == "linux" and platform.machine() == "aarch64":
        return Part("embreex", "optional", "has no wheel for Linux on aarch64; images of arms and meshes need it")
    return part


def _display_libraries() -> list[Part]:
    """Which of the libraries that DART's viewer alone wants are the system's; none on macOS and Windows."""
    if sys.platform != "linux":
        return []
    probe = "from kendama_cli.robot_model.display import load_display_libraries as load; print(*load())"
    done = subprocess.run([sys.executable, "-P", "-c", probe], capture_output=True, text=True, check=False)
    ours = "not on this system; an object of ours stands in (only a viewer would miss it)"
    return [Part(name, "ok", ours if name in done.stdout.split() else "the system's") for name in SONAMES]


def _library(name: str, module: str) -> Part:
    # a process of its own: a broken native library may take its process down
    probe = subprocess.run(
        [sys.executable, "-P", "-c", f"import {module}"], capture_output=True, text=True, check=False
    )
    if probe.returncode == 0:
        return Part(name, "ok", importlib.metadata.version(name))
    lines = probe.stderr.strip().splitlines()
    reason = lines[-1] if lines else f"exit code {probe.returncode}"
    return Part(name, "missing", f"{reason}; pip install {name}")
