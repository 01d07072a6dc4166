"""Demonstrations: recorded swings of a person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array, rising, set_arrays


@dataclass(frozen=True)
class Demonstration:
    """One recorded swing of the cup.

    ``t_s`` (n,) rises strictly; ``position_m`` (n, 3) is the cup in a frame whose z points up and whose x lies in the
    swing plane. ``rotation_wxyz`` (n, 4) are unit quaternions that rotate the upright cup; None where only positions
    were recorded.
    """

    name: str
    t_s: Array
    position_m: Array
    rotation_wxyz: Array | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "t_s", rising("t_s", self.t_s))
        set_arrays(self, position_m=(len(self.t_s), 3))
        if self.rotation_wxyz is not None:
            set_arrays(self, rotation_wxyz=(len(self.t_s), 4))
            if np.abs(np.linalg.norm(self.rotation_wxyz, axis=1) - 1).max() > 1e-6:
                raise ValueError(f"rotation_wxyz of '{self.name}' holds quaternions that are not of unit length")
        if len(self.t_s) < 3:
            raise ValueError(f"a demonstration needs at least 3 samples, '{self.name}' has {len(self.t_s)}")

    @property
    def duration_s(self) -> float:
        """Duration from the first to the last sample [s]."""
        return float(self.t_s[-1] - self.t_s[0])

    @property
    def peak_speed_m_s(self) -> float:
        """Largest speed of the cup between neighbouring samples [m/s]."""
        steps = np.diff(self.position_m, axis=0) / np.diff(self.t_s)[:, None]
        return float(np.linalg.norm(steps, axis=1).max())


@dataclass(frozen=True)
class DemonstrationSet:
    """All demonstrations of one task, in the order in which they were given."""

    demonstrations: tuple[Demonstration, ...]

    def __post_init__(self) -> None:
        if not self.demonstrations:
            raise ValueError("a set of demonstrations cannot be empty")
