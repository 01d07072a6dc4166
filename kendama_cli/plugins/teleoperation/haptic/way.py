"""Path of the stylus over time, between the positions received and a little after them."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.schema.arrays import Array

PREDICTED_S = 0.02
"""A stylus that is not heard of is taken to go on for so long: by 40 m/s^2 a hand strays from that by 8 mm."""
SPEED_OVER_S = 0.01
KEPT_S = 1.0


class DeviceWay:
    """Joins places by lines in time, for a held place would be a delay, and a spring to it would give energy.

    Places that are heard of together were sent at equal times since the last one before them; the newest of them is
    where the stylus is.
    """

    def __init__(self, now_s: float, place_m: Array) -> None:
        self._times_s, self._places_m = [now_s], [place_m]

    def heard(self, now_s: float, places_m: Sequence[Array]) -> None:
        """Add places (3,), the newest last."""
        last_s, times_s = self._times_s[-1], self._times_s
        for k, place_m in enumerate(places_m):
            times_s.append(last_s + (now_s - last_s) * (k + 1) / len(places_m))
            self._places_m.append(place_m)
        if times_s[0] < now_s - 2 * KEPT_S:
            old = sum(1 for time_s in times_s if time_s < now_s - KEPT_S)
            del times_s[:old], self._places_m[:old]

    def at(self, t_s: float) -> Array:
        """Return the position (3,) then; after the newest it moves on evenly, for PREDICTED_S at most."""
        after_s = min(t_s - self._times_s[-1], PREDICTED_S)
        if after_s <= 0 or len(self._times_s) == 1:
            return self._between(t_s)
        began_s = max(self._times_s[-1] - SPEED_OVER_S, self._times_s[0])
        newest_m = self._places_m[-1]
        speed_m_s = (newest_m - self._between(began_s)) / max(self._times_s[-1] - began_s, SPEED_OVER_S)
        return newest_m + speed_m_s * after_s

    def _between(self, t_s: float) -> Array:
        times_s, places_m = self._times_s, self._places_m
        later = len(times_s) - 1
        while later > 0 and times_s[later - 1] > t_s:
            later -= 1
        if later == 0:
            return places_m[0]
        share = (t_s - times_s[later - 1]) / max(times_s[later] - times_s[later - 1], 1e-9)
        return places_m[later - 1] + min(share, 1.0) * (places_m[later] - places_m[later - 1])
