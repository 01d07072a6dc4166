"""Images of balls that move while the shutter is open: sampled in space and time, mixed as light, encoded after it."""

import cv2
import numpy as np

GAMMA = 2.2
SAMPLES = 4
"""Along each side of a pixel; two moments per pixel of way."""
COLOURS = {"dark": (30, 32, 35), "white": (235, 235, 235), "orange": (40, 120, 235)}
LOOKS = (*COLOURS, "shaded", "two_tone", "band")


def light(values):
    return (np.asarray(values) / 255.0) ** GAMMA


def paint(look, across, down, turn):
    """The light (..., 3) of places on the disc, in radii from its middle."""
    ones = np.ones((*across.shape, 1))
    side = (across * np.cos(turn) + down * np.sin(turn))[..., None]
    if look in COLOURS:
        return ones * light(COLOURS[look])
    if look == "shaded":
        towards = np.sqrt(np.maximum(1 - across**2 - down**2, 0))
        lit = np.maximum((-0.3 * across - 0.7 * down + 0.65 * towards) / 1.0, 0)
        return (0.15 + 0.85 * lit)[..., None] * light((30, 35, 230))
    if look == "two_tone":
        return np.where(side > 0, light((225, 225, 228)), light((35, 35, 40)))
    return np.where(np.abs(side) < 0.33, light((40, 120, 235)), light((60, 60, 65)))


def exposed(background, place, radius_px, look, rng, *, noise=3.0, focus_px=0.5):
    """``background`` (h, w, 3) with a ball that moves evenly by the second of ``place`` (2, 2) about the first."""
    centre, way = np.asarray(place, dtype=float)
    wall, turn = light(background), rng.uniform(0, 2 * np.pi)
    mixed, moments = wall.copy(), max(16, int(2 * np.hypot(*way)))
    side = 2 * int(radius_px + 3)
    v, u = (np.indices((side * SAMPLES, side * SAMPLES)) + 0.5) / SAMPLES - 0.5
    for part in (np.arange(moments) + 0.5) / moments - 0.5:
        corner = np.floor(centre + part * way).astype(int) - side // 2
        across, down = (
            (one - middle) / radius_px for one, middle in zip((u, v), centre + part * way - corner, strict=True)
        )
        on = across**2 + down**2 < 1
        rows, columns = slice(corner[1], corner[1] + side), slice(corner[0], corner[0] + side)
        shown = wall[rows, columns].repeat(SAMPLES, axis=0).repeat(SAMPLES, axis=1)
        shown[on] = paint(look, across[on], down[on], turn)
        seen = shown.reshape(side, SAMPLES, side, SAMPLES, 3).mean(axis=(1, 3))
        mixed[rows, columns] += (seen - wall[rows, columns]) / moments
    return encoded(mixed, rng, noise, focus_px)


def encoded(mixed, rng, noise=3.0, focus_px=0.5):
    """Light as an image's numbers, out of focus and with noise."""
    soft = cv2.GaussianBlur(mixed, (0, 0), focus_px)
    noisy = 255 * np.clip(soft, 0, 1) ** (1 / GAMMA) + rng.normal(0, noise, mixed.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
