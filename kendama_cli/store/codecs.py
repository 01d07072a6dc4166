"""Files of artifacts, by the dataclass that their stage declares as its output.

``artifact.json`` holds the structure and every scalar, ``arrays.npz`` the arrays by their path in it. No pickle, and
no name of a type: who reads an artifact says what it must be.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.errors import StageError, StoreError
from kendama_cli.schema.artifacts import from_plain, to_plain, type_name
from kendama_cli.schema.unpacking import MAX_ARRAYS_BYTES, check_size, unpacked_arrays
from kendama_cli.store.durable import canonical_json


def save_artifact(declared: type, artifact: Any, folder: Path, what: str = "a stage") -> None:
    """Write ``artifact.json`` and, where it has arrays, ``arrays.npz`` into ``folder``.

    Raises StageError, naming ``what`` returned it, where the artifact is anything else than ``declared``.
    """
    if type(artifact) is not declared:
        raise StageError(f"{what} returned a {type_name(type(artifact))}; its declaration says {type_name(declared)}")
    try:
        body, arrays = to_plain(declared, artifact)
        data = canonical_json(body) + b"\n"
        packed = pack_arrays(arrays)
    except ValueError as error:  # text that is not UTF-8, too
        raise StageError(f"{what} returned a {type_name(declared)} that cannot be stored: {error}") from error
    (folder / "artifact.json").write_bytes(data)
    if arrays:
        (folder / "arrays.npz").write_bytes(packed)


def load_artifact(declared: Any, folder: Path) -> Any:
    """Return the artifact of type ``declared`` (or one of a union of types) that ``save_artifact`` wrote.

    Raises StoreError where there is none that can be read.
    """
    try:
        body = json.loads((folder / "artifact.json").read_bytes())
        packed = folder / "arrays.npz"
        arrays = unpacked_arrays(packed.read_bytes()) if packed.exists() else {}
        return from_plain(declared, body, arrays)
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise StoreError(
            str(folder), f"cannot read the {type_name(declared)} in {folder}: {' '.join(str(error).split())}"
        ) from error


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return an ``.npz`` whose bytes depend on nothing but the arrays; raises ValueError for more than are unpacked."""
    check_size(sum(one.nbytes for one in arrays.values()), MAX_ARRAYS_BYTES)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(arrays):
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asarray(arrays[name], order="C"), allow_pickle=False)
            # ZipInfo's own default date, 1980-01-01: no clock in an artifact
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), zipfile.ZIP_DEFLATED, 3)
    return buffer.getvalue()
