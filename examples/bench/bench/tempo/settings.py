"""Settings of the stage tempo."""

from dataclasses import dataclass

from kendama_cli.extension import ConfigError, setting


@dataclass(frozen=True)
class TempoSettings:
    allowed_m_s: float = setting("Maximum speed of the cup [m/s].", above=0)
    tau_scales: tuple[float, ...] = setting("Time scales at which the motion is played.", above=0)

    def __post_init__(self):
        if not self.tau_scales:  # a rule that a range cannot express
            raise ConfigError("tau_scales", "'tau_scales' is empty; allowed: at least one time scale")
