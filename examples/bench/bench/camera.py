"""Live camera before a grey wall."""

import time

import numpy as np

from kendama_cli.extension import RegionOfInterest, too_old


class GreyWall:
    next_s = None  # the time of a live camera's next frame is unknown

    def __init__(self, model, rate_hz, clock):
        self.model = model
        self._rate_hz, self._clock, self._region = rate_hz, clock, RegionOfInterest(model)

    def latest(self, *, max_age_s):
        while self._clock() < 1 / self._rate_hz:  # wait for the first frame
            time.sleep(0.001)
        now_s = self._clock()
        t_s = (int(now_s * self._rate_hz) - 1) / self._rate_hz
        if now_s - t_s > max_age_s:
            raise too_old(self.model.name, now_s - t_s, max_age_s)
        return self._region.frame(t_s, np.full((self.model.height_px, self.model.width_px, 3), 110, dtype=np.uint8))

    def set_region_of_interest(self, region):
        self._region.set(region)

    def restart(self):
        """Do nothing: the frames follow the clock."""

    def close(self):
        """Do nothing: no device is open."""


def open_cameras(settings, models, clock, scene):
    return [GreyWall(model, settings.rate_hz, clock) for model in models]
