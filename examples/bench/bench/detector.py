"""Detector of red regions: the largest first, or the nearest to the expected position."""

import cv2
import numpy as np

from kendama_cli.extension import Sighting


class Detector:
    def __init__(self, settings):
        self._min_redness = settings.min_redness

    def candidates(self, pixels, origin_px=(0, 0), hint=None):
        blue, green, red = (pixels[..., channel].astype(int) for channel in range(3))
        mask = (red - np.maximum(blue, green) >= self._min_redness).astype(np.uint8)
        count, _, boxes, centres = cv2.connectedComponentsWithStats(mask)
        detections = []
        for number in range(1, count):
            area, side = boxes[number][cv2.CC_STAT_AREA], max(boxes[number][2:4])
            if area >= 12:
                centre = centres[number] + origin_px
                radius = float(np.sqrt(area / np.pi))
                detections.append(
                    Sighting(centre, 0.1 * np.eye(2), radius, float(min(area / (np.pi * side**2 / 4), 1.0)))
                )
        if hint is not None:
            return iter(sorted(detections, key=lambda seen: float(np.hypot(*(seen.centre_px - hint.centre_px)))))
        return iter(sorted(detections, key=lambda seen: -seen.radius_px))
