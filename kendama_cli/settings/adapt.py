"""How the primitive is adapted to the arm: which tau are tried, and what a robust catch must stand."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.errors import ConfigError
from kendama_cli.settings.schema import setting


@dataclass(frozen=True)
class PerturbationSettings:
    """What differs from repeat to repeat, drawn anew each time."""

    rope_m: float = setting("uniform +- error of the rope's length [m]", at_least=0)
    ball_start_m: float = setting("uniform +- offset of the ball's start along x [m]", at_least=0)
    joint_noise_rad: float = setting("standard deviation of the joint angles read, every step [rad]", at_least=0)
    joint_friction_nm: float = setting("uniform up to this: Coulomb friction that nobody models [Nm]", at_least=0)


@dataclass(frozen=True)
class AdaptSettings:
    """The search for the catch in the closed loop of the arm."""

    perturbation: PerturbationSettings
    tau_range: tuple[float, float] = setting("least and largest tau_scale to try", above=0)
    tau_start: float = setting("tau_scale tried first", above=0)
    tau_step: float = setting("spacing of the tau_scale grid on which windows are looked for", above=0)
    tau_resolution: float = setting("windows narrower than this are not looked for", above=0)
    amplitudes: tuple[float, ...] = setting("factors on the motion's size, tried in turn if tau alone fails", above=0)
    max_rollouts: int = setting("rollouts of the search without those that judge its finds", at_least=1)
    judge_repeats: int = setting("perturbed repeats by which every window found is judged", at_least=1)
    repeats: int = setting("fresh perturbed repeats of the chosen motion: success_rate is over these", at_least=1)
    hold_s: float = setting("how long the cup is held after the motion [s]", above=0)
    lead_in_m_s2: float = setting("acceleration that brings the cup to a motion that begins moving [m/s^2]", above=0)

    def __post_init__(self) -> None:
        low, high = self.tau_range
        if not low <= self.tau_start <= high:
            raise ConfigError("tau_start", f"'tau_start' is {self.tau_start}; allowed: {low} to {high} (tau_range)")
