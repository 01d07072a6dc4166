"""Report of installed and missing packages, with the needs of each optional part."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.errors import KendamaError, install_line
from kendama_cli.robot_model.display import SONAMES
from kendama_cli.schema.registry import declared, groups, resolve
from kendama_cli.version import __version__


@dataclass(frozen=True)
class Part:
    """One thing that kendama needs or can use; ``state`` is ok, missing or optional."""

    name: str
    state: str
    detail: str


REQUIRED = {
    "dartpy": "kendama_cli.robot_model.dart_library",
    "numpy": "numpy",
    "scipy": "scipy.optimize",
    "numba": "numba",
    "opencv-python-headless": "cv2",
    "pandas": "pandas",
    "mcap": "mcap.reader",
    "foxglove-schemas-protobuf": "foxglove_schemas_protobuf.PoseInFrame_pb2",
    "protobuf": "google.protobuf.json_format",
    "hydra-core": "hydra",
    "omegaconf": "omegaconf",
    "matplotlib": "matplotlib.backends.backend_svg",
    "cma": "cma",
    "filelock": "filelock",
    "pyyaml": "yaml",
    "rich": "rich.progress",
    "typer": "typer",
    "zstandard": "zstandard",
    "embreex": "embreex.rtcore_scene",
}
EXTRAS = {
    "starlette": ("starlette", f"kendama play: {install_line('play')}"),
    "pyarrow": ("pyarrow.parquet", f"tables in Parquet: {install_line('parquet')}"),
    "obstore": ("obstore", f"store.remote=s3://bucket/prefix: {install_line('remote')}"),
    "distributed": ("distributed", f"--on dask, --on slurm: {install_line('dask')}"),
    "gymnasium": ("gymnasium", f"the learning environment for others' agents: {install_line('gym')}"),
    "example-robot-data": ("", f"robot=ur5, ur10, panda, xarm7: {install_line('robots')}"),
}
PROBE = """
import importlib, json, sys
for name, targets in json.loads(sys.argv[1]).items():
    problem = ""
    for target in targets:
        module, _, what = target.partition(":")
        try:
            getattr(importlib.import_module(module), what or "__name__")
        except Exception as error:
            problem = " ".join(f"{type(error).__name__}: {error}".split())
    print("probed", name, problem, sep="\\t", flush=True)
"""
"""Imports modules and says of each what is wrong: in a process that a broken native library may take down."""
LACKS_EXTRA = "MissingPartError: "
"""Opening of the problem of a part that asks for an extra by itself: it is optional, as the extra is."""


def examine() -> list[Part]:
    """Import every part; one that cannot be is told with its reason and what brings it."""
    cores = os.cpu_count() or 1
    found = [Part("kendama", "ok", f"{__version__}, Python {platform.python_version()}, {cores} cores")]
    libraries = {name: [module] for name, module in REQUIRED.items()}
    extras = {name: [module] if module else [] for name, (module, _) in EXTRAS.items() if _version(name)}
    problems = _problems({**libraries, **extras})
    found += [_library(name, problems[name]) for name in REQUIRED]
    found += _display_libraries()
    for name, (_, serves) in EXTRAS.items():
        found.append(_library(name, problems[name]) if name in problems else Part(name, "optional", serves))
    return found + _declared()


def _declared() -> list[Part]:
    """Return a line for each group that packages declare, and one for each declaration with a missing or outer part."""
    targets: dict[str, list[str]] = {}
    broken: dict[str, str] = {}
    outer: dict[str, str] = {}
    for group in groups():
        for name, target in sorted(declared(group).items()):
            try:
                declaration = resolve(target, f"'{name}' of {group}")
                targets[f"{group} {name}"] = _named(declaration)
                if needs := getattr(declaration, "needs", ""):
                    outer[f"{group} {name}"] = f"needs {needs}"
            except KendamaError as error:
                broken[f"{group} {name}"] = str(error)
    for key, problem in _problems(targets).items():
        if problem.startswith(LACKS_EXTRA):
            outer[key] = problem.removeprefix(LACKS_EXTRA)
            del targets[key]
        elif problem:
            broken[key] = problem
    lines = []
    for group in groups():
        own = {key: key.split(" ", 1)[1] for key in {**targets, **broken, **outer} if key.startswith(f"{group} ")}
        names = ", ".join(name for key, name in own.items() if key in targets and key not in broken)
        lines += [Part(group, "ok", names)] if names else []
        lines += [Part(name, "missing", broken[key]) for key, name in own.items() if key in broken]
        lines += [Part(name, "optional", outer[key]) for key, name in own.items() if key in outer and key not in broken]
    return lines


def _named(declaration: Any) -> list[str]:
    """Return the ``module:name`` texts of a declaration."""
    fields = ("run", "returns", "chapter", "film", "replay", "episodes", "settings", "makes")
    named = (getattr(declaration, field, None) for field in fields)
    return [one for one in named if isinstance(one, str) and one]


def _problems(targets: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Import all ``targets``; what is wrong with each of their names, empty where nothing is."""
    found: dict[str, str] = {}
    while rest := {name: wanted for name, wanted in targets.items() if name not in found}:
        command = [sys.executable, "-P", "-c", PROBE, json.dumps(rest)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        probed = (line.split("\t") for line in done.stdout.splitlines() if line.startswith("probed\t"))
        found |= {name: problem for _, name, problem in probed}
        if died := next((name for name in rest if name not in found), None):
            found[died] = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    return found


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _library(name: str, problem: str) -> Part:
    if not problem:
        return Part(name, "ok", _version(name) or "?")
    if name == "embreex" and sys.platform == "linux" and platform.machine() == "aarch64":
        return Part(name, "optional", "has no wheel for Linux on aarch64; images of arms and meshes need it")
    return Part(name, "missing", f"{problem}; pip install {name}")


def _display_libraries() -> list[Part]:
    """Return the libraries of the system that DART's viewer alone needs; empty on macOS and Windows."""
    if sys.platform != "linux":
        return []
    probe = "from kendama_cli.robot_model.display import load_display_libraries as load; print(*load())"
    done = subprocess.run([sys.executable, "-P", "-c", probe], capture_output=True, text=True, check=False)
    ours = "not on this system; an object of ours stands in (only a viewer would miss it)"
    return [Part(name, "ok", ours if name in done.stdout.split() else "the system's") for name in SONAMES]
