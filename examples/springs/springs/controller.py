"""Controller with springs between the tool and its reference, and dampers in the joints."""

import numpy as np

from kendama_cli.plugins.interact.extension import JointTorque, pose_error


class Controller:
    def __init__(self, settings):
        self._stiffness = np.array([settings.stiffness_n_m] * 3 + [settings.stiffness_nm_rad] * 3)
        self._damping_nm_s = settings.damping_nm_s

    def reset(self, posture_rad):
        """Do nothing: the controller has no state."""

    def command(self, state, reference, period_s):
        force = self._stiffness * pose_error(reference, state, spin_free=True)
        force[:3] += reference.force_n
        torque_nm = state.jacobian.T @ force - self._damping_nm_s * state.velocity_rad_s
        return JointTorque(torque_nm, np.zeros_like(torque_nm))
