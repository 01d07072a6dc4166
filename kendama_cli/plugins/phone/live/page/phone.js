// The phone's page of 'kendama play --phone': sends what its sensors say, and tells what came of it. Nothing is kept here.
const $ = id => document.getElementById(id);
const query = new URLSearchParams(location.search), session = crypto.randomUUID?.() ?? String(Math.random());
const IDLE_MS = 500, MOST = 400, WAIT_MS = 2000;
// WebKit, in every browser on iOS, gives all acceleration with the other sign than the specification and Android do
const sign = navigator.vendor.startsWith('Apple') ? -1 : 1;
let samples = [], going = false, turned = false, lastAt = 0, times = [], lock = null, wake = () => {};
const counts = {caught: 0, missed: 0};
window.kendama = {counts, get hint() { return $('hint').textContent; }};

function problem(line) { $('problem').textContent = line; $('problem').hidden = !line; }
$('name').value = query.get('player') || localStorage.getItem('player') || 'me';
if (!isSecureContext) problem('Without HTTPS this browser gives no sensors: open the https address that the laptop shows.');
else if (!('DeviceMotionEvent' in window)) problem('This browser gives no motion sensors: use Chrome, Safari or Firefox on a phone.');

$('join').onsubmit = async event => {
  event.preventDefault();
  if (!isSecureContext || !('DeviceMotionEvent' in window)) return;
  try { // iOS asks the player, and only after a press
    if (DeviceMotionEvent.requestPermission && await DeviceMotionEvent.requestPermission() !== 'granted')
      return problem('The sensors were denied: close this page, open it again and allow motion. On Android, see the site settings.');
  } catch (error) { return problem(`The sensors cannot be asked for (${error.message}): press Start again.`); }
  problem(''); $('join').hidden = true; $('play').hidden = false;
  localStorage.setItem('player', $('name').value);
  navigator.wakeLock?.request('screen').then(one => { lock = one; }, () => {});
  going = true;
  addEventListener('devicemotion', take);
  setTimeout(() => { if (going && !times.length) problem('No sample has come: this device has no motion sensors, or they are switched off for this site.'); }, WAIT_MS);
  send();
};
function take(event) {
  const a = event.accelerationIncludingGravity, w = event.rotationRate;
  if (!going || !a || a.x === null) return;
  if (!w || w.alpha === null) return problem('This phone has no gyroscope, which the lean needs: use another phone.');
  const t = performance.timeOrigin + event.timeStamp;
  if (t <= lastAt) return;
  lastAt = t;
  if (!times.length) problem('');
  times.push(t); if (times.length > 50) times.shift();
  // alpha, beta and gamma are the rates about x, y and z in all browsers, whatever older texts say
  samples.push([t, sign * a.x, sign * a.y, sign * a.z, w.alpha, w.beta, w.gamma]);
  if (samples.length > MOST) samples.shift();
  wake();
}
// over fetch: Safari refuses WebSockets to a certificate that was accepted for the page alone
async function send() { // one request at a time, with all samples since the last one
  while (going) {
    if (!samples.length) await new Promise(done => { wake = done; setTimeout(done, IDLE_MS); });
    const body = JSON.stringify({samples, turned});
    samples = [];
    try {
      const asked = new URLSearchParams({token: query.get('token') || '', player: $('name').value, session});
      const answer = await fetch(`/joined?${asked}`, {method: 'POST', body, headers: {'Content-Type': 'application/json'}});
      if (!answer.ok) { going = false; problem(await answer.text()); break; }
      for (const one of await answer.json()) hear(one);
    } catch {
      problem('The laptop does not answer: stay in its network; the game may have ended.');
      await new Promise(done => setTimeout(done, IDLE_MS));
    }
  }
}
function hear(message) {
  if (message.type === 'hint') {
    $('hint').textContent = message.line;
    $('turned').hidden = !message.line.startsWith('The top edge');
    problem('');
  } else if (message.type === 'outcome') {
    if (message.outcome in counts) $(message.outcome).textContent = ++counts[message.outcome];
    $('result').textContent = {caught: 'Caught!', missed: 'Missed: once more?'}[message.outcome] ?? `Interrupted: ${message.reason}.`;
    $('result').className = message.outcome;
    navigator.vibrate?.(message.outcome === 'caught' ? [60, 40, 120] : 30);
  } else if (message.type === 'error') problem(message.line);
  else if (message.type === 'ended') { going = false; problem(message.line); }
}
setInterval(() => {
  const span = times.length > 1 ? (times.at(-1) - times[0]) / (times.length - 1) : 0;
  $('rate').textContent = span ? Math.round(1000 / span) : 0;
}, 500);
$('turned').onclick = () => { turned = !turned; };
document.addEventListener('visibilitychange', () => {
  if (!going) return;
  if (document.hidden) problem('In the background the sensors stop: keep this page open.');
  else { problem(''); navigator.wakeLock?.request('screen').then(one => { lock = one; }, () => {}); }
});
