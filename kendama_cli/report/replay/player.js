/* The player: scene, view, controls; follows motion.js and cameras.js in the page. */
class Replay {
  constructor(box, context) {
    this.box = box; this.canvas = box.querySelector('canvas'); this.place = box.querySelector('.stage');
    const data = JSON.parse(box.querySelector('script').textContent);
    this.renderer = new T.WebGLRenderer({canvas: this.canvas, context});
    this.renderer.shadowMap.enabled = true; this.renderer.shadowMap.type = T.PCFShadowMap;
    this.performances = data.performances.map(one => new Performance(one));
    this.azimuth = data.azimuth;
    this.scene = new T.Scene();
    this.performances.forEach(one => this.scene.add(one.group));
    this.light();
    this.camera = new T.PerspectiveCamera(34, 1, 0.02, 60); this.camera.up.copy(UP);
    this.orbit = new T.OrbitControls(this.camera, this.canvas);
    this.orbit.enableZoom = false; this.orbit.minDistance = 0.25; this.orbit.maxDistance = 9;
    this.orbit.maxPolarAngle = Math.PI * 0.52;
    this.canvas.style.touchAction = 'pan-y';
    this.orbit.addEventListener('change', () => this.draw());
    this.cameras = new Cameras(box.querySelector('.cameras'));
    this.rate = 1; this.running = false; this.once = 'once' in box.dataset;
    const arms = this.performances.filter(one => one.links);
    this.on = new Set([0]); this.side = arms.length > 1;
    if (arms.length > 1) this.on.add(this.performances.indexOf(arms[arms.length - 1]));
    this.clock();
    this.controls();
    this.theme(); this.arrange(); this.reset();
    new ResizeObserver(() => this.resize()).observe(this.place);
    this.resize();
  }

  /* Times count from the catch; a motion without one begins when the first one does. */
  clock() {
    const first = this.performances.find(one => one.zero !== null), begin = first ? first.bodies.start - first.zero : 0;
    for (const one of this.performances) one.offset = one.zero === null ? one.bodies.start - begin : one.zero;
    this.times();
    this.t = first ? -0.16 : this.start;
  }
  times() {
    const shown = this.performances.filter((_, k) => this.on.has(k));
    this.start = Math.min(...shown.map(one => one.bodies.start - one.offset));
    this.end = Math.max(...shown.map(one => one.bodies.end - one.offset));
  }

  light() {
    const sky = new T.HemisphereLight(0xffffff, 0xc8c4bc, 2.3);
    sky.position.copy(UP);
    const sun = new T.DirectionalLight(0xffffff, 1.7);
    sun.position.set(1.4, 2.2, 4.2); sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048); sun.shadow.radius = 5; sun.shadow.bias = -0.0004; sun.shadow.normalBias = 0.01;
    Object.assign(sun.shadow.camera, {left: -4, right: 4, top: 3, bottom: -3, near: 0.5, far: 9});
    this.sun = sun;
    this.floor = new T.Mesh(new T.PlaneGeometry(40, 40), new T.ShadowMaterial({opacity: 0.16}));
    this.floor.receiveShadow = true;
    this.grid = new T.GridHelper(12, 60, 0xffffff, 0xffffff).rotateX(Math.PI / 2);
    this.grid.material.vertexColors = false;
    this.coarse = new T.GridHelper(12, 12, 0xffffff, 0xffffff).rotateX(Math.PI / 2);
    this.coarse.material.vertexColors = false;
    this.scene.add(sky, sun, sun.target, this.floor, this.grid, this.coarse);
  }
  theme() {
    const dark = colour('--paper').getHSL({}).l < 0.3, back = colour(dark ? '--paper' : '--tint');
    this.scene.background = back; this.scene.fog = new T.Fog(back, 5.5, 11);
    for (const [grid, opacity] of [[this.grid, 0.35], [this.coarse, 0.8]]) {
      grid.material.color.copy(colour('--line')); grid.material.transparent = true; grid.material.opacity = opacity;
      grid.material.needsUpdate = true;
    }
    this.floor.material.opacity = dark ? 0.45 : 0.16;
    this.performances.forEach(one => one.paint(dark));
  }

  /* Panes side by side, or one for all; what has no arm is seen in the first. */
  arrange() {
    const shown = this.performances.filter((_, k) => this.on.has(k)), arms = shown.filter(one => one.links);
    const main = arms.length ? arms : shown;
    this.panes = this.side ? main.map(one => [one]) : [shown];
    if (this.side && arms.length) this.panes[0].push(...shown.filter(one => !one.links));
    for (const one of this.performances) one.fade(!this.side && main.includes(one) && one !== main[0]);
    const legend = this.box.querySelector('.legend');
    legend.textContent = '';
    for (const pane of this.panes) {
      const name = document.createElement('span');
      name.textContent = pane.map(one => one.label).join(', '); legend.append(name);
    }
    for (const button of this.box.querySelectorAll('[data-side]')) {
      button.setAttribute('aria-pressed', String(Boolean(+button.dataset.side) === this.side));
      button.disabled = main.length < 2;
    }
    this.cameras.of(main.find(one => one.images.length));
    this.tall = this.place.clientHeight > this.place.clientWidth;
    legend.classList.toggle('tall', this.tall);
  }
  reset() {
    const home = new T.Vector3(0, 0, 1);
    const placed = this.performances[0];
    placed.bodies.place(placed.bodies.start, placed.cup, home);
    const floor = placed.links ? 0 : home.z - 0.75;
    for (const one of [this.floor, this.grid, this.coarse]) one.position.z = floor;
    this.floor.position.z -= 0.002;
    const wide = Math.max(1, 1.05 / this.aspect());
    this.orbit.target.set(home.x, home.y - (placed.links ? 0.3 : 0), home.z - (placed.links ? 0.22 : 0.1));
    const back = (placed.links ? 2.6 : 1.9) * wide;
    this.camera.position.copy(this.orbit.target).add(new T.Vector3(
      0.962 * back * Math.cos(this.azimuth), 0.962 * back * Math.sin(this.azimuth), 0.26 * back));
    this.sun.target.position.copy(this.orbit.target);
    this.sun.position.copy(this.orbit.target).add(new T.Vector3(1.0, 1.6, 3.0));
    this.orbit.update(); this.draw();
  }
  aspect() {
    const whole = (this.place.clientWidth || 16) / (this.place.clientHeight || 9);
    return this.tall ? whole * this.panes.length : whole / this.panes.length;
  }
  resize() {
    const width = this.place.clientWidth, height = this.place.clientHeight;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.arrange();
    if (!this.sized) { this.sized = true; this.reset(); }
    this.draw();
  }

  controls() {
    const box = this.box;
    this.play = box.querySelector('.play'); this.slider = box.querySelector('input[type=range]');
    this.out = box.querySelector('output');
    this.play.onclick = () => this.run(!this.running);
    this.slider.oninput = () => { this.run(false); this.to(+this.slider.value); };
    box.querySelector('.reset').onclick = () => this.reset();
    for (const button of box.querySelectorAll('[data-rate]')) button.onclick = () => this.pace(+button.dataset.rate);
    for (const button of box.querySelectorAll('[data-side]')) button.onclick = () => {
      this.side = Boolean(+button.dataset.side); this.arrange(); this.reset();
    };
    for (const input of box.querySelectorAll('[data-index]')) {
      input.checked = this.on.has(+input.dataset.index);
      input.onchange = () => {
        this.on[input.checked ? 'add' : 'delete'](+input.dataset.index);
        if (!this.on.size) { this.on.add(+input.dataset.index); input.checked = true; }
        this.times(); this.arrange(); this.reset(); this.to(Math.max(this.start, Math.min(this.end, this.t)));
      };
    }
    this.canvas.addEventListener('focus', () => { this.orbit.enableZoom = true; });
    this.canvas.addEventListener('blur', () => { this.orbit.enableZoom = false; });
    this.canvas.addEventListener('pointerdown', event => {
      this.canvas.focus({preventScroll: true});
      if (event.pointerType === 'touch') this.orbit.enableZoom = true;
    });
    this.canvas.addEventListener('keydown', event => this.key(event));
    this.pace(1);
  }
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const turn = (around, over) => {
      const away = this.camera.position.clone().sub(this.orbit.target), r = away.length();
      const phi = Math.atan2(away.y, away.x) + around;
      const theta = Math.max(0.1, Math.min(this.orbit.maxPolarAngle, Math.acos(away.z / r) + over));
      away.set(Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)).multiplyScalar(r);
      this.camera.position.copy(this.orbit.target).add(away);
    };
    const zoom = by => {
      const away = this.camera.position.clone().sub(this.orbit.target);
      away.setLength(Math.max(this.orbit.minDistance, Math.min(this.orbit.maxDistance, away.length() * by)));
      this.camera.position.copy(this.orbit.target).add(away);
    };
    const step = by => { this.run(false); this.to(Math.max(this.start, Math.min(this.end, this.t + by))); };
    const known = {
      ' ': () => this.run(!this.running), ArrowLeft: () => turn(-0.08, 0), ArrowRight: () => turn(0.08, 0),
      ArrowUp: () => turn(0, -0.06), ArrowDown: () => turn(0, 0.06), '+': () => zoom(0.88), '=': () => zoom(0.88),
      '-': () => zoom(1.14), ',': () => step(-0.01), '.': () => step(0.01), Home: () => step(-1e9),
      End: () => step(1e9), r: () => this.reset(), R: () => this.reset(),
    }[event.key];
    if (!known) return;
    event.preventDefault(); known(); this.orbit.update(); this.draw();
  }
  pace(rate) {
    this.rate = rate;
    for (const button of this.box.querySelectorAll('[data-rate]')) {
      button.setAttribute('aria-pressed', String(+button.dataset.rate === rate));
    }
  }
  run(on) {
    if (on === this.running) return;
    this.running = on; this.before = null; this.slow = 0; this.play.textContent = on ? 'Pause' : 'Play';
    if (!on) return;
    if (this.t >= this.end) this.t = this.start;
    const step = now => {
      if (!this.running) return;
      let t = this.t;
      if (this.before !== null) t += Math.min(now - this.before, 200) / 1000 * this.rate;
      /* beside a run that goes on: once, and not where drawing takes what the run needs */
      this.slow = this.before !== null && now - this.before > 60 ? this.slow + 1 : 0;
      this.before = now;
      if (this.once && (t > this.end || this.slow > 8)) { this.run(false); this.to(Math.min(t, this.end)); return; }
      this.to(t > this.end + this.rate ? this.start : t);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
  to(t) { this.t = t; this.draw(); }
  draw() {
    if (!this.sized) return;
    const t = Math.max(this.start, Math.min(this.end, this.t));
    this.slider.min = this.start; this.slider.max = this.end; this.slider.value = t;
    this.out.textContent = (t < 0 ? '\u2212' : '+') + Math.abs(t).toFixed(2) + ' s';
    const {clientWidth: width, clientHeight: height} = this.place, n = this.panes.length;
    this.cameras.show(t);
    this.camera.aspect = this.aspect(); this.camera.updateProjectionMatrix();
    this.renderer.setScissorTest(true);
    this.panes.forEach((pane, k) => {
      for (const one of this.performances) one.group.visible = pane.includes(one);
      for (const one of pane) one.show(t + one.offset);
      const box = this.tall ? [0, height * (n - 1 - k) / n, width, height / n] : [width * k / n, 0, width / n, height];
      this.renderer.setViewport(...box); this.renderer.setScissor(...box);
      this.renderer.render(this.scene, this.camera);
    });
  }
}

for (const box of document.querySelectorAll('.replay')) {
  const canvas = box.querySelector('canvas'), space = document.documentElement.classList;
  const flat = () => { box.hidden = true; space.remove('in-space'); };
  try {
    const context = canvas.getContext('webgl2', {antialias: true, preserveDrawingBuffer: true});
    if (!context) continue;
    box.hidden = false; space.add('in-space');
    canvas.addEventListener('webglcontextlost', flat);
    const made = new Replay(box, context);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
      made.theme(); made.arrange(); made.draw();
    });
    if (!still) {
      new IntersectionObserver(seen => {
        for (const one of seen) if (one.isIntersecting !== made.running) made.run(one.isIntersecting);
      }, {threshold: 0.3}).observe(box);
    }
  } catch (error) {
    flat();
    console.error(error);
  }
}
