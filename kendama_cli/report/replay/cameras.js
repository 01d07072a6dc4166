/* What the cameras saw, beside the scene: each camera's last image, with a ring where the ball was found. */
class Cameras {
  constructor(box) { this.box = box; this.cameras = []; }

  /* The images of one motion; of none, the box is hidden. */
  of(performance) {
    if (this.performance === performance) return;
    this.performance = performance; this.box.textContent = ''; this.box.hidden = !performance;
    this.cameras = !performance ? [] : performance.images.map(seen => {
      const figure = document.createElement('figure'), [width, height] = seen.size;
      figure.innerHTML = '<svg role="img"><image/><circle/></svg><figcaption></figcaption>';
      const [picture, image, ring, caption] = figure.querySelectorAll('*');
      picture.setAttribute('viewBox', `0 0 ${width} ${height}`);
      picture.setAttribute('aria-label', `Camera ${seen.camera}`);
      image.setAttribute('width', width); image.setAttribute('height', height);
      this.box.append(figure);
      return {seen, image, ring, caption, at: null};
    });
  }

  /* The last images until t, by the replay's clock; before the first, the first. */
  show(t) {
    for (const one of this.cameras) {
      const {camera, times, files, balls, size} = one.seen, now = t + this.performance.offset;
      let at = times.findLastIndex(taken => taken <= now + 1e-6);
      if (at < 0) at = 0;
      if (at === one.at) continue;
      one.at = at; one.image.setAttribute('href', files[at]);
      const ball = balls[at], when = times[at] - this.performance.offset;
      one.ring.style.display = ball ? '' : 'none';
      if (ball) {
        one.ring.setAttribute('cx', ball[0]); one.ring.setAttribute('cy', ball[1]);
        one.ring.setAttribute('r', ball[2] + size[0] / 120);
      }
      one.caption.textContent = `Camera “${camera}”, ${when < 0 ? '\u2212' : '+'}${Math.abs(when).toFixed(2)} s`
        + (ball ? '' : ', ball not found');
    }
  }
}
