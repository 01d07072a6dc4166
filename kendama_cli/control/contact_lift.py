"""Lift of the cup from which it gives with the ball: it moves down as the ball meets it."""

from __future__ import annotations

from kendama_cli.adaptation.settings import CorrectionSettings
from kendama_cli.control.interception import plan_interception
from kendama_cli.control.settings import CatchSettings


class ContactLift:
    """Acceleration of the cup's height over its plan, held over each period of ``period_s``.

    A cubic that is planned anew in every period until ``freeze_before_catch_s`` before the contact brings the height
    back to zero there, with the speed ``contact_speed_m_s`` down; the cup then brakes with ``contact_braking_m_s2``.
    """

    def __init__(self, settings: CatchSettings | CorrectionSettings, period_s: float) -> None:
        self._settings, self._period_s = settings, period_s
        self._planned_m_s2 = 0.0  # where nothing was planned in time, the cup stays as it is

    def acceleration_m_s2(self, height_m: float, rise_m_s: float, t_s: float, end_s: float) -> float:
        """Return it for the period that begins at ``t_s`` from that height and rate; the contact is at ``end_s``."""
        settings, braking = self._settings, self._settings.contact_braking_m_s2
        if end_s - t_s > settings.freeze_before_catch_s:
            plan = plan_interception(
                displacement_m=-height_m,
                velocity_m_s=rise_m_s,
                desired_m_s=-settings.contact_speed_m_s,
                start_s=t_s,
                end_s=end_s,
                limit_m_s2=settings.acceleration_m_s2,
            )
            self._planned_m_s2 = plan.acceleration_m_s2(t_s + 0.5 * self._period_s)
        if t_s < end_s:
            return self._planned_m_s2
        return min(max(-rise_m_s / self._period_s, -braking), braking)
