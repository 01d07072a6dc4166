"""Train a small heat-map network on images with boxes about the ball, for predict/detector=network.

    pip install '.[network]'
    python train_network.py labelled/ -o ball.onnx

``labelled/`` holds images/ and labels/ as 'kendama camera train' takes them; a network knows the films that taught it,
so take frames of your own. Runs on a CPU in minutes.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import nn

BALL_PX = 8.0  # images are scaled so that the ball has about this radius
PATCH, BATCH, COARSER = 128, 16, 4


def read(folder: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    """Images (h, w, 3) and their boxes (n, 4): middle and size [px]."""
    pairs = []
    for path in sorted((folder / "images").iterdir()):
        label = folder / "labels" / path.with_suffix(".txt").name
        rows = np.loadtxt(label, ndmin=2)[:, 1:] if label.is_file() and label.stat().st_size else np.empty((0, 4))
        pixels = cv2.imread(str(path))
        if pixels is None:
            raise SystemExit(f"{path}: no image")
        pairs.append((pixels, rows * np.tile(pixels.shape[1::-1], 2)))
    if not any(len(boxes) for _, boxes in pairs):
        raise SystemExit(f"{folder}: none of {len(pairs)} images has a box about the ball")
    return pairs


def network() -> nn.Module:
    """Probability of a ball's middle in each cell of COARSER x COARSER px; it sees about 60 px to each side."""

    def layer(before: int, after: int, step: int = 1, apart: int = 1) -> list[nn.Module]:
        conv = nn.Conv2d(before, after, 3, step, apart, apart, bias=False)
        return [conv, nn.BatchNorm2d(after), nn.ReLU()]

    layers = [*layer(3, 16, 2), *layer(16, 32, 2), *layer(32, 32), *layer(32, 32, apart=2), *layer(32, 32, apart=4)]
    return nn.Sequential(*layers, *layer(32, 32), nn.Conv2d(32, 1, 1), nn.Sigmoid())


def patch(pixels: np.ndarray, boxes: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a varied part of an image and the heat map that is desired for it."""
    height, width = pixels.shape[:2]
    at = rng.uniform([0, 0], [width, height])
    if len(boxes) and rng.random() < 0.6:
        at = boxes[rng.integers(len(boxes)), :2] + rng.uniform(-50, 50, 2)
    turn, grown = rng.uniform(0, 360), rng.uniform(0.8, 1.25)
    way = cv2.getRotationMatrix2D(tuple(at), turn, grown)
    way[:, 2] += PATCH / 2 - at
    shown = cv2.warpAffine(pixels, way, (PATCH, PATCH), borderMode=cv2.BORDER_REFLECT_101).astype(np.float32)
    if rng.random() < 0.5:
        kernel = np.zeros((9, 9), np.float32)
        kernel[4, 4 - (half := rng.integers(1, 5)) : 5 + half] = 1
        kernel = cv2.warpAffine(kernel, cv2.getRotationMatrix2D((4, 4), rng.uniform(0, 180), 1), (9, 9))
        shown = cv2.filter2D(shown, -1, kernel / kernel.sum())
    shown = shown * rng.uniform(0.7, 1.3) * rng.uniform(0.93, 1.07, 3) + rng.normal(0, 3, shown.shape)
    cells = PATCH // COARSER
    v, u = (np.indices((cells, cells)) + 0.5) * COARSER - 0.5
    heat = np.zeros((cells, cells), np.float32)
    for middle in boxes[:, :2] @ way[:, :2].T + way[:, 2]:
        heat = np.maximum(heat, np.exp(-((u - middle[0]) ** 2 + (v - middle[1]) ** 2) / (2 * (BALL_PX / 2) ** 2)))
    return np.clip(shown, 0, 255)[:, :, ::-1].transpose(2, 0, 1) / 255, heat[None]


def train(images: list[tuple[np.ndarray, np.ndarray]], steps: int, seed: int) -> nn.Module:
    """Weighted cross-entropy, as most cells show no ball."""
    torch.manual_seed(seed)
    rng, net = np.random.default_rng(seed), network()
    descent = torch.optim.AdamW(net.parameters(), 3e-3, weight_decay=1e-3)
    rates = torch.optim.lr_scheduler.OneCycleLR(descent, 3e-3, total_steps=steps)
    boxed = [number for number, (_, boxes) in enumerate(images) if len(boxes)]
    for step in range(steps):
        chosen = [
            boxed[rng.integers(len(boxed))] if rng.random() < 0.8 else rng.integers(len(images)) for _ in range(BATCH)
        ]
        shown, wanted = (
            torch.from_numpy(np.array(one, np.float32))
            for one in zip(*(patch(*images[k], rng) for k in chosen), strict=True)
        )
        made = net(shown).clamp(1e-5, 1 - 1e-5)
        each = nn.functional.binary_cross_entropy(made, wanted, reduction="none")
        loss = (each * (made - wanted).abs() ** 2 * (1 + 10 * wanted)).sum() / BATCH  # the sure ones count little
        descent.zero_grad()
        loss.backward()
        descent.step()
        rates.step()
        if step % 100 == 0:
            print(f"step {step}: loss {loss.item():.2f}", flush=True)
    return net.eval()


def main() -> None:
    """Read, train, export, and say how it is used."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("labelled", type=Path)
    asked.add_argument("-o", "--output", type=Path, default=Path("ball.onnx"))
    asked.add_argument("--steps", type=int, default=1000)
    asked.add_argument("--seed", type=int, default=0)
    given = asked.parse_args()
    images = read(given.labelled)
    radius = float(np.median([min(box[2:]) / 2 for _, boxes in images for box in boxes]))
    scale = BALL_PX / radius
    small = [
        (cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), boxes * scale)
        for pixels, boxes in images
    ]
    net = train(small, given.steps, given.seed)
    height, width = (-(-max(pixels.shape[side] for pixels, _ in small) // COARSER) * COARSER for side in (0, 1))
    shown = torch.zeros(1, 3, height, width)
    torch.onnx.export(net, (shown,), str(given.output), input_names=["image"], output_names=["heat"], dynamo=False)
    print(
        f"kendama camera detect images/ --detector network --override predict.detector.model={given.output} "
        f"--override 'predict.detector.input_px=[{width},{height}]' --override predict.detector.scale={scale:.5f} "
        f"--override predict.detector.radius_px={radius:.1f}"
    )


if __name__ == "__main__":
    main()
