"""How artifacts become files: one generic codec for the frozen dataclasses of ``kendama_cli.artifacts``.

``artifact.json`` holds the structure and every scalar, ``arrays.npz`` the arrays by their path in it. No pickle.
"""

from __future__ import annotations

import dataclasses
import io
import json
import typing
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.artifacts.demonstration import DemonstrationSet
from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.artifacts.interaction import InteractionResult
from kendama_cli.artifacts.motion_plan import CatchMotion, MotionPlan
from kendama_cli.artifacts.policy import Policy
from kendama_cli.artifacts.prediction import PredictionStudy
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.errors import StageError, StoreError
from kendama_cli.store.durable import canonical_json

KINDS: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        DemonstrationSet,
        MotionPlan,
        CatchMotion,
        FrictionModel,
        Policy,
        PredictionStudy,
        TransferResult,
        InteractionResult,
    )
}


def save_artifact(artifact: Any, folder: Path) -> None:
    """Write ``artifact.json`` and, where it has arrays, ``arrays.npz`` into ``folder``.

    Raises StageError where the artifact is not of a kind that the store knows.
    """
    kind = type(artifact).__name__
    if KINDS.get(kind) is not type(artifact):
        raise StageError(f"a stage gave a {kind}; the store keeps {', '.join(sorted(KINDS))}")
    arrays: dict[str, np.ndarray] = {}
    body = _flatten(artifact, "", arrays)
    (folder / "artifact.json").write_bytes(canonical_json({"kind": kind, "body": body}) + b"\n")
    if arrays:
        (folder / "arrays.npz").write_bytes(pack_arrays(arrays))


def load_artifact(folder: Path) -> Any:
    """The artifact that ``save_artifact`` wrote; raises StoreError where it cannot be read."""
    try:
        document = json.loads((folder / "artifact.json").read_bytes())
        packed = folder / "arrays.npz"
        arrays = unpack_arrays(packed.read_bytes()) if packed.exists() else {}
        return _restore(KINDS[document["kind"]], document["body"], "", arrays)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError(str(folder), f"cannot read the artifact in {folder}: {error}") from error


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> bytes:
    """An ``.npz`` whose bytes depend on nothing but the arrays."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(arrays):
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(arrays[name]), allow_pickle=False)
            # ZipInfo's own default date, 1980-01-01: no clock in an artifact
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), zipfile.ZIP_DEFLATED, 3)
    return buffer.getvalue()


def unpack_arrays(data: bytes) -> dict[str, np.ndarray]:
    """The arrays of ``pack_arrays``; raises ValueError for anything else."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, EOFError, OSError) as error:
        raise ValueError(str(error)) from error


def _flatten(value: Any, path: str, arrays: dict[str, np.ndarray]) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: _flatten(getattr(value, field.name), f"{path}.{field.name}".lstrip("."), arrays)
            for field in dataclasses.fields(value)
        }
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return {"array": path}
    if isinstance(value, tuple):
        return [_flatten(item, f"{path}.{i}", arrays) for i, item in enumerate(value)]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (np.floating, np.integer, np.bool_)):
        return value.item()
    raise StageError(f"an artifact cannot hold a {type(value).__name__} (at {path})")


def _restore(annotation: Any, value: Any, path: str, arrays: Mapping[str, np.ndarray]) -> Any:
    if dataclasses.is_dataclass(annotation) and isinstance(annotation, type):
        hints = typing.get_type_hints(annotation)
        return annotation(
            **{
                field.name: _restore(hints[field.name], value[field.name], f"{path}.{field.name}".lstrip("."), arrays)
                for field in dataclasses.fields(annotation)
            }
        )
    if isinstance(value, dict) and set(value) == {"array"}:
        return arrays[value["array"]]
    if typing.get_origin(annotation) is tuple:
        members = typing.get_args(annotation)
        kinds = members[:1] * len(value) if members[1:] == (Ellipsis,) else members
        return tuple(
            _restore(kind, item, f"{path}.{i}", arrays) for i, (kind, item) in enumerate(zip(kinds, value, strict=True))
        )
    options = [member for member in typing.get_args(annotation) if member is not type(None)]
    if value is not None and len(options) == 1:
        return _restore(options[0], value, path, arrays)
    return value
