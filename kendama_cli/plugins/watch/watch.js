'use strict';
/* Asks the run how far it is, shows it, and swaps in what was drawn anew without a flash. */
const token = new URLSearchParams(location.search).get('token');
const one = selector => document.querySelector(selector);
const follow = one('.controls input'), notice = one('.notice'), frames = {};
for (const box of document.querySelectorAll('.frame')) frames[box.dataset.part] = {box, wanted: 0, shown: 0, now: null};
const words = {'': '', waits: 'waits', runs: 'runs', ran: 'done', cached: 'cached', failed: 'failed'};
let state = null, heard = 0, seen = 0, lost = 0;

const cell = (tag, text) => Object.assign(document.createElement(tag), {textContent: text});
const time = s => s === null ? '' : s < 60 ? `${s.toFixed(0)} s` : `${Math.floor(s / 60)} min ${Math.floor(s % 60)} s`;

function row(stage) {
  const made = document.createElement('tr'), far = document.createElement('td');
  made.className = stage.state || 'later';
  const ended = stage.state === 'ran' || stage.state === 'cached';
  if (stage.state === 'runs' && stage.total) {
    far.append(Object.assign(document.createElement('progress'), {max: stage.total, value: stage.done}));
  }
  if (!ended && stage.done) far.append(stage.total ? `${stage.done} of ${stage.total}` : `${stage.done}`);
  const figures = stage.figures.map(([label, value]) => `${label} ${value}`).join(', ');
  const running = stage.state === 'runs' ? (Date.now() - heard) / 1000 : 0;
  made.append(cell('th', stage.title), cell('td', words[stage.state]), far,
    cell('td', stage.state === 'failed' ? stage.note : figures || (stage.state === 'runs' ? stage.note : '')),
    cell('td', time(stage.seconds === null ? null : stage.seconds + running)));
  return made;
}

function show() {
  const ends = {running: 'The run goes on', done: 'The run is done', failed: 'The run failed',
    interrupted: 'The run was interrupted'};
  one('h1').textContent = ends[state.outcome];
  document.title = `kendama: ${ends[state.outcome].toLowerCase()}`;
  one('.run').textContent = `Run ${state.run}, pipeline ${state.pipeline}` +
    (state.overrides.length ? `, with ${state.overrides.join(' ')}` : '');
  one('.stages tbody').replaceChildren(...state.stages.map(row));
  const over = state.outcome !== 'running';
  notice.hidden = !over && lost < 3;
  notice.textContent = over ? `The run has ended; see all of it with: kendama report ${state.run}` :
    'Nothing is heard of the run any more: this is what it said last.';
}

function fit(frame) {
  const inside = frame.now && frame.now.contentDocument;
  if (inside && inside.body) frame.now.style.height = `${inside.querySelector('main').getBoundingClientRect().height + 4}px`;
}

/* A new drawing loads unseen and takes the old one's place when it is whole. */
function draw(part) {
  const frame = frames[part];
  if (frame.coming || frame.wanted === frame.shown || (frame.now && !follow.checked)) return;
  const coming = document.createElement('iframe'), number = frame.wanted;
  coming.title = part; coming.className = 'coming'; frame.coming = coming;
  coming.onload = () => {
    if (frame.now) frame.now.remove();
    coming.className = ''; frame.now = coming; frame.coming = null; frame.shown = number;
    fit(frame); setTimeout(() => fit(frame), 300);
    draw(part);
  };
  coming.src = `/${part}?token=${encodeURIComponent(token)}&n=${number}`;
  frame.box.append(coming);
}

async function ask() {
  try {
    const answer = await fetch(`/state?token=${encodeURIComponent(token)}&seen=${seen}`, {cache: 'no-store'});
    if (!answer.ok) throw new Error(String(answer.status));
    lost = 0;
    if (answer.status === 200) {
      state = await answer.json(); heard = Date.now(); seen = state.version;
      for (const [part, number] of Object.entries(state.drawn)) { frames[part].wanted = number; draw(part); }
    }
  } catch (error) {
    lost += 1;
  }
  if (state) show();
  if (!state || state.outcome === 'running') setTimeout(ask, lost ? 2000 : 700);
}

follow.onchange = () => Object.keys(frames).forEach(draw);
addEventListener('resize', () => Object.values(frames).forEach(fit));
ask();
