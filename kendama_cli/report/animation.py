"""A film of cup, rope and ball in the swing plane: inline SVG, moved by a few lines of script."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.report.page_head import data_script
from kendama_cli.report.tracks import Array, Geometry, Path2D, cup_outline_m

_FRAMES_PER_S = 60
_MOST_FRAMES = 720
STILL = ' style="display:none"'
_WIDTH, _HEIGHT, _MARGIN = 560.0, 430.0, 26.0

SCRIPT = """
for (const player of document.querySelectorAll('.player')) {
  const film = JSON.parse(player.querySelector('script').textContent);
  const [cup, rope, ball, ahead, way, aim] =
    ['.cup', '.rope', '.ball', '.ahead', '.way', '.aim'].map(part => player.querySelector(part));
  const [play, speed] = player.querySelectorAll('button');
  const slider = player.querySelector('input'), clock = player.querySelector('output');
  const last = film.x.length - 1;
  let at = Math.min(film.poster, last), running = false, rate = 1, before = null;
  const show = () => {
    const i = Math.max(0, Math.min(last, Math.round(at)));
    const [x, y, tilt, u, v] = film.x[i];
    cup.setAttribute('transform', `translate(${x} ${y}) rotate(${tilt})`);
    ball.setAttribute('cx', u); ball.setAttribute('cy', v);
    const slack = Math.sqrt(Math.max(0, film.rope ** 2 - (u - x) ** 2 - (v - y) ** 2));
    rope.setAttribute('d', `M${x} ${y}Q${(x + u) / 2} ${(y + v) / 2 + 0.75 * slack} ${u} ${v}`);
    const seen = film.ahead[i];
    ahead.style.display = seen ? '' : 'none';
    if (seen) {
      const [a, b, c, d, e, f, g, h] = seen;
      way.setAttribute('d', `M${a} ${b}Q${c} ${d} ${e} ${f}`);
      aim.setAttribute('cx', e); aim.setAttribute('cy', f); aim.setAttribute('rx', g); aim.setAttribute('ry', h);
    }
    slider.value = i; clock.textContent = (film.start + i / film.rate).toFixed(2) + ' s';
  };
  const step = now => {
    if (!running) return;
    if (before !== null) at += (now - before) / 1000 * film.rate * rate;
    before = now;
    if (at > last + film.rate * rate) at = 0;
    show(); requestAnimationFrame(step);
  };
  const run = on => {
    running = on; before = null; play.textContent = on ? 'Pause' : 'Play';
    if (on) { if (at >= last) at = 0; requestAnimationFrame(step); }
  };
  play.onclick = () => run(!running);
  speed.onclick = () => {
    rate = rate === 1 ? 0.25 : 1; speed.textContent = rate === 1 ? '\\u00bc speed' : 'full speed';
  };
  slider.oninput = () => { run(false); at = +slider.value; show(); };
  show();
  if (player.dataset.autoplay && !matchMedia('(prefers-reduced-motion: reduce)').matches) {
    new IntersectionObserver(seen => {
      for (const one of seen) if (one.isIntersecting !== running) run(one.isIntersecting);
    }).observe(player);
  }
}
"""
"""Moves every ``.player`` of the page; without it each shows its poster instant."""


@dataclass(frozen=True)
class Ahead:
    """Prediction of the ball at ``t_s``: time, place and velocity of its crossing, in the plane of the tracks.

    ``sigma_m`` is the crossing's standard deviation along the plane.
    """

    t_s: float
    crossing_s: float
    x_m: float
    z_m: float
    x_m_s: float
    z_m_s: float
    sigma_m: float


def player(
    name: str,
    cup: Path2D,
    ball: Path2D,
    sizes: Geometry,
    *,
    poster_s: float | None,
    autoplay: bool,
    predictions: Sequence[Ahead] = (),
) -> str:
    """Return the film of one rollout as HTML; ``poster_s`` is the instant that is shown at rest and in print.

    With ``predictions`` the ball's way ahead is drawn as it was known at each instant, and where it was to cross the
    rim plane with two standard deviations.
    """
    start, end = max(cup.t_s[0], ball.t_s[0]), min(cup.t_s[-1], ball.t_s[-1])
    rate = min(float(_FRAMES_PER_S), _MOST_FRAMES / max(end - start, 1e-3))
    t = start + np.arange(int((end - start) * rate) + 1) / rate
    held, free = cup.at(t), ball.at(t)
    scale, left, top, height = _frame(held, free, sizes)
    x, y = _pixels(held, scale, left, top)
    u, v = _pixels(free, scale, left, top)
    rows = np.column_stack([x, y, np.degrees(held.tilt_rad), u, v]).round(1).tolist()
    poster = len(t) - 1 if poster_s is None else int(np.clip(round((poster_s - start) * rate), 0, len(t) - 1))
    rope = round(sizes.rope_m * scale, 2)
    ahead = [_ahead(predictions, float(now), sizes.gravity_m_s2, scale=scale, left_m=left, top_m=top) for now in t]
    film = {"x": rows, "ahead": ahead, "rate": rate, "rope": rope, "poster": poster, "start": round(start, 4)}
    shown = ahead[poster]
    a, b, c, d, e, f, g, h = shown or (0.0,) * 8
    cup_path, radius = _path(*(cup_outline_m(sizes.cup) * [scale, -scale]).T), scale * sizes.ball_m
    cx, cy, tilt, bx, by = rows[poster]
    slack = math.sqrt(max(0.0, rope**2 - (bx - cx) ** 2 - (by - cy) ** 2))
    bar = 0.1 * scale
    return (
        f'<div class="player"{" data-autoplay=1" if autoplay else ""}>'
        f'<svg viewBox="0 0 {_WIDTH:.0f} {height:.0f}" role="img" aria-label="Cup, rope and ball in the swing plane">'
        f'<g fill="none" stroke-width="1.2" opacity=".38"><path d="{_path(x, y)}" stroke="var(--cup)"/>'
        f'<path d="{_path(u, v)}" stroke="var(--ball)"/></g>'
        f'<path d="M{_MARGIN} {height - 10}h{bar:.1f}" stroke="var(--muted)" stroke-width="1.5"/>'
        f'<text x="{_MARGIN + bar + 7:.1f}" y="{height - 6:.0f}" font-size="12" fill="var(--muted)">10 cm</text>'
        f'<path class="rope" fill="none" stroke="var(--muted)" stroke-width="1.4" '
        f'd="M{cx} {cy}Q{(cx + bx) / 2:.1f} {(cy + by) / 2 + 0.75 * slack:.1f} {bx} {by}"/>'
        f'<g class="ahead" fill="none" stroke="var(--good)"{"" if shown else STILL}>'
        f'<path class="way" stroke-width="1.6" stroke-dasharray="5 4" d="M{a} {b}Q{c} {d} {e} {f}"/>'
        f'<ellipse class="aim" cx="{e}" cy="{f}" rx="{g}" ry="{h}" stroke-width="1.6" fill="var(--good)" '
        f'fill-opacity=".25"/></g>'
        f'<circle class="ball" cx="{bx}" cy="{by}" r="{radius:.1f}" fill="var(--ball)"/>'
        f'<g class="cup" transform="translate({cx} {cy}) rotate({tilt})">'
        f'<path d="{cup_path}" fill="var(--cup)" fill-opacity=".16" '
        f'stroke="var(--cup)" stroke-width="3.4" stroke-linejoin="round" stroke-linecap="round"/></g></svg>'
        f'<div class="controls"><button type="button">Play</button><button type="button">\u00bc speed</button>'
        f'<input type="range" min="0" max="{len(t) - 1}" value="{poster}" aria-label="time">'
        f"<output>{start + poster / rate:.2f} s</output></div>"
        f"{data_script(film)}</div>"
    )


def _ahead(
    predictions: Sequence[Ahead], t_s: float, gravity_m_s2: float, *, scale: float, left_m: float, top_m: float
) -> list[float] | None:
    """Return the way ahead at ``t_s`` [px]: begin, control point and end of its parabola, and half axes of the
    crossing.
    """
    known = [one for one in predictions if one.t_s <= t_s]
    if not known or t_s >= known[-1].crossing_s:
        return None
    one = known[-1]
    left_s = one.crossing_s - t_s
    x = (one.x_m - left_s * one.x_m_s, one.x_m - left_s / 2 * one.x_m_s, one.x_m)
    # the tangents at both ends of a parabola meet half way between them, also where it is drawn in one piece
    begin_z = one.z_m - left_s * one.z_m_s - 0.5 * gravity_m_s2 * left_s**2
    z = (begin_z, one.z_m - left_s / 2 * one.z_m_s, one.z_m)
    points = [value for u, v in zip(x, z, strict=True) for value in ((u - left_m) * scale, (top_m - v) * scale)]
    return [round(value, 1) for value in (*points, max(2 * one.sigma_m * scale, 4.0), 3.0)]


def _frame(cup: Path2D, ball: Path2D, sizes: Geometry) -> tuple[float, float, float, float]:
    """Return the pixels per metre, the world's left and top edge [m], and the picture's height [px]."""
    reach = sizes.cup.radius_m + 0.01
    xs = np.concatenate([cup.x_m - reach, cup.x_m + reach, ball.x_m - sizes.ball_m, ball.x_m + sizes.ball_m])
    zs = np.concatenate([cup.z_m, cup.z_m + sizes.cup.rim_m, ball.z_m - sizes.ball_m, ball.z_m + sizes.ball_m])
    wide, tall = float(np.ptp(xs)), float(np.ptp(zs))
    scale = min((_WIDTH - 2 * _MARGIN) / wide, (_HEIGHT - 2 * _MARGIN) / tall)
    left = float(xs.min()) - ((_WIDTH / scale) - wide) / 2
    return scale, left, float(zs.max()) + _MARGIN / 2 / scale, tall * scale + 2 * _MARGIN


def _pixels(track: Path2D, scale: float, left_m: float, top_m: float) -> tuple[Array, Array]:
    return (track.x_m - left_m) * scale, (top_m - track.z_m) * scale


def _path(x: Array, y: Array) -> str:
    points = [f"{a:.1f} {b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    return "M" + "L".join(points)
