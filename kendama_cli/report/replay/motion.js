/* The motions of a replay as bodies in a scene of three.js; page_part.py joins this file and player.js. */
const T = THREE, css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colour = name => new T.Color(css(name));
const still = matchMedia('(prefers-reduced-motion: reduce)').matches;
const bytes = text => Uint8Array.from(atob(text), one => one.charCodeAt(0)).buffer;
const UP = new T.Vector3(0, 0, 1), TRAIL_S = 0.7;

/* Frames that were logged: where each of them is at any time, between its samples. */
class Frames {
  constructor(data) {
    Object.assign(this, data);
    this.poses = new Int16Array(bytes(data.poses));
    this.count = this.poses.length / (7 * this.names.length);
    this.end = this.start + (this.count - 1) / this.rate;
    this.one = new T.Quaternion(); this.other = new T.Quaternion();
  }
  index(t) { return Math.max(0, Math.min(this.count - 1, (t - this.start) * this.rate)); }
  place(t, k, into) {
    const at = this.index(t), low = Math.floor(at), high = Math.min(low + 1, this.count - 1), share = at - low;
    const a = (low * this.names.length + k) * 7, b = (high * this.names.length + k) * 7, p = this.poses;
    return into.set(p[a], p[a + 1], p[a + 2]).multiplyScalar(1 - share)
      .addScaledVector(new T.Vector3(p[b], p[b + 1], p[b + 2]), share).multiplyScalar(this.step);
  }
  turn(t, k, into) {
    const at = this.index(t), low = Math.floor(at), high = Math.min(low + 1, this.count - 1);
    const a = (low * this.names.length + k) * 7 + 3, b = (high * this.names.length + k) * 7 + 3, p = this.poses;
    this.one.set(p[a + 1], p[a + 2], p[a + 3], p[a]).normalize();
    this.other.set(p[b + 1], p[b + 2], p[b + 3], p[b]).normalize();
    return into.copy(this.one).slerp(this.other, at - low);
  }
  move(t, groups) {
    this.names.forEach((name, k) => {
      const group = groups.get(name);
      if (group) { this.place(t, k, group.position); this.turn(t, k, group.quaternion); }
    });
  }
}

const geometry = solid => {
  if (solid.kind === 'mesh') {
    const made = new T.BufferGeometry();
    made.setAttribute('position', new T.BufferAttribute(new Float32Array(bytes(solid.vertices)), 3));
    made.setIndex(new T.BufferAttribute(new Uint32Array(bytes(solid.triangles)), 1));
    const flat = made.toNonIndexed();
    flat.computeVertexNormals();
    return flat;
  }
  const [x, y, z] = solid.size;
  if (solid.kind === 'box') return new T.BoxGeometry(x, y, z);
  if (solid.kind === 'sphere') return new T.SphereGeometry(0.5, 40, 24).scale(x, y, z);
  return new T.CylinderGeometry(0.5 * solid.top, 0.5, 1, 48).rotateX(Math.PI / 2).scale(x, y, z);
};

/* One motion: what it moves, and the marks of what was known while it went on. */
class Performance {
  constructor(data) {
    Object.assign(this, data);
    this.bodies = new Frames(data.bodies);
    this.links = data.links && new Frames(data.links);
    this.cup = this.bodies.names.indexOf('cup'); this.ball = this.bodies.names.indexOf('ball');
    this.zero = data.catch;
    this.group = new T.Group(); this.groups = new Map(); this.materials = [];
    for (const solid of this.solids.length ? this.solids : this.plain()) this.add(solid);
    this.strand = Array.from({length: this.ball < 0 ? 0 : 20}, () => {
      const piece = new T.Mesh(new T.CylinderGeometry(0.0022, 0.0022, 1, 6).rotateX(Math.PI / 2),
        this.material('--muted', null));
      this.group.add(piece);
      return piece;
    });
    this.trails = [[this.cup, '--cup'], [this.ball, '--ball']].filter(([k]) => k >= 0).map(([k, name]) => {
      const line = this.line(name, 0.75, 96);
      return {k, line};
    });
    this.way = this.line('--good', 1, 33);
    this.aim = new T.Mesh(new T.CircleGeometry(1, 48),
      new T.MeshBasicMaterial({transparent: true, opacity: 0.4, side: T.DoubleSide, depthWrite: false}));
    this.aim.userData.css = '--good';
    this.mark = new T.Mesh(new T.RingGeometry(0.9, 1, 64),
      new T.MeshBasicMaterial({transparent: true, side: T.DoubleSide, depthWrite: false}));
    this.mark.userData.css = '--good';
    this.group.add(this.aim, this.mark);
  }
  plain() {
    /* a log that says of no looks: a cup, and a ball where there is one */
    const cup = {frame: 'cup', name: 'cup', kind: 'cylinder', top: 1.15, size: [0.08, 0.08, 0.07],
      at: [0, 0, 0.035], turn: [1, 0, 0, 0], rgb: [0, 0.447, 0.698]};
    const ball = {...cup, frame: 'ball', name: 'ball', kind: 'sphere', size: [0.04, 0.04, 0.04], at: [0, 0, 0]};
    return this.ball < 0 ? [cup] : [cup, ball];
  }
  material(name, rgb) {
    const made = new T.MeshStandardMaterial({roughness: 0.55, metalness: 0.05, side: T.DoubleSide});
    made.userData = {css: name, rgb};
    this.materials.push(made);
    return made;
  }
  line(name, opacity, points) {
    const made = new T.BufferGeometry();
    made.setAttribute('position', new T.BufferAttribute(new Float32Array(3 * points), 3));
    const line = new T.Line(made, new T.LineBasicMaterial({transparent: true, opacity}));
    line.frustumCulled = false; line.userData.css = name;
    this.group.add(line);
    return line;
  }
  add(solid) {
    if (!this.groups.has(solid.frame)) {
      const group = new T.Group();
      this.groups.set(solid.frame, group); this.group.add(group);
    }
    const name = {cup: '--cup', ball: '--ball'}[solid.name];
    const mesh = new T.Mesh(geometry(solid), this.material(name, solid.rgb));
    const [w, x, y, z] = solid.turn;
    mesh.position.set(...solid.at); mesh.quaternion.set(x, y, z, w);
    mesh.castShadow = mesh.receiveShadow = solid.name !== 'view';
    this.groups.get(solid.frame).add(mesh);
  }
  paint(dark) {
    const ghost = this.kind === 'demonstration';
    for (const one of this.materials) {
      const {css: name, rgb} = one.userData;
      const other = ghost && name === '--cup' || this.kind === 'referee' && name === '--ball';
      if (name) one.color.copy(colour(other ? '--other' : name));
      else one.color.setRGB(...rgb, T.SRGBColorSpace).multiplyScalar(dark ? 0.8 : 1);
      one.transparent = ghost; one.opacity = ghost ? 0.55 : 1;
    }
    for (const one of [...this.trails.map(trail => trail.line), this.way, this.aim, this.mark]) {
      one.material.color.copy(colour(ghost ? '--other' : one.userData.css));
    }
  }
  fade(faint) {
    if (this.kind === 'demonstration') return;
    for (const one of this.materials) {
      one.transparent = faint; one.opacity = faint ? 0.4 : 1; one.depthWrite = !faint; one.needsUpdate = true;
    }
  }
  show(t) {
    this.bodies.move(t, this.groups);
    if (this.links) this.links.move(t, this.groups);
    for (const {k, line} of this.trails) this.trail(t, k, line);
    if (this.ball >= 0) { this.hang(t); this.expect(t); } else { this.aim.visible = this.mark.visible = false; }
  }
  trail(t, k, line) {
    const points = line.geometry.attributes.position, n = points.count, here = new T.Vector3();
    for (let i = 0; i < n; i++) {
      this.bodies.place(Math.max(this.bodies.start, t - TRAIL_S * (1 - i / (n - 1))), k, here);
      points.setXYZ(i, here.x, here.y, here.z);
    }
    points.needsUpdate = true;
  }
  hang(t) {
    /* from the tie, over the rim where the ball is above it, to the ball; what is slack hangs in a parabola */
    const tie = this.bodies.place(t, this.cup, new T.Vector3());
    const ball = this.bodies.place(t, this.ball, new T.Vector3());
    const axis = UP.clone().applyQuaternion(this.bodies.turn(t, this.cup, new T.Quaternion()));
    const out = ball.clone().sub(tie), height = out.dot(axis), aside = out.clone().addScaledVector(axis, -height);
    const radius = this.outside(), inside = height > 0 && height < this.rim + 0.03 && aside.length() < radius;
    const to = inside || aside.length() < 1e-4 ? new T.Vector3(1, 0, 0) : aside.clone().normalize();
    const side = tie.clone().addScaledVector(to, radius), rim = side.clone().addScaledVector(axis, this.rim);
    const corners = [tie];
    if (inside) corners.push(rim);
    else if (height > 0 && aside.length() < radius + 0.5) corners.push(side, ...(height > this.rim ? [rim] : []));
    corners.push(ball);
    let used = 0;
    for (let i = 1; i < corners.length; i++) used += corners[i].distanceTo(corners[i - 1]);
    /* what is slack hangs from the last corner, or outside a cup that holds the ball */
    const k = inside ? 0 : corners.length - 2, from = corners[k], until = corners[k + 1];
    const span = from.distanceTo(until), free = Math.max(span, this.rope - (used - span));
    const drop = Math.sqrt(Math.max(0, 3 / 8 * span * (free - span)) + Math.max(0, (free - span) ** 2) / 4);
    const before = corners.slice(0, k + 1), after = corners.slice(k + 2);
    const n = this.strand.length + 1 - before.length - after.length, points = before;
    for (let i = 1; i <= n; i++) {
      const share = i / n, point = from.clone().lerp(until, share);
      point.z -= 4 * drop * share * (1 - share);
      points.push(point);
    }
    points.push(...after);
    this.strand.forEach((piece, i) => {
      const a = points[i], b = points[i + 1], way = b.clone().sub(a), length = way.length();
      piece.visible = length > 1e-5;
      if (!piece.visible) return;
      piece.position.copy(a).add(b).multiplyScalar(0.5);
      piece.quaternion.setFromUnitVectors(UP, way.divideScalar(length));
      piece.scale.set(1, 1, length);
    });
  }
  outside() {
    if (this.radius === undefined) {
      const cup = this.groups.get('cup');
      this.radius = 0.045;
      if (cup && cup.children[0]) {
        cup.children[0].geometry.computeBoundingBox();
        this.radius = cup.children[0].geometry.boundingBox.max.x;
      }
    }
    return this.radius;
  }
  expect(t) {
    const known = this.ahead.filter(row => row[0] <= t), row = known[known.length - 1];
    const seen = row && t < row[1];
    this.way.visible = this.aim.visible = Boolean(seen);
    if (seen) {
      const [, when, x, y, z, vx, vy, vz, major, minor, turn] = row, points = this.way.geometry.attributes.position;
      for (let i = 0; i < points.count; i++) {
        const left = (when - t) * (1 - i / (points.count - 1));
        points.setXYZ(i, x - vx * left, y - vy * left, z - vz * left - 0.5 * this.gravity * left * left);
      }
      points.needsUpdate = true;
      this.aim.position.set(x, y, z); this.aim.rotation.z = turn;
      this.aim.scale.set(Math.max(major, 0.004), Math.max(minor, 0.004), 1);
    }
    /* where the ball came down to the cup: a ring that fades */
    const since = this.zero === null ? -1 : t - this.zero;
    this.mark.visible = since >= 0 && since < 0.6;
    if (this.mark.visible) {
      this.bodies.place(this.zero, this.ball, this.mark.position);
      this.mark.scale.setScalar(0.05 + 0.12 * since);
      this.mark.material.opacity = 1 - since / 0.6;
    }
  }
}
