"""Settings of the adaptation of a primitive to the arm: the tau that are tried, and what a robust catch tolerates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.settings.placement import LineSettings
from kendama_cli.vision.settings import MotionSettings, OnsetSettings


@dataclass(frozen=True)
class UncertaintySettings:
    """Uncertainty of kendama and arm: sampled for every rollout that evaluates a motion, mostly uniformly.

    The cup's error is a sine along the world's x of a frequency (sampled on a logarithmic scale) and an own phase. It
    stands for calibration, compliance and vibration, which unlike noise do not average out.
    """

    name: str = setting("name in reports")
    rope_m: float = setting("+- error of the rope's length [m]", at_least=0)
    ball_start_m: float = setting("+- offset of the ball's start along x [m]", at_least=0)
    mass_fraction: float = setting("+- error of the ball's mass, as a fraction of it", at_least=0, below=1)
    drag_scale: tuple[float, float] = setting(
        "minimum and maximum factor on the air's force, sampled on a logarithmic scale", above=0
    )
    restitution: tuple[float, float] = setting("minimum and maximum of ball and cup", at_least=0, at_most=1)
    lag_s: tuple[float, float] = setting("minimum and maximum first-order lag of the arm [s]", at_least=0)
    cup_error_m: float = setting("amplitude of the cup's slow error along x [m]", at_least=0)
    cup_error_hz: tuple[float, float] = setting("minimum and maximum frequency of that error [Hz]", above=0)
    joint_noise_rad: float = setting("standard deviation of the joint angles read, every step [rad]", at_least=0)
    joint_friction_nm: float = setting("up to this: Coulomb friction that nobody models [Nm]", at_least=0)
    joint_friction_fraction: float = setting("fraction of each joint's friction that nobody models, always", at_least=0)
    min_reach_m: float = setting(
        "a visual catch must be able to move the cup so far to either side while the ball flies [m]", at_least=0
    )

    def __post_init__(self) -> None:
        for name in ("drag_scale", "restitution", "lag_s", "cup_error_hz"):
            low, high = getattr(self, name)
            if low > high:
                raise ConfigError(name, f"'{name}' is {[low, high]}; allowed: minimum, then maximum")


@dataclass(frozen=True)
class SensorModelSettings:
    """Sensor model of simulated rollouts: the ball's position with noise, at a camera's rate, and late."""

    rate_hz: float = setting("positions of the ball per second", above=0, at_most=1000)
    sigma_m: tuple[float, float, float] = setting(
        "their standard deviations along x, y and z of the world [m]", above=0
    )
    latency_s: float = setting("time from the centre of the exposure to the command that uses it [s]", at_least=0)
    observe_from_deg: float = setting(
        "the test for free flight runs while the rope rises beyond this angle [deg]", at_least=0, below=180
    )
    onset: OnsetSettings = setting("time at which the rope goes slack")
    motion: MotionSettings = setting("confidence that the ball follows gravity and drag")


@dataclass(frozen=True)
class CorrectionSettings:
    """Correction of the planned motion by a visual catch: the cup is moved beside its plan."""

    acceleration_m_s2: float = setting("maximum acceleration beside the plan's [m/s^2]", above=0)
    max_shift_m: float = setting("maximum distance of the cup from its plan, before the catch or after it [m]", above=0)
    matching: float = setting(
        "part of the ball's horizontal speed that the cup wants to have at the catch", at_least=0, at_most=1
    )
    below_rim_m: float = setting("the cup is aimed at where the ball's centre is this far below the rim [m]")
    max_sigma_m: float = setting("the cup follows estimates that are better than this [m]", above=0)
    freeze_before_catch_s: float = setting("the plan is kept as it is for this long before the catch [s]", above=0)
    braking_m_s2: float = setting("deceleration of the shift after the catch [m/s^2]", above=0)


@dataclass(frozen=True)
class PolicySettings:
    """Settings of the search for the motion's shape (bumps on its path, goal and tau) in generations of rollouts."""

    bumps: int = setting("bumps along x, and as many along z, equal in time", at_least=1, at_most=12)
    spread_m: float = setting("first standard deviation of the bumps' heights and of the goal [m]", above=0)
    spread_tau: float = setting("first standard deviation of the logarithm of tau_scale", above=0)
    goal_moves: tuple[float, float] = setting(
        "fraction of the motion within which the goal's move is made", at_least=0, at_most=1
    )
    generation: int = setting("rollouts between two changes of the policy, in one perturbed simulation", at_least=4)
    max_rollouts: int = setting("rollouts of the search, without the repeats that evaluate it", at_least=4)
    stop_at: tuple[int, int] = setting(
        "the search ends when so many of so many repeats after a generation are caught", at_least=1
    )
    elite: int = setting("power: the best rollouts of all, from which the policy is made", at_least=1)
    reward_m: float = setting("power: a miss larger by this is worth 1/e", above=0)

    def __post_init__(self) -> None:
        first, last = self.goal_moves
        if not first < last:
            raise ConfigError("goal_moves", f"'goal_moves' is {[first, last]}; allowed: start, then end")
        caught, repeats = self.stop_at
        if caught > repeats:
            raise ConfigError("stop_at", f"'stop_at' is {[caught, repeats]}; allowed: caught, then of how many")
        if self.max_rollouts < self.generation:
            raise ConfigError(
                "max_rollouts",
                f"'max_rollouts' is {self.max_rollouts}; allowed: at least one generation, {self.generation}",
            )


@dataclass(frozen=True)
class AdaptSettings:
    """Settings of the search for the catch in the closed loop of the arm."""

    uncertainty: UncertaintySettings
    sensor_model: SensorModelSettings
    correction: CorrectionSettings
    line: LineSettings
    policy: PolicySettings
    search: Literal["tau", "aim", "cma", "power", "random"] = setting(
        "tau: windows of tau, then goal and size; aim: the motion is changed by what each rollout missed; cma, "
        "power: the motion's shape; random: their baseline"
    )
    simulations: Literal["fresh", "held"] = setting(
        "fresh: every rollout is perturbed anew; held: one perturbed simulation, as one real arm and kendama, in which "
        "only the ball's start and the noise are new"
    )
    swing_scale: float = setting("factor on the motion's size with which every search begins", above=0)
    catch: Literal["visual", "open_loop"] = setting(
        "visual: while the ball flies the cup goes where it is seen to come down; open_loop: the motion plays as "
        "planned"
    )
    placement: Literal["fixed", "search"] = setting(
        "fixed: the arm stands as conf/robot says; search: a placement is found for this motion first"
    )
    tau_range: tuple[float, float] = setting("minimum and maximum tau_scale to try", above=0)
    tau_start: float = setting("tau_scale tried first", above=0)
    tau_step: float = setting("spacing of the tau_scale grid on which windows are looked for", above=0)
    tau_resolution: float = setting("windows narrower than this are not looked for", above=0)
    amplitudes: tuple[float, ...] = setting("factors on the motion's size, tried in turn if all else fails", above=0)
    max_shift_m: float = setting("maximum shift of the goal while the ball flies, if tau alone fails [m]", at_least=0)
    max_rollouts: int = setting("rollouts of the search without those that evaluate its finds", at_least=1)
    repeats: int = setting("fresh perturbed repeats of the chosen motion: success_rate is over these", at_least=1)
    tilt_fraction: float = setting(
        "fraction of the demonstrated tilt of the cup that is played, less where the arm cannot; 0: upright",
        at_least=0,
        at_most=1,
    )
    hold_s: float = setting("time for which the cup is held after the motion [s]", above=0)
    lead_in_m_s2: float = setting("acceleration that brings the cup to a motion that begins moving [m/s^2]", above=0)

    def __post_init__(self) -> None:
        low, high = self.tau_range
        if not low <= high:
            raise ConfigError(
                "tau_range", f"'tau_range' is {list(self.tau_range)}; allowed: the minimum, then the maximum"
            )
        if not low <= self.tau_start <= high:
            raise ConfigError("tau_start", f"'tau_start' is {self.tau_start}; allowed: {low} to {high} (tau_range)")
