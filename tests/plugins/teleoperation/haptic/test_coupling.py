"""The coupling takes more energy than it gives, whatever the hand does."""

import numpy as np
import pytest

from kendama_cli.plugins.teleoperation.haptic.coupling import Coupling
from kendama_cli.plugins.teleoperation.haptic.settings import CouplingSettings

PERIOD_S, STEPS, HANDS, CUP_KG = 0.001, 1500, 1000, 0.15
USUAL = CouplingSettings(stiffness_n_m=1000.0, damping_n_s_m=3.0, max_force_n=8.0, max_force_rate_n_s=2000.0)


class Unguarded(Coupling):
    """Only spring, damper and limits: the null model."""

    def force(self, device_m, cup_m, free_m):
        super().force(device_m, cup_m, free_m)
        self.energy_j = np.full_like(self.energy_j, 1e9)
        return self.force_n


def least_energy(coupling, seed):
    """The least energy that the coupling has taken at any time [J] (hands,), and the work that hands felt [J]."""
    rng = np.random.default_rng(seed)
    hz, phase = rng.uniform(0.3, 12, (HANDS, 3, 4)), rng.uniform(0, 2 * np.pi, (HANDS, 3, 4))
    peak_m = np.minimum(0.1, 60 / (2 * np.pi * hz) ** 2) * rng.random((HANDS, 3, 4)) / 4
    cup, speed = np.zeros((HANDS, 3)), np.zeros((HANDS, 3))
    load = rng.normal(0, 1.5, (HANDS, 3))
    taken, least, felt = np.zeros(HANDS), np.zeros(HANDS), np.zeros(HANDS)
    device = np.zeros((HANDS, 3))
    for k in range(STEPS):
        # rope and ball: a load that comes and goes in a tenth of a second, and taps
        world = load * (k // 100 % 2) + (k % 331 == 0) * rng.normal(0, 20, (HANDS, 3))
        speed = speed + world / CUP_KG * PERIOD_S
        force = coupling.force(device, cup, speed * PERIOD_S)
        t_s = (k + 1) * PERIOD_S
        moved_to = (peak_m * (np.sin(2 * np.pi * hz * t_s + phase) - np.sin(phase))).sum(axis=-1)
        speed = speed + force / CUP_KG * PERIOD_S
        cup_to = cup + speed * PERIOD_S
        taken += (force * ((moved_to - device) - (cup_to - cup))).sum(axis=-1)
        felt += np.abs((force * (moved_to - device)).sum(axis=-1))
        least, device, cup = np.minimum(least, taken), moved_to, cup_to
    return least, felt


@pytest.mark.parametrize("stiffness_n_m", [pytest.param(1000.0, marks=pytest.mark.slow), 4000.0])
def test_a_thousand_random_hands_never_get_energy_from_the_coupling(stiffness_n_m):
    settings = CouplingSettings(stiffness_n_m, 0.2 * USUAL.damping_n_s_m, USUAL.max_force_n, USUAL.max_force_rate_n_s)
    shape = (HANDS, 3)
    least, felt = least_energy(Coupling(settings, PERIOD_S, CUP_KG, shape), 10003)
    assert least.min() > -1e-12
    assert felt.min() > 1e-3  # they do feel something
    unguarded, _ = least_energy(Unguarded(settings, PERIOD_S, CUP_KG, shape), 10003)
    assert (unguarded < -1e-4).mean() > 0.1  # without the guard many would


def test_the_force_is_limited_in_size_and_rise():
    coupling, last = Coupling(USUAL, PERIOD_S, CUP_KG), np.zeros(3)
    rng = np.random.default_rng(10004)
    device = np.zeros(3)
    for k in range(2000):
        device, held = device + rng.normal(0, 1e-3, 3), k % 50 > 40  # in a stall the hand feels what it felt before
        coupling.force(device, np.zeros(3), np.zeros(3), held=held)
        force = coupling.felt_n
        assert np.linalg.norm(force) <= USUAL.max_force_n + 1e-9
        assert not held or (force == last).all()
        rise = np.linalg.norm(force) - np.linalg.norm(last)
        assert rise <= USUAL.max_force_rate_n_s * PERIOD_S + 1e-9
        last = force


def test_a_still_hand_feels_the_weight_that_hangs_on_the_cup():
    coupling, cup, speed = Coupling(USUAL, PERIOD_S, CUP_KG), np.zeros(3), np.zeros(3)
    for _ in range(3000):
        speed = speed + np.array([0, 0, -0.49]) / CUP_KG * PERIOD_S
        force = coupling.force(np.zeros(3), cup, speed * PERIOD_S)
        speed = speed + force / CUP_KG * PERIOD_S
        cup = cup + speed * PERIOD_S
    assert force == pytest.approx([0, 0, 0.49], abs=0.01)
