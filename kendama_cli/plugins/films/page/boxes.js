// The page of 'kendama camera train': boxes about the ball, drawn into stills of a film. What is checked is checked by the program.
const $ = id => document.getElementById(id);
const view = $('view'), pen = view.getContext('2d');
const token = new URLSearchParams(location.search).get('token') || '';
const TAP_PX = 5, CORNER_PX = 16, SMALLEST_PX = 4, CLOSER = 4, MOST_ZOOM = 24;

let state = null, frame = 0, image = null, box = null;  // box: left, top, width, height in the image's pixels
let zoom = 1, middle = [0, 0], sent = 0;
const images = new Map(), pointers = new Map();
let press = null, pinch = null, later = 0;
window.kendama = {get state() { return state; }, get frame() { return frame; }, get box() { return box; }, toScreen, get ready() { return Boolean(image && image.complete && image.naturalWidth); }};

// -- the program
async function ask(path, body) {
  let answer;
  try {
    answer = await fetch(`/${path}?token=${encodeURIComponent(token)}`, body === undefined ? {} : {method: 'POST', body: JSON.stringify(body)});
  } catch { throw new Error('The program that serves this page has ended, or cannot be reached.'); }
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer.json();
}
async function refresh(path = 'state', body) {
  const number = ++sent;
  try {
    const told = await ask(path, body);
    if (number !== sent) return;  // a newer answer is on its way
    state = told; $('problem').hidden = true;
  } catch (error) {
    $('problem').textContent = error.message; $('problem').hidden = false;
    if (number === sent && body && state) { box = boxOf(frame); draw(); }
    return;
  }
  show();
}
function put(value) {  // null: nothing said of this image; []: no ball in it
  box = value && value.length ? value : null;
  draw();
  clearTimeout(later); later = 0;
  refresh('box', {frame, box: value});
}
function putLater() {
  clearTimeout(later);
  later = setTimeout(() => put(box), 250);
}
function boxOf(number) {
  const sides = state.boxes[number];
  return sides && sides.length ? [...sides] : null;
}

// -- the image on the screen
function scale() {
  return Math.min(view.clientWidth / state.width, view.clientHeight / state.height) * zoom;
}
function toScreen([u, v]) {
  const s = scale();
  return [view.clientWidth / 2 + (u - middle[0]) * s, view.clientHeight / 2 + (v - middle[1]) * s];
}
function toImage([x, y]) {
  const s = scale();
  return [middle[0] + (x - view.clientWidth / 2) / s, middle[1] + (y - view.clientHeight / 2) / s];
}
function zoomTo(wanted, at) {
  const before = toImage(at);
  zoom = Math.min(Math.max(wanted, 1), MOST_ZOOM);
  const after = toImage(at);
  moveBy(before[0] - after[0], before[1] - after[1]);
}
function moveBy(u, v) {
  const s = scale(), reach = [view.clientWidth / 2 / s, view.clientHeight / 2 / s], size = [state.width, state.height];
  middle = [u, v].map((by, k) => reach[k] * 2 >= size[k] ? size[k] / 2 : Math.min(Math.max(middle[k] + by, reach[k]), size[k] - reach[k]));
  draw();
}
function draw() {
  const ratio = devicePixelRatio || 1, width = Math.round(view.clientWidth * ratio), height = Math.round(view.clientHeight * ratio);
  if (view.width !== width || view.height !== height) { view.width = width; view.height = height; }
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  if (!state || !image || !image.complete) return;
  const s = scale(), [x, y] = toScreen([0, 0]);
  pen.imageSmoothingEnabled = s < 3;
  pen.drawImage(image, x, y, state.width * s, state.height * s);
  if (!box) return;
  const [left, top] = toScreen(box), wide = box[2] * s, high = box[3] * s;
  pen.lineWidth = 4; pen.strokeStyle = '#000a'; pen.strokeRect(left, top, wide, high);
  pen.lineWidth = 2; pen.strokeStyle = state.warnings[frame] ? '#ff8c42' : '#4fe0b0'; pen.strokeRect(left, top, wide, high);
  pen.lineWidth = 1; pen.beginPath(); pen.ellipse(left + wide / 2, top + high / 2, wide / 2, high / 2, 0, 0, 7); pen.stroke();
}

// -- pointers
const at = event => { const r = view.getBoundingClientRect(); return [event.clientX - r.left, event.clientY - r.top]; };
const clamp = ([u, v]) => [Math.min(Math.max(u, 0), state.width), Math.min(Math.max(v, 0), state.height)];
const between = (a, b) => [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1])];
function opposite(place) {  // the corner that stays where another one is taken hold of
  if (!box) return null;
  for (const [i, j] of [[0, 0], [1, 0], [0, 1], [1, 1]]) {
    const [x, y] = toScreen([box[0] + i * box[2], box[1] + j * box[3]]);
    const near = Math.min(CORNER_PX, 4 + box[2] * scale() / 4);
    if (Math.hypot(x - place[0], y - place[1]) < near) return [box[0] + (1 - i) * box[2], box[1] + (1 - j) * box[3]];
  }
  return null;
}
view.addEventListener('pointerdown', event => {
  if (!state || (event.pointerType === 'mouse' && event.button > 1)) return;
  view.setPointerCapture(event.pointerId); view.focus();
  pointers.set(event.pointerId, at(event));
  if (pointers.size === 2) {
    if (press) box = press.before;
    press = null;
    const [a, b] = [...pointers.values()];
    pinch = {apart: Math.hypot(a[0] - b[0], a[1] - b[1]), zoom, middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]};
    draw();
  } else if (pointers.size === 1) {
    const place = at(event), move = event.shiftKey || event.button === 1;
    press = {start: place, last: place, from: opposite(place) || clamp(toImage(place)), before: box, moved: false, move};
  }
});
view.addEventListener('pointermove', event => {
  if (!pointers.has(event.pointerId)) return;
  const place = at(event);
  pointers.set(event.pointerId, place);
  if (pinch && pointers.size >= 2) {
    const [a, b] = [...pointers.values()], now = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    moveBy((pinch.middle[0] - now[0]) / scale(), (pinch.middle[1] - now[1]) / scale());
    pinch.middle = now;
    zoomTo(pinch.zoom * Math.hypot(a[0] - b[0], a[1] - b[1]) / Math.max(pinch.apart, 1), now);
  } else if (press) {
    if (Math.hypot(place[0] - press.start[0], place[1] - press.start[1]) > TAP_PX) press.moved = true;
    if (!press.moved) return;
    if (press.move) moveBy((press.last[0] - place[0]) / scale(), (press.last[1] - place[1]) / scale());
    else { box = between(press.from, clamp(toImage(place))); draw(); }
    press.last = place;
  }
});
function release(event) {
  pointers.delete(event.pointerId);
  if (pinch) { if (!pointers.size) pinch = null; return; }
  if (!press) return;
  const done = press; press = null;
  if (event.type === 'pointercancel') { box = done.before; draw(); return; }
  if (!done.moved) { zoomTo(zoom > 1 ? 1 : CLOSER, done.start); return; }
  if (done.move) return;
  $('hint').classList.add('gone');
  if (Math.min(box[2], box[3]) < SMALLEST_PX) { box = done.before; draw(); say(`A box needs ${SMALLEST_PX} px of the image on each side: come closer.`); return; }
  put(box);
}
view.addEventListener('pointerup', release);
view.addEventListener('pointercancel', release);
view.addEventListener('wheel', event => { event.preventDefault(); if (state) zoomTo(zoom * Math.exp(-event.deltaY / 300), at(event)); }, {passive: false});

// -- keys
view.addEventListener('keydown', event => {
  if (!state || event.ctrlKey || event.metaKey || event.altKey) return;
  const arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
  const centre = [view.clientWidth / 2, view.clientHeight / 2];
  if (arrow && box) {
    if (event.shiftKey) {
      const grown = [box[2] + 2 * arrow[0], box[3] - 2 * arrow[1]];
      if (Math.min(...grown) >= SMALLEST_PX) box = [box[0] - arrow[0], box[1] + arrow[1], ...grown];
    } else box = [box[0] + arrow[0], box[1] + arrow[1], box[2], box[3]];
    box[0] = Math.min(Math.max(box[0], 0), state.width - box[2]); box[1] = Math.min(Math.max(box[1], 0), state.height - box[3]);
    draw(); putLater();
  } else if (event.key === 'Enter' && !box) {
    const drawn = Object.values(state.boxes).filter(sides => sides.length).map(sides => Math.max(sides[2], sides[3])).sort((a, b) => a - b);
    const side = drawn[drawn.length >> 1] || Math.max(Math.round(state.width / 20), 8);
    put([middle[0] - side / 2, middle[1] - side / 2, side, side]);
  } else if (event.key === 'Delete' || event.key === 'Backspace') put(null);
  else if (event.key === 'n' || event.key === 'N') put([]);
  else if (event.key === '+' || event.key === '=') zoomTo(zoom * 1.5, centre);
  else if (event.key === '-') zoomTo(zoom / 1.5, centre);
  else if (event.key === '.') step(1);
  else if (event.key === ',') step(-1);
  else return;
  event.preventDefault();
});

// -- what is shown beside
function load(number) {
  if (!images.has(number)) {
    const made = new Image();
    made.onload = draw; made.src = `/frame/${number}?token=${encodeURIComponent(token)}`;
    images.set(number, made);
    if (images.size > 40) images.delete(images.keys().next().value);
  }
  return images.get(number);
}
function go(number) {
  if (later) { clearTimeout(later); later = 0; put(box); }
  frame = number; box = boxOf(number); image = load(number);
  $('still').value = state.stills.indexOf(number);
  zoom = 1; middle = [state.width / 2, state.height / 2];
  show(); draw();
}
function step(by) {
  const open = state.offered.filter(number => by < 0 ? number < frame : number > frame);
  const untold = by > 0 ? open.filter(number => !(number in state.boxes)) : [];
  const next = untold.length ? untold[0] : by < 0 ? open[open.length - 1] : open[0] ?? state.offered[0];
  if (next !== undefined) go(next);
}
function say(line) { $('about').textContent = line; }
function show() {
  const boxed = Object.values(state.boxes).filter(sides => sides.length).length;
  if (state.lines.length) {
    $('work').hidden = true; $('end').hidden = false; $('done').hidden = true;
    $('written').textContent = state.lines[0]; $('command').textContent = state.lines[1] || ''; $('command').hidden = !state.lines[1];
    $('then').textContent = state.lines[1] ? 'Continue with' : 'The command goes on by itself.';
    $('count').textContent = 'written';
    return;
  }
  $('film').textContent = state.film;
  $('count').textContent = `${boxed} taught` + (boxed < state.least ? `; ${state.least} are the least, 10 are plenty` : '');
  $('done').disabled = Boolean(state.missing); $('done').title = state.missing || `Write them to ${state.folder}`;
  const told = state.boxes[frame], warning = state.warnings[frame];
  const line = document.createElement('span');
  if (warning) line.className = 'warning';
  line.textContent = warning || (told === undefined ? 'No box yet. Round the whole ball, blur included; nothing of the string.' : told.length ? `A box of ${Math.round(told[2])} x ${Math.round(told[3])} px.` : 'Said: no ball here.');
  const head = document.createElement('b');
  head.textContent = `Frame ${frame} of ${state.count}. `;
  $('about').replaceChildren(head, line);
  $('remove').disabled = told === undefined; $('none').disabled = told !== undefined && !told.length;
  const slider = $('still');
  slider.max = state.stills.length - 1; slider.parentElement.querySelector('output').textContent = `frame ${frame}`;
  const strip = $('strip');
  if (strip.dataset.frames !== String(state.offered)) {
    strip.dataset.frames = String(state.offered);
    strip.replaceChildren(...state.offered.map(number => {
      const button = document.createElement('button'), picture = document.createElement('img'), mark = document.createElement('span');
      picture.src = `/frame/${number}?token=${encodeURIComponent(token)}`; picture.alt = `frame ${number}`;
      button.append(picture, mark); button.dataset.frame = number; button.onclick = () => go(number);
      return button;
    }));
  }
  for (const button of strip.children) {
    const number = Number(button.dataset.frame), sides = state.boxes[number], odd = state.warnings[number];
    button.className = odd ? 'odd' : sides && sides.length ? 'taught' : '';
    button.lastChild.textContent = odd ? 'look again' : sides === undefined ? '' : sides.length ? 'taught' : 'no ball';
    button.setAttribute('aria-current', String(number === frame));
  }
  if (!box || state.warnings[frame] || told) draw();
}
$('next').onclick = () => step(1);
$('none').onclick = () => put([]);
$('remove').onclick = () => put(null);
$('in').onclick = () => state && zoomTo(zoom * 1.8, box ? toScreen([box[0] + box[2] / 2, box[1] + box[3] / 2]) : [view.clientWidth / 2, view.clientHeight / 2]);
$('out').onclick = () => state && zoomTo(zoom / 1.8, [view.clientWidth / 2, view.clientHeight / 2]);
$('still').oninput = () => state && go(state.stills[$('still').value]);
$('done').onclick = () => { $('done').disabled = true; refresh('done', {}); };
new ResizeObserver(() => state && moveBy(0, 0)).observe(view);

await refresh();
if (state) go(state.offered.find(number => !(number in state.boxes)) ?? state.offered[0]);
