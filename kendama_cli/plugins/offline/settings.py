"""Settings of the fixed data, of the models that are fitted to it, and of the policy that is learned in one of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class FitSettings:
    """A world that no model knows, the data that is recorded in it, and the fit of the models."""

    seed: int = setting("Seed of the recording and of the network's first weights.", at_least=0)
    string_m: float = setting("Length of the string in the world that is recorded [m].", above=0)
    drag_scale: float = setting("Drag of the ball in that world, as a multiple of the configured one.", at_least=0)
    stiffness_n_m: float = setting("Stiffness of that string [N/m]; every model assumes the configured one.", above=0)
    delay_s: float = setting("The cup obeys so late in that world [s]; no model knows it.", at_least=0)
    driven_s: float = setting("Recorded time with the cup driven by random harmonics [s].", above=0)
    free_s: float = setting("Recorded time of a free swing under the resting cup [s].", at_least=30)
    free_angle_deg: float = setting("Angle at which the free swing begins [deg].", at_least=60, at_most=88)
    track_rate_hz: float = setting("Rate of the positions from which rope and drag are identified [Hz].", above=0)
    track_sigma_m: float = setting("Standard deviation of the error of these positions [m].", at_least=0)
    network_data: Literal["exact", "tracked"] = setting(
        "The network is trained on exact states, which no camera measures, or on positions with the track's errors in "
        "every time step, smoothed by cubics."
    )
    smoothing_s: float = setting("Width of these cubics (Savitzky-Golay) [s].", above=0)
    wrong_rope: float = setting("Rope of the model with wrong constants, as a multiple of the true one.", above=0)
    wrong_drag: float = setting("Drag of the model with wrong constants, as a multiple of the true one.", at_least=0)
    hidden: int = setting("Number of units in each of the network's two hidden layers.", above=0)
    updates: int = setting("Number of updates of the network, each on one batch.", above=0)
    batch: int = setting("Number of transitions in a batch.", above=0)
    learning_rate: float = setting("Learning rate of the first update; it falls to 0.", above=0)


@dataclass(frozen=True)
class OfflineSettings:
    """The model in which a policy is learned."""

    model: Literal["identified", "network", "wrong", "world"] = setting(
        "The identified rope and drag, the black-box network, the model with wrong constants, or the world itself."
    )
