"""A picture of cup, rope and ball in the plane of the swing, for ``render()``."""

from __future__ import annotations

import abc
import itertools
import math
from typing import Any, TypeVar

import cv2
import gymnasium
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.settings.game import GameSettings

Seen = TypeVar("Seen")
Picture = NDArray[np.uint8]
WIDTH_PX, HEIGHT_PX, PX_PER_M = 640, 480, 420.0
GROUND, LINE, CUP, ROPE, BALL = (250, 250, 248), (205, 205, 200), (40, 95, 150), (110, 110, 110), (213, 94, 0)
_FINE = 4
"""Fractional bits of a drawn coordinate: OpenCV takes fixed-point numbers."""


class Painter:
    """Painter of the game, in a window if that is asked for (``render_mode="human"``)."""

    def __init__(self, game: GameSettings, half_width_m: float) -> None:
        self.game, self._half_width_m = game, half_width_m
        self._window: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the window, which is this process's own."""
        return vars(self) | {"_window": None}

    def paint(self, x_m: float, across_m: float, above_m: float) -> Picture:
        """Return the picture (480, 640, 3), RGB, of a cup at ``x_m`` with the ball so far from its tie point."""
        cup, picture = self.game.cup, np.full((HEIGHT_PX, WIDTH_PX, 3), GROUND, np.uint8)
        for edge in (-self._half_width_m, self._half_width_m):
            cv2.line(picture, self._at(edge, -0.5), self._at(edge, 0.5), LINE, 1, cv2.LINE_AA, _FINE)
        cv2.line(picture, self._at(-1.0, 0.0), self._at(1.0, 0.0), LINE, 1, cv2.LINE_AA, _FINE)
        ball = self._at(x_m + across_m, above_m)
        points = [self._at(x_m, 0.0), ball]
        if above_m > 0.0 and abs(across_m) >= cup.outer_radius_m:
            points.insert(1, self._at(x_m + math.copysign(cup.outer_radius_m, across_m), cup.rim_m - cup.depth_m))
        for start, end in itertools.pairwise(points):
            cv2.line(picture, start, end, ROPE, 2, cv2.LINE_AA, _FINE)
        out, up, floor = cup.outer_radius_m, cup.rim_m, cup.rim_m - cup.depth_m
        wall = [self._at(x_m + x, z) for x, z in ((-out, up), (-out, floor), (out, floor), (out, up))]
        cv2.polylines(picture, [np.array(wall)], False, CUP, 4, cv2.LINE_AA, _FINE)
        radius = round(self.game.ball.radius_m * PX_PER_M * 2**_FINE)
        cv2.circle(picture, ball, radius, BALL, -1, cv2.LINE_AA, _FINE)
        return picture

    def show(self, picture: Picture) -> None:
        """Show ``picture`` in a window; a warning says where there is no display."""
        import matplotlib.pyplot as plt  # noqa: PLC0415 - only where somebody looks

        if plt.get_backend().lower() in ("agg", "svg", "pdf", "cairo", "template"):
            gymnasium.logger.warn("render_mode 'human' needs a display, and there is none; take 'rgb_array'")
            return
        if self._window is None:
            self._window = plt.imshow(picture)
            plt.axis("off")
        self._window.set_data(picture)
        plt.pause(0.001)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            import matplotlib.pyplot as plt  # noqa: PLC0415 - only where somebody looks

            plt.close(self._window.figure)
            self._window = None

    @staticmethod
    def _at(x_m: float, z_m: float) -> tuple[int, int]:
        u, v = 0.5 * WIDTH_PX + x_m * PX_PER_M, 0.5 * HEIGHT_PX - z_m * PX_PER_M
        return round(u * 2**_FINE), round(v * 2**_FINE)


class PaintedEnv(gymnasium.Env[Seen, Any], abc.ABC):
    """An environment that shows the game: as arrays in mode rgb_array, in a window in mode human."""

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 10}  # noqa: RUF012 - gymnasium's own declaration

    def __init__(self, game: GameSettings, half_width_m: float, render_mode: str | None) -> None:
        """Raise ConfigError for another ``render_mode``."""
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ConfigError("render_mode", f"'render_mode' is {render_mode!r}; allowed: rgb_array, human, None")
        self.render_mode, self._painter = render_mode, Painter(game, half_width_m)

    def render(self) -> Any:
        """Return the picture (480, 640, 3), RGB, in mode rgb_array; None in the others: human shows each step."""
        return self._painter.paint(*self._places()) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        self._painter.close()

    @abc.abstractmethod
    def _places(self) -> tuple[float, float, float]:
        """Return the cup's x, and the ball beside its tie point along x and z [m]."""

    def _show(self) -> None:
        if self.render_mode == "human":
            self._painter.show(self._painter.paint(*self._places()))
