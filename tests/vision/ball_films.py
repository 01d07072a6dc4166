"""Films of a ball on a string before a still camera, and images of a two-tone ball, with the truth beside them."""

import cv2
import numpy as np

WIDTH, HEIGHT, RATE_HZ = 320, 240, 30.0
PX_PER_M, ROPE_M = 260.0, 0.5
SHADOW_PX = np.array([14.0, 10.0])


def textured(seed, width=WIDTH, height=HEIGHT):
    """A background of soft blobs and hard edges."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(60, 200, (height // 24 + 1, width // 24 + 1, 3)).astype(np.uint8)
    image = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    for _ in range(12):
        (left, top), size = rng.integers(0, [width, height]), rng.integers(10, 60, 2)
        cv2.rectangle(image, (left, top), (left + size[0], top + size[1]), rng.integers(40, 220, 3).tolist(), 2)
    return image


def draw_ball(image, centre_px, radius_px, colour, *, stripe=None, angle_deg=0.0):
    """Draw a disc, with a stripe across it where ``stripe`` is a colour, at a place in sixteenths of a pixel."""
    place = tuple(round(float(value) * 16) for value in centre_px)
    cv2.circle(image, place, round(radius_px * 16), colour, -1, cv2.LINE_AA, 4)
    if stripe is not None:
        axes = round(radius_px * 16), round(radius_px * 16 / 3)
        cv2.ellipse(image, place, axes, angle_deg, 0, 360, stripe, -1, cv2.LINE_AA, 4)


def pendulum(
    frames,
    seed,
    *,
    background,
    radius_px=7.0,
    colour=(40, 45, 50),
    stripe=None,
    at_rest=0,
    shake_px=0.0,
    string_px=1,
    hand=False,
    shadow=0.0,
    drift=0.0,
    jpeg=None,
):
    """Frames (h, w, 3) of a ball that swings on its string, and its place (frames, 2) in each.

    It hangs for ``at_rest`` frames before, and the camera shakes by ``shake_px``. A ``hand`` that moves holds the
    string; ball and hand leave a soft shadow of that part of the light, the exposure drifts by the part ``drift``, and
    frames are compressed to that quality of ``jpeg``.
    """
    rng = np.random.default_rng(seed)
    top = np.array([WIDTH / 2 + rng.uniform(-20, 20), 20.0])
    made, truth = [], []
    for frame in range(frames):
        t_s = max(frame - at_rest, 0) / RATE_HZ
        angle = (0.0 if frame < at_rest else 0.7) * np.exp(-t_s / 20) * np.cos(np.sqrt(9.81 / ROPE_M) * t_s)
        held = top + ((15.0 * np.sin(2.1 * t_s), 0.0) if hand else (0.0, 0.0))
        place = held + PX_PER_M * ROPE_M * np.array([np.sin(angle), np.cos(angle)])
        image = _shaded(background, [(place, radius_px), *([(held, 16.0)] if hand else [])], shadow)
        cv2.line(image, tuple(held.astype(int)), tuple(place.astype(int)), (90, 90, 95), string_px, cv2.LINE_AA)
        draw_ball(image, place, radius_px, colour, stripe=stripe, angle_deg=30.0 * frame)
        if hand:
            cv2.ellipse(image, tuple(held.astype(int)), (22, 14), 20.0, 0, 360, (110, 140, 190), -1, cv2.LINE_AA)
        shift = np.clip(rng.normal(0, shake_px, 2), -2, 2) if shake_px else np.zeros(2)
        if shake_px:
            way = np.array([[1, 0, shift[0]], [0, 1, shift[1]]])
            image = cv2.warpAffine(image, way, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE)
        noisy = image * (1 + drift * np.sin(2 * np.pi * frame / frames)) + rng.normal(0, 3, image.shape)
        shown = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
        if jpeg is not None:
            shown = cv2.imdecode(cv2.imencode(".jpg", shown, [cv2.IMWRITE_JPEG_QUALITY, jpeg])[1], cv2.IMREAD_COLOR)
        made.append(shown)
        truth.append(place + shift)
    return made, np.array(truth)


def _shaded(background, discs, part):
    """A copy of ``background`` with the soft shadow of ``discs`` (place, radius) beside them."""
    if not part:
        return background.copy()
    dark = np.zeros(background.shape[:2], dtype=np.float32)
    for place, radius in discs:
        cv2.circle(dark, tuple(np.round(place + SHADOW_PX).astype(int)), round(radius), 1.0, -1)
    return np.rint(background * (1 - part * cv2.GaussianBlur(dark, (0, 0), 3.0))[:, :, None]).astype(np.uint8)


def write_film(path, frames, codec="MJPG"):
    height, width = frames[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), RATE_HZ, (width, height))
    for frame in frames:
        writer.write(frame)
    writer.release()


def labelled_image(seed, *, ball=True, size=(240, 320)):
    """An image of a two-tone ball (blurred, lit and turned by chance) on a textured background, with its box
    (u, v, width, height) [px], None without a ball; backgrounds of one film are alike."""
    rng = np.random.default_rng(seed)
    image = textured(4711, size[1], size[0])
    shift = rng.integers(-15, 16, 2)
    image = np.roll(image, tuple(shift), axis=(0, 1))
    radius = rng.uniform(8.5, 11.5)
    centre = rng.uniform([25, 25], [size[1] - 25, size[0] - 25])
    if ball:
        draw_ball(image, centre, radius, (60, 60, 65), stripe=(40, 120, 235), angle_deg=rng.uniform(0, 360))
    image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.6, 1.4))
    image = np.clip(image * rng.uniform(0.85, 1.15) + rng.normal(0, 4, image.shape), 0, 255).astype(np.uint8)
    return image, (*centre, 2 * radius, 2 * radius) if ball else None


def write_labelled(folder, seeds, without=()):
    """Images with boxes as YOLO's files: ``images/`` and ``labels/`` in ``folder``; the boxes by name."""
    (folder / "images").mkdir(parents=True)
    (folder / "labels").mkdir()
    boxes = {}
    for seed in seeds:
        image, box = labelled_image(seed, ball=seed not in without)
        height, width = image.shape[:2]
        cv2.imwrite(str(folder / "images" / f"{seed}.png"), image)
        line = ""
        if box is not None:
            u, v, w, h = box
            line = f"0 {(u + 0.5) / width} {(v + 0.5) / height} {w / width} {h / height}\n"
        (folder / "labels" / f"{seed}.txt").write_text(line)
        boxes[str(seed)] = box
    return boxes
