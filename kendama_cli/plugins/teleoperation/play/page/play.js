// The page of 'kendama play': sends what the hand does, draws what the simulation answers. Nothing is simulated here.
const $ = id => document.getElementById(id);
const view = $('view'), pen = view.getContext('2d');
const SEND_EVERY_MS = 4, FRAME_MS = 12;
const STICK_M = 0.4, STICK_RAD = 0.6, TILT_RAD = 0.5, TILT_RATE = 4;
const LEVELS = [{gravity: 0.4, rope: 1, cup: 1.6}, {gravity: 0.7, rope: 1, cup: 1.3}, {gravity: 1, rope: 1, cup: 1}];

let socket = null, table = null, state = null, tries = [], replay = null;
let held = false, by = '', last = [0, 0], start = [0, 0], tilt = 0, tiltWanted = 0, tiltAt = 0;
let watching = false, waiting = [], sentAt = 0, moved = [], heardAt = 0, trail = [], resultUntil = 0, metre = 400;
const latencies = [];
window.kendama = {latencies, get state() { return state; }, get tries() { return tries; }, get metre() { return metre; }};

// -- the line to the simulation
function connect() {
  const address = new URL('/line', location.href);
  address.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
  address.search = new URLSearchParams({token: new URLSearchParams(location.search).get('token') || '', player: $('name').value});
  const line = socket = new WebSocket(address);
  line.onmessage = event => line === socket && hear(JSON.parse(event.data));
  line.onclose = event => {
    if (line !== socket) return;
    held = watching = false; state = null;
    if (event.code === 4001) return connect(); // a phone has taken this name, or has left it
    problem(event.reason || 'The game has ended: the program that ran it was stopped or cannot be reached.', true);
  };
}
function say(message) { if (socket && socket.readyState === 1) socket.send(JSON.stringify(message)); }
function flush() {
  if (!waiting.length) return;
  say({type: 'hand', samples: waiting, held, by});
  waiting = []; sentAt = performance.now();
}
function hear(message) {
  if (message.type === 'join') { watching = message.watching; showJoin(message);
  } else if (message.type === 'hint') { $('hint').textContent = message.line; $('hint').classList.toggle('gone', !message.line);
  } else if (message.type === 'state') {
    if (state && state.outcome !== message.outcome && message.outcome) tell(message.outcome, message.reason);
    state = message;
    rumble(message.pull);
  } else if (message.type === 'table') {
    table = message; $('problem').hidden = true;
    $('name').value = message.player; localStorage.setItem('player', message.player);
    $('folder').textContent = message.folder; $('machine').textContent = message.machine;
    for (const name of ['gravity', 'rope', 'cup']) {
      const input = $(name); [input.min, input.max] = message.ease[name]; input.value = message.conditions[name];
    }
    showEase();
    state = null; trail = [];
  } else if (message.type === 'tries') { tries = message.tries; showTries();
  } else if (message.type === 'replay') { replay = {...message, began: performance.now()}; showReplay();
  } else if (message.type === 'error') problem(message.line, false, message.stays);
}
let problems = 0, watched = 0;
function problem(line, ended, stays) {
  const number = ++problems;
  $('problem').firstChild.textContent = line; $('problem').hidden = false; $('again').hidden = !ended;
  if (!ended && !stays) setTimeout(() => { if (number === problems) $('problem').hidden = true; }, 6000);
}
$('again').onclick = connect;

// -- the hand
function place(event) { return [event.clientX / metre, -event.clientY / metre]; }
function tiltNow(t) {
  const step = TILT_RATE * Math.min(Math.max(t - tiltAt, 0), 50) / 1000;
  tilt += Math.max(-step, Math.min(step, tiltWanted - tilt)); tiltAt = Math.max(tiltAt, t);
  return tilt;
}
function sample(t, at) {
  last = at; waiting.push([t, at[0] - start[0], at[1] - start[1], tiltNow(t)]);
  moved.push(t); heardAt = performance.now();
}
function take(device, at, t) {
  if (replay) { replay = null; showReplay(); }
  flush(); held = true; by = device; start = at; tiltAt = t; view.classList.add('held'); $('hint').classList.add('gone');
  sample(t, at); flush();
}
// no sample since the last frame: the hand stands still, or its samples are on their way and will take this back
function guess(now) {
  say({type: 'hand', samples: [[now, last[0] - start[0], last[1] - start[1], tiltNow(now)]], held, by, guessed: true});
}
function letGo(t) {
  flush(); held = false; view.classList.remove('held');
  waiting.push([t, last[0] - start[0], last[1] - start[1], tilt]); flush();
}
let pointer = null;
view.addEventListener('pointerdown', event => {
  if (pointer !== null || !table || watching || (event.pointerType === 'mouse' && event.button !== 0)) return;
  pointer = event.pointerId; view.setPointerCapture(pointer); take(event.pointerType, place(event), event.timeStamp);
});
// raw updates come at the device's own rate, but on secure pages only; else each move brings those it stands for
const updates = 'onpointerrawupdate' in window ? 'pointerrawupdate' : 'pointermove';
view.addEventListener(updates, event => {
  if (event.pointerId !== pointer || !held) return;
  const all = event.getCoalescedEvents ? event.getCoalescedEvents() : [];
  for (const one of all.length ? all : [event]) sample(one.timeStamp, place(one));
  if (performance.now() - sentAt >= SEND_EVERY_MS) flush();
});
for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture'])
  view.addEventListener(kind, event => { if (event.pointerId === pointer) { pointer = null; letGo(event.timeStamp); } });
addEventListener('keydown', event => { if (event.target === document.body) tiltWanted = {a: -TILT_RAD, d: TILT_RAD}[event.key.toLowerCase()] ?? tiltWanted; });
addEventListener('keyup', event => { if ('ad'.includes(event.key.toLowerCase())) tiltWanted = 0; });

// -- a gamepad: its stick is where the cup is, its motors are the rope's pull
let pad = null, shookAt = 0;
function pads() { return [...(navigator.getGamepads?.() ?? [])].filter(one => one); }
function poll() {
  pad = pads()[0] ?? null;
  if (!pad || !table || watching || pointer !== null) return;
  const pressed = Boolean(pad.buttons[0]?.pressed), t = performance.now();
  const at = [pad.axes[0] * STICK_M, -pad.axes[1] * STICK_M];
  tiltWanted = (pad.axes[2] ?? 0) * STICK_RAD;
  if (pressed && !held) take('gamepad', at, t);
  else if (!pressed && held) letGo(t);
  else if (held) { sample(t, at); flush(); }
}
setInterval(poll, SEND_EVERY_MS);
function rumble(pull) {
  const now = performance.now();
  if (!pad || !held || now - shookAt < 50 || pull < 0.05) return;
  shookAt = now;
  pad.vibrationActuator?.playEffect?.('dual-rumble', {duration: 80, weakMagnitude: Math.min(1, pull / 3), strongMagnitude: Math.min(1, pull / 8)});
}

// -- the picture
function fit() {
  const ratio = devicePixelRatio || 1, {width, height} = view.getBoundingClientRect();
  view.width = Math.round(width * ratio); view.height = Math.round(height * ratio);
  metre = Math.min(height / 1.5, width / 1.25);
}
new ResizeObserver(fit).observe(view); fit();
const colour = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
let paint = {};
function paints() { paint = Object.fromEntries(['cup', 'ball', 'ink', 'soft', 'line'].map(name => [name, colour('--' + name)])); }
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', paints); paints();

function draw() {
  requestAnimationFrame(draw);
  const now = performance.now();
  flush();
  if (watching) waiting = [];
  else if (held && now - heardAt > FRAME_MS) guess(now);
  else if (!held && state && state.phase !== 'ready') { waiting.push([now, last[0] - start[0], last[1] - start[1], tilt]); flush(); }
  if (!table) return;
  const ratio = devicePixelRatio || 1, width = view.width / ratio, height = view.height / ratio;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.translate(width / 2, height * 0.63);
  pen.scale(metre, -metre);
  if (replay) drawReplay(now); else drawGame();
  if (state && !replay) measure(performance.now());
  if (resultUntil && now > resultUntil) { $('result').className = ''; resultUntil = 0; }
}
function drawGame() {
  const game = table.game;
  const seen = state && state.phase !== 'ready' ? state : {cup: [0, 0, 0], ball: [0, -game.rope]};
  if (!state || state.phase === 'ready') trail = [];
  else if (!trail.length || Math.hypot(seen.ball[0] - trail[0][0], seen.ball[1] - trail[0][1]) > 0.004) trail.unshift(seen.ball);
  if (trail.length > 70) trail.length = 70;
  scene(game, seen.cup, seen.ball, trail);
}
function drawReplay(now) {
  const t = (now - replay.began) / 1000 * replay.speed % (replay.times.at(-1) + 0.4);
  let k = replay.times.findIndex(one => one >= t);
  if (k < 0) k = replay.times.length - 1;
  const [x, z, lean, bx, bz] = replay.frames[k];
  scene(replay.game, [x, z, lean], [bx, bz], replay.frames.slice(0, k + 1).reverse().map(one => [one[3], one[4]]));
}
function scene(game, [x, z, lean], ball, past) {
  pen.lineCap = pen.lineJoin = 'round';
  pen.strokeStyle = paint.line; pen.lineWidth = 0.003;
  pen.setLineDash([0.002, 0.014]); pen.beginPath(); pen.moveTo(-3, 0); pen.lineTo(3, 0); pen.stroke(); pen.setLineDash([]);
  pen.strokeStyle = paint.ball; pen.lineCap = 'butt';
  for (let k = 1; k < past.length; k++) {
    pen.globalAlpha = 0.35 * (1 - k / past.length); pen.lineWidth = 0.012 * (1 - 0.7 * k / past.length);
    pen.beginPath(); pen.moveTo(...past[k - 1]); pen.lineTo(...past[k]); pen.stroke();
  }
  pen.globalAlpha = 1; pen.lineCap = 'round';
  pen.save(); pen.translate(x, z); pen.rotate(-lean);
  const r = game.cup.radius + game.cup.wall, d = game.cup.depth, foot = r * 0.62;
  pen.fillStyle = paint.cup;
  pen.beginPath(); pen.moveTo(-0.011, game.cup.floor); pen.lineTo(-0.014, -0.1); pen.quadraticCurveTo(0, -0.118, 0.014, -0.1); pen.lineTo(0.011, game.cup.floor); pen.fill();
  pen.restore();
  rope(game.rope, x, z, ball);
  pen.save(); pen.translate(x, z); pen.rotate(-lean); pen.translate(0, game.cup.floor); pen.fillStyle = paint.cup;
  pen.globalAlpha = 0.22; pen.beginPath(); pen.moveTo(-r, d); pen.lineTo(r, d); pen.lineTo(foot, 0); pen.lineTo(-foot, 0); pen.fill(); pen.globalAlpha = 1;
  pen.restore();
  const shine = pen.createRadialGradient(ball[0] - game.ball * 0.35, ball[1] + game.ball * 0.4, game.ball * 0.1, ball[0], ball[1], game.ball);
  shine.addColorStop(0, '#ffd9b8'); shine.addColorStop(0.35, paint.ball); shine.addColorStop(1, paint.ball);
  pen.fillStyle = shine; pen.beginPath(); pen.arc(ball[0], ball[1], game.ball, 0, 7); pen.fill();
  pen.save(); pen.translate(x, z); pen.rotate(-lean); pen.translate(0, game.cup.floor);
  pen.strokeStyle = paint.cup; pen.lineWidth = 0.009;
  pen.beginPath(); pen.moveTo(-r, d); pen.bezierCurveTo(-r, d * 0.35, -foot, 0.004, -foot * 0.6, 0.002);
  pen.lineTo(foot * 0.6, 0.002); pen.bezierCurveTo(foot, 0.004, r, d * 0.35, r, d); pen.stroke();
  pen.globalAlpha = 0.28; pen.fillStyle = paint.cup; pen.fill(); pen.globalAlpha = 1;
  pen.restore();
}
function rope(length, x, z, ball) {
  const dx = ball[0] - x, dz = ball[1] - z, far = Math.hypot(dx, dz);
  const sag = far < length ? 0.87 * Math.sqrt(length * length - far * far) : 0;
  pen.strokeStyle = paint.ink; pen.lineWidth = 0.0045;
  pen.beginPath(); pen.moveTo(x, z); pen.quadraticCurveTo(x + dx / 2, z + dz / 2 - sag, ball[0], ball[1]); pen.stroke();
}
function measure(now) {
  if (watching) { // of each sample of a phone, whose clock is this one's in a test only
    if (state.t !== watched && state.phase !== 'ready') latencies.push(performance.timeOrigin + now - state.t + table.delay_ms);
    watched = state.t; return;
  }
  // of each sample of the hand: until the ball that it moved was drawn, with what smoothing takes
  while (moved.length && moved[0] <= state.t + 0.01) latencies.push(now - moved.shift() + table.delay_ms);
  if (latencies.length > 6000) latencies.splice(0, 3000);
  if (moved.length > 2000) moved = [];
  if (now - (measure.shown ?? 0) < 500) return;
  measure.shown = now;
  const recent = latencies.slice(-200).sort((a, b) => a - b);
  if (recent.length > 20) $('status').textContent = `hand to ball ${recent[recent.length >> 1].toFixed(0)} ms`;
}

// -- what stands beside the game
function showJoin(message) {
  $('join').hidden = false; $('code').src = message.picture; $('joined').hidden = !watching; $('invited').hidden = watching;
  if (watching) $('status').textContent = '';
}
function tell(outcome, reason) {
  const lines = {caught: 'Caught!', missed: 'Missed: once more?', interrupted: `The try was interrupted: ${reason}.`};
  $('result').textContent = lines[outcome]; $('result').className = 'shown ' + outcome;
  resultUntil = performance.now() + {caught: 1800, missed: 1100, interrupted: 4000}[outcome];
  if (outcome === 'caught') navigator.vibrate?.(40);
}
function showReplay() {
  $('replay').hidden = !replay;
  if (replay) $('replay').firstChild.textContent = `${replay.name}, ${replay.speed === 0.25 ? 'quarter' : replay.speed + ' x'} speed`;
}
$('stop').onclick = () => { replay = null; showReplay(); };
function showEase() {
  const now = Object.fromEntries(['gravity', 'rope', 'cup'].map(name => [name, Number($(name).value)]));
  const texts = {gravity: `${Math.round(100 * now.gravity)} %`, rope: `${(now.rope * table.robot.rope * 100).toFixed(0)} cm`, cup: `${(2 * now.cup * table.robot.cup * 100).toFixed(0)} cm`};
  for (const name in texts) $(name).parentNode.querySelector('output').textContent = texts[name];
  document.querySelectorAll('#levels button').forEach((button, n) =>
    button.setAttribute('aria-pressed', Object.entries(LEVELS[n]).every(([name, value]) => Math.abs(now[name] - value) < 0.01)));
  return now;
}
for (const name of ['gravity', 'rope', 'cup']) {
  $(name).oninput = showEase;
  $(name).onchange = () => say({type: 'ease', ...showEase()});
}
document.querySelectorAll('#levels button').forEach((button, n) => { button.onclick = () => {
  for (const name in LEVELS[n]) $(name).value = LEVELS[n][name];
  say({type: 'ease', ...showEase()});
}; });
function make(kind, properties, ...children) {
  const {data, ...rest} = properties, made = Object.assign(document.createElement(kind), rest);
  for (const key in data) made.setAttribute(key, data[key]);
  made.append(...children);
  return made;
}
function showTries() {
  const caught = tries.filter(one => one.outcome === 'caught').length, chosen = tries.filter(one => one.chosen).length;
  let row = 0;
  for (let k = tries.length - 1; k >= 0 && tries[k].outcome === 'caught'; k--) row++;
  $('tried').textContent = tries.length; $('caught').textContent = caught; $('row').textContent = row;
  $('none').hidden = tries.length > 0; $('onward').hidden = chosen === 0;
  $('chosen').textContent = chosen === 1 ? 'one try' : `${chosen} tries`;
  $('tries').replaceChildren(...[...tries].reverse().map(one => make('li', {className: one.outcome}, make('i', {}),
    make('button', {className: 'name', title: 'Show in slow motion', textContent: one.name, onclick: () => say({type: 'show', name: one.name})}),
    make('span', {className: 'about', title: one.conditions, textContent: `${one.outcome}, ${one.duration_s.toFixed(1)} s, ${one.ease}${one.note && '; '}${one.note}`}),
    make('span', {className: 'do'},
      make('button', {className: 'robot', textContent: 'robot', title: 'For the robot: capture=play takes it', data: {'aria-pressed': one.chosen, 'aria-label': `${one.name} for the robot`},
        onclick: () => say({type: 'choose', name: one.name, value: one.chosen ? 'no' : 'yes'})}),
      make('button', {textContent: '✎', title: 'Give it a name', data: {'aria-label': `rename ${one.name}`},
        onclick: () => { const name = prompt('A name for this try', one.name); if (name) say({type: 'rename', name: one.name, value: name}); }}),
      make('button', {textContent: '✕', title: 'Delete it and its file', data: {'aria-label': `delete ${one.name}`},
        onclick: () => { if (confirm(`Delete ${one.name} and its file?`)) say({type: 'delete', name: one.name}); }})))));
}
$('player').onsubmit = event => { event.preventDefault(); $('name').blur(); connect(); };
$('name').value = new URLSearchParams(location.search).get('player') || localStorage.getItem('player') || 'me';
connect(); requestAnimationFrame(draw);
