"""A folder of images with a list of their times."""

import cv2
import numpy as np

RATE_HZ = 50.0


def images(folder, n=20, size=(48, 64), rows=None):
    rng = np.random.default_rng(0)
    lines = ["file,t_s"]
    for i in range(n):
        cv2.imwrite(str(folder / f"{i:03d}.png"), rng.integers(0, 256, (*size, 3), dtype=np.uint8))
        lines.append(f"{i:03d}.png,{i / RATE_HZ}")
    path = folder / "times.csv"
    path.write_text("\n".join(rows if rows is not None else lines) + "\n")
    return str(path)
