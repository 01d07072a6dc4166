"""The flight that two cameras see, and the moments at which they do: for tests and benchmarks."""

import numpy as np

from kendama_cli.vision.prediction.free_flight import FreeFlight

RATE_HZ, SIGMA_PX, RIM_M, DRAG = 120.0, 0.2, 0.15, 0.04
FLIGHT = FreeFlight(np.array([0.0, 0.0, -9.81]), DRAG)
START, VELOCITY = np.array([0.1, 0.0, 0.3]), np.array([-0.5, 0.1, 1.53])
CROSSING_S = FLIGHT.descent_s(START, VELOCITY, RIM_M)
CROSSING_M = FLIGHT.position_m(START, VELOCITY, CROSSING_S)


def stamps(fraction, offset_s=0.0):
    return np.arange(offset_s, fraction * CROSSING_S, 1 / RATE_HZ)
