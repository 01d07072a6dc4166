"""Phones as cups: simulated recordings of a swing, and the plain integration that a reconstruction must beat."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.phone.settings import PhoneCapture
from kendama_cli.schema.settings import build

ROOT = Path(__file__).resolve().parents[3]
SHARED = ROOT.parent / "shared" / "data"
REAL = SHARED / "phone"
PERSON = SHARED / "li-kendama" / "kendama1-20.txt"


def settings(path, **changes) -> PhoneCapture:
    data = yaml.safe_load((ROOT / "conf" / "capture" / "phone.yaml").read_text()) | {"path": path}
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return build(PhoneCapture, data, "capture")


def bundled_swing(number: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return times and places of a bundled demonstration."""
    file = ROOT / "data" / "demonstrations" / f"swing-{number:02d}.csv"
    rows = np.loadtxt(file, delimiter=",", comments=("#", "t"))
    return rows[:, 0], rows[:, 1:]


def person_swing(file: Path = PERSON) -> tuple[np.ndarray, np.ndarray]:
    """Return a person's recorded swing at 100 Hz."""
    rows = np.loadtxt(file)[:350]
    return np.arange(len(rows)) / 100, np.column_stack([-rows[:, 1], 0 * rows[:, 1], rows[:, 3]]) / 1e3


@dataclass(frozen=True)
class Take:
    """A simulated recording: sensors at their stamps, and the true path and rotation at the true times."""

    t_s: np.ndarray
    force: np.ndarray
    rate: np.ndarray
    true_s: np.ndarray
    true_m: np.ndarray
    true_rotation: Rotation


@dataclass(frozen=True)
class Sensors:
    """Errors of a phone's sensors (standard deviations): biases, white noise of a sample at 100 Hz, stray of stamps.

    Scale and cross-axis errors are 0.4 % of the accelerometer and 0.6 % of the gyroscope, by assumption.
    """

    bias_m_s2: float = 0.08
    noise_m_s2: float = 0.03
    bias_rad_s: float = 0.01
    noise_rad_s: float = 0.004
    stray_s: float = 0.0005


USUAL = Sensors()
BMI270 = Sensors(noise_m_s2=0.0111, bias_rad_s=np.radians(0.5), noise_rad_s=np.radians(0.0495))
"""Bosch Sensortec, BMI270 data sheet BST-BMI270-DS000: 160 ug/sqrt(Hz) and 7 mdps/sqrt(Hz) over 50 Hz, zero-rate offset
0.5 deg/s. Its users measured up to 3 deg/s, and the BMI160's sheet allows them. The accelerometer's bias is assumed."""
BMI160 = Sensors(noise_m_s2=0.0125, bias_rad_s=np.radians(3.0), noise_rad_s=np.radians(0.0495))
"""The same with the BMI160's zero-rate offset of 3 deg/s, and a little more noise, which is assumed."""

UPRIGHT = Rotation.from_matrix([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from the axes of a phone, top edge up and screen towards the player, to the room's."""


def take(
    rng,
    swing,
    *,
    lean_deg=20.0,
    grade=1.0,
    rate_hz=100.0,
    rests_s=(1.0, 1.0),
    limit_m_s2=None,
    lost=0.0,
    held=None,
    sensors=USUAL,
) -> Take:
    """Return a phone's recording of a swing: ``grade`` 1 is usual, 0 without any error; it is held anyhow by default.

    A fraction of the samples is lost. The hand leans with its velocity, and turns about the others at random.
    """
    t_s, place_m = swing
    step_s = t_s[1] - t_s[0]
    before, after = (round(one / step_s) for one in rests_s)
    path = np.concatenate([np.repeat(place_m[:1], before, 0), place_m, np.repeat(place_m[-1:], after, 0)])
    width = 2 * round(0.07 / step_s) + 1
    path = savgol_filter(savgol_filter(path, width, 4, axis=0), width, 4, axis=0)
    spline = CubicSpline(np.arange(len(path)) * step_s, path)
    end_s = (len(path) - 1) * step_s
    times = np.arange(round(end_s * rate_hz)) / rate_hz
    moving = (times > rests_s[0]) & (times < end_s - rests_s[1])
    window = np.zeros(len(times))
    window[moving] = np.hanning(moving.sum())
    fine = np.linspace(0, end_s, 12)
    wobble = [0.3 * lean_deg * CubicSpline(fine, rng.normal(size=12))(times) * window for _ in range(2)]
    velocity = spline(times, 1)
    along = savgol_filter(velocity[:, 0], 2 * round(0.05 * rate_hz) + 1, 3)
    angles = np.column_stack([lean_deg * along / np.abs(along).max(), *wobble])
    turning = CubicSpline(times, angles)
    anyhow = Rotation.random(random_state=int(rng.integers(2**31)))
    held = anyhow if held is None else held
    rotation = Rotation.from_euler("yxz", turning(times), degrees=True) * held
    ahead, behind = (Rotation.from_euler("yxz", turning(times + d), degrees=True) * held for d in (1e-4, -1e-4))
    rate = (behind.inv() * ahead).as_rotvec() / 2e-4
    force = rotation.inv().apply(spline(times, 2) + np.array([0.0, 0.0, 9.81]))
    own, its = (np.eye(3) + grade * rng.normal(0, one, (3, 3)) for one in (0.004, 0.006))
    noise = np.sqrt(rate_hz / 100)
    force = force @ own.T + grade * (
        rng.normal(0, sensors.bias_m_s2, 3) + noise * rng.normal(0, sensors.noise_m_s2, force.shape)
    )
    rate = rate @ its.T + grade * (
        rng.normal(0, sensors.bias_rad_s, 3) + noise * rng.normal(0, sensors.noise_rad_s, rate.shape)
    )
    if limit_m_s2 is not None:
        force = np.clip(force, -limit_m_s2, limit_m_s2)
    stamps = times + grade * rng.normal(0, sensors.stray_s, len(times)) * min(1.0, 100 / rate_hz)
    kept = rng.random(len(times)) >= lost
    return Take(stamps[kept], force[kept], rate[kept], times, spline(times), rotation)


def plain_path(t_s, force, rate, rest_s: float = 0.8) -> np.ndarray:
    """Integrate twice from the first rest alone: its bias, its vertical, and nothing of the end."""
    rest = t_s - t_s[0] < rest_s
    rate = rate - rate[rest].mean(axis=0)
    up = force[rest].mean(axis=0)
    rotation = Rotation.align_vectors([[0, 0, 1]], [up / np.linalg.norm(up)])[0]
    turns = [rotation]
    for w, dt in zip((rate[1:] + rate[:-1]) / 2, np.diff(t_s), strict=True):
        turns.append(turns[-1] * Rotation.from_rotvec(w * dt))
    acceleration = Rotation.concatenate(turns).apply(force) - [0, 0, np.linalg.norm(up)]
    steps = np.diff(t_s)[:, None]
    velocity = np.vstack([np.zeros((1, 3)), np.cumsum((acceleration[1:] + acceleration[:-1]) / 2 * steps, axis=0)])
    return np.vstack([np.zeros((1, 3)), np.cumsum((velocity[1:] + velocity[:-1]) / 2 * steps, axis=0)])


def turned_onto(path: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Turn a path about the vertical only, as near to the truth as it goes: its heading is not seen."""
    a, b = (one - one.mean(axis=0) for one in (path, truth))
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a[:, :2] * b[:, :2]).sum())
    return Rotation.from_rotvec([0, 0, angle]).apply(path)


def rms_m(path: np.ndarray, truth: np.ndarray) -> float:
    """Return the error of a path after its mean and heading are laid on the truth [m]."""
    e = turned_onto(path, truth)
    e = (e - e.mean(axis=0)) - (truth - truth.mean(axis=0))
    return float(np.sqrt((e**2).sum(axis=1).mean()))


def write_phyphox(path: Path, t_s, force, rate) -> Path:
    """Write a zip as phyphox does, of its simple experiment."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, unit, values in (("Accelerometer", "m/s^2", force), ("Gyroscope", "rad/s", rate)):
            rows = "\n".join(",".join(f"{v:.9E}" for v in row) for row in np.column_stack([t_s, values]))
            head = ",".join(f'"{one}"' for one in ("Time (s)", *(f"{axis} ({unit})" for axis in "XYZ")))
            archive.writestr(f"{name}.csv", f"{head}\n{rows}\n")
        archive.writestr("meta/device.csv", '"property","value"\n"deviceModel","test"\n')
    return path
