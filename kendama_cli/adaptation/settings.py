"""Settings of the adaptation of a primitive to the arm: the search over tau, and the uncertainty of a robust catch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.settings.placement import LineSettings
from kendama_cli.vision.settings import MotionSettings, OnsetSettings


@dataclass(frozen=True)
class UncertaintySettings:
    """Uncertainty of kendama and arm: sampled for every rollout that evaluates a motion, mostly uniformly.

    The cup's error is a sine along x of the world, and one along y, each of a random phase and a frequency sampled on a
    logarithmic scale. It stands for calibration, compliance and vibration, which unlike noise do not average out.
    """

    name: str = setting("Name of these uncertainties in reports.")
    rope_m: float = setting("The rope's length differs from the model by up to this, either way [m].", at_least=0)
    ball_start_m: float = setting(
        "The ball starts up to this far from under the cup along x, either way [m].", at_least=0
    )
    mass_fraction: float = setting(
        "The ball's mass differs from the model by up to this fraction, either way.", at_least=0, below=1
    )
    ball_start_y_m: float = setting(
        "The ball starts up to this far from under the cup along y, across the swing, either way [m].", at_least=0
    )
    gravity_tilt_rad: float = setting(
        "Gravity leans along y by up to this, either way, as on a table that is not level [rad].", at_least=0, below=0.5
    )
    drag_scale: tuple[float, float] = setting(
        "Minimum and maximum factor on the air drag, sampled on a logarithmic scale.", above=0
    )
    restitution: tuple[float, float] = setting(
        "Minimum and maximum coefficient of restitution between ball and cup; 1 loses no energy.", at_least=0, at_most=1
    )
    rotor_scale: tuple[float, float] = setting(
        "Minimum and maximum factor on the rotors' inertia of the last three joints, which the ball strikes through "
        "the cup, sampled on a logarithmic scale.",
        above=0,
    )
    lag_s: tuple[float, float] = setting(
        "Minimum and maximum time constant of the first-order lag between the arm and its reference [s].", at_least=0
    )
    cup_error_m: float = setting(
        "Amplitude of a sinusoidal error of the cup's position along x [m]. It stands for calibration errors, "
        "compliance and vibration.",
        at_least=0,
    )
    cup_error_y_m: float = setting("Amplitude of such an error along y [m].", at_least=0)
    cup_error_hz: tuple[float, float] = setting(
        "Minimum and maximum frequency of the cup's position errors, sampled on a logarithmic scale [Hz].", above=0
    )
    cup_error_phase_change: float = setting(
        "With adapt.simulations=held, the phases of the cup's errors change from rollout to rollout by up to this "
        "fraction of a turn. 1 samples them anew.",
        at_least=0,
        at_most=1,
    )
    resonance_hz: tuple[float, float] = setting(
        "Minimum and maximum frequency at which the links swing on elastic joints, which the encoders do not measure "
        "[Hz]. 0 stands for rigid joints.",
        at_least=0,
    )
    resonance_damping: float = setting("Damping ratio of that swing.", above=0, below=1)
    lost_commands: float = setting(
        "Fraction of the commands, one every 4 ms, that do not reach the arm. It holds the last position instead.",
        at_least=0,
        below=0.5,
    )
    lost_burst: float = setting("Mean number of commands that are lost in a row.", at_least=1)
    image_latency_s: tuple[float, float] = setting(
        "Minimum and maximum delay of the images that their stamps do not contain, constant in a perturbed simulation "
        "[s].",
        at_least=0,
    )
    repeated_images: float = setting("Fraction of the images that show the previous image again.", at_least=0, below=1)
    repeated_stamp_s: float = setting(
        "A repeated image has a stamp this long after that of the image that it repeats [s].", at_least=0
    )
    wrong_detections: float = setting(
        "Fraction of the images in which the ball is detected at a wrong position.", at_least=0, below=1
    )
    wrong_detection_m: float = setting(
        "Distance of a wrong position from the ball, in a random direction [m].", at_least=0
    )
    joint_noise_rad: float = setting(
        "Standard deviation of the noise on every reading of a joint angle [rad].", at_least=0
    )
    joint_friction_nm: float = setting(
        "Each joint has Coulomb friction of up to this that its controller does not model [Nm].", at_least=0
    )
    joint_friction_fraction: float = setting(
        "Each joint has more friction than its controller models, by this fraction of its known friction, in every "
        "perturbed simulation.",
        at_least=0,
    )
    min_reach_m: float = setting(
        "A visual catch must be able to move the cup this far to either side while the ball flies [m]. If the arm "
        "cannot, the run stops before the search.",
        at_least=0,
    )

    def __post_init__(self) -> None:
        ranges = "drag_scale", "restitution", "lag_s", "cup_error_hz", "rotor_scale", "resonance_hz", "image_latency_s"
        for name in ranges:
            low, high = getattr(self, name)
            if low > high:
                raise ConfigError(name, f"'{name}' is {[low, high]}; allowed: minimum, then maximum")


@dataclass(frozen=True)
class SensorModelSettings:
    """Sensor model of simulated rollouts: the ball's position with noise, at a camera's rate, and late."""

    rate_hz: float = setting(
        "The simulated sensor measures the ball's position this often [Hz].", above=0, at_most=1000
    )
    sigma_m: tuple[float, float, float] = setting(
        "Standard deviations of the measured position along x, y and z of the world [m].", above=0
    )
    latency_s: float = setting(
        "Time from the middle of the exposure to the command that uses the image [s].", at_least=0
    )
    observe_from_deg: float = setting(
        "The test for free flight runs while the ball rises beyond this angle from hanging [deg].",
        at_least=0,
        below=180,
    )
    onset: OnsetSettings = setting("Test that finds the time at which the rope goes slack and the ball flies freely.")
    motion: MotionSettings = setting("Model of how far a flying ball may deviate from gravity and drag.")


@dataclass(frozen=True)
class CorrectionSettings:
    """Correction of the planned motion by a visual catch: the cup deviates from its plan."""

    acceleration_m_s2: float = setting(
        "Maximum acceleration that the correction adds to the planned motion [m/s^2].", above=0
    )
    max_shift_m: float = setting(
        "The cup stays within this distance of its planned path, before the catch and after it [m].", above=0
    )
    matching: float = setting(
        "Fraction of the ball's horizontal velocity that the cup should have at the catch. 1 meets the ball without a "
        "horizontal impact.",
        at_least=0,
        at_most=1,
    )
    below_rim_m: float = setting(
        "The ball's centre is this far below the rim at the point where the cup is to meet it [m]."
    )
    max_sigma_m: float = setting(
        "The cup follows a predicted landing point once its standard deviation is below this [m].", above=0
    )
    freeze_before_catch_s: float = setting(
        "The correction no longer changes during this time before the catch [s].", above=0
    )
    braking_m_s2: float = setting("After the catch the correction brakes with this deceleration [m/s^2].", above=0)
    contact_speed_m_s: float = setting(
        "The cup moves down with this speed when it meets the ball, from a height that it reaches before [m/s]. 0 "
        "keeps the planned height.",
        at_least=0,
        at_most=1,
    )
    contact_braking_m_s2: float = setting(
        "After the catch the downward motion brakes with this deceleration [m/s^2].", above=0
    )


@dataclass(frozen=True)
class PolicySettings:
    """Settings of the search for the motion's shape (bumps on its path, goal and tau) in generations of rollouts."""

    bumps: int = setting(
        "Number of bumps added to the path along x, and as many along z, evenly spaced in time. More bumps allow more "
        "shapes and slow the search.",
        at_least=1,
        at_most=12,
    )
    spread_m: float = setting("Initial standard deviation of the bumps' heights and of the goal's shift [m].", above=0)
    spread_tau: float = setting("Initial standard deviation of the logarithm of tau_scale.", above=0)
    goal_moves: tuple[float, float] = setting(
        "The goal moves between these two fractions of the motion's duration.", at_least=0, at_most=1
    )
    generation: int = setting(
        "Number of rollouts between two updates of the policy, all in one perturbed simulation.", at_least=4
    )
    max_rollouts: int = setting(
        "The search ends after this many rollouts; rollouts that evaluate a motion do not count.", at_least=4
    )
    stop_at: tuple[int, int] = setting(
        "Two numbers n and m: the search ends when n of the m repeats that follow a generation are caught.", at_least=1
    )
    elite: int = setting("The policy is updated from this many of the best rollouts so far (search=power).", at_least=1)
    reward_m: float = setting(
        "A miss that is larger by this distance earns 1/e of the reward (search=power) [m].", above=0
    )

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
        "Method of the search. 'tau' tries windows of tau, then goals and sizes; 'aim' corrects the motion by the "
        "miss of each rollout; 'cma' and 'power' change the motion's shape, and 'random' is their baseline."
    )
    simulations: Literal["fresh", "held"] = setting(
        "Perturbations of the rollouts. 'fresh' samples new ones for every rollout; 'held' keeps one perturbed "
        "simulation, like one real arm and kendama, in which only the ball's start and the noise change."
    )
    swing_scale: float = setting("Every search starts with the motion scaled by this factor in space.", above=0)
    catch: Literal["visual", "open_loop"] = setting(
        "Method of the catch. 'visual' moves the cup to where the flying ball is seen to land; 'open_loop' plays the "
        "motion as planned."
    )
    placement: Literal["fixed", "search"] = setting(
        "Position of the arm's base. 'fixed' takes it from conf/robot; 'search' finds one for this motion first."
    )
    tau_range: tuple[float, float] = setting(
        "Minimum and maximum tau_scale that the search tries. A larger tau_scale plays the motion more slowly.", above=0
    )
    tau_start: float = setting("The search tries this tau_scale first.", above=0)
    tau_step: float = setting(
        "Spacing of the grid of tau_scale on which the search looks for windows that catch. A coarser grid needs "
        "fewer rollouts and may miss a window.",
        above=0,
    )
    tau_resolution: float = setting("The search ignores windows of tau_scale that are narrower than this.", above=0)
    amplitudes: tuple[float, ...] = setting(
        "If no tau and no goal catches, the motion is scaled by these factors in turn.", above=0
    )
    max_shift_m: float = setting(
        "If tau alone fails, the search shifts the goal by up to this while the ball flies [m].", at_least=0
    )
    max_rollouts: int = setting(
        "The search ends after this many rollouts; rollouts that evaluate a motion do not count.", at_least=1
    )
    repeats: int = setting(
        "The chosen motion is evaluated in at most this many fresh perturbed simulations, which give success_rate. "
        "More repeats narrow its interval.",
        at_least=1,
    )
    thorough: bool = setting(
        "If true, all repeats are played; else they may end after a third, where the rate is clear."
    )
    tilt_fraction: float = setting(
        "The arm plays this fraction of the demonstrated tilt of the cup, or less if it cannot reach it. 0 keeps the "
        "cup upright.",
        at_least=0,
        at_most=1,
    )
    hold_s: float = setting("The arm holds the cup still for this long after the motion [s].", above=0)
    lead_in_m_s2: float = setting(
        "If a motion starts at a velocity, the cup is brought to it with this acceleration [m/s^2].", above=0
    )

    def __post_init__(self) -> None:
        low, high = self.tau_range
        if not low <= high:
            raise ConfigError(
                "tau_range", f"'tau_range' is {list(self.tau_range)}; allowed: the minimum, then the maximum"
            )
        if not low <= self.tau_start <= high:
            raise ConfigError("tau_start", f"'tau_start' is {self.tau_start}; allowed: {low} to {high} (tau_range)")

    @property
    def evaluation(self) -> Evaluation:
        """Evaluation of the chosen motion."""
        return Evaluation(self.repeats, self.thorough)
