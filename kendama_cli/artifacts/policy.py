"""Policies: what was learned, with all that is needed to act by it on any machine."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array, array
from kendama_cli.schema.json_text import json_text


@dataclass(frozen=True)
class NamedArray:
    """One array of a policy."""

    name: str
    values: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", array(self.name, self.values, (None,) * np.ndim(self.values)))


@dataclass(frozen=True)
class PolicyArtifact:
    """A policy for the swing-up, of any learner.

    ``kind`` names the learner whose policy it is, ``arrays`` hold what it learned. ``meaning`` is the canonical JSON of
    the settings that must be the same wherever it is acted by (bins, actions, goal); ``digest`` seals all of it, so
    that hardware can refuse what it was not made for.
    """

    kind: str
    meaning: str
    arrays: tuple[NamedArray, ...]
    digest: str

    def __post_init__(self) -> None:
        names = [entry.name for entry in self.arrays]
        if len(set(names)) < len(names):
            raise ValueError(f"the arrays of a policy must have names of their own, not {', '.join(names)}")

    @staticmethod
    def seal(kind: str, meaning: Mapping[str, object], arrays: Mapping[str, Array]) -> PolicyArtifact:
        """Return a policy with its digest computed; ``meaning`` holds JSON values."""
        text = json_text(meaning)
        named = tuple(NamedArray(name, values) for name, values in sorted(arrays.items()))
        return PolicyArtifact(kind, text, named, policy_digest(kind, text, named))

    def array(self, name: str) -> Array:
        """Return the array called ``name``; raises ValueError, naming those there are, where it has none."""
        for entry in self.arrays:
            if entry.name == name:
                return entry.values
        known = ", ".join(entry.name for entry in self.arrays) or "none"
        raise ValueError(f"the policy has no array '{name}'; it has {known}")


def policy_digest(kind: str, meaning: str, arrays: tuple[NamedArray, ...]) -> str:
    """Return the SHA-256 over kind, meaning, and the names, shapes and little-endian bytes of the arrays."""
    seal = hashlib.sha256(json.dumps([kind, meaning]).encode())
    for entry in arrays:
        seal.update(json.dumps([entry.name, entry.values.shape]).encode())
        seal.update(entry.values.astype("<f8").tobytes())
    return seal.hexdigest()
