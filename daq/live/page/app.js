'use strict';
// The page of the live view. Messages are those of daq/live/messages.hpp.
const at = id => document.getElementById(id);
const kPoints = 1800;      // of the curves over time: a minute at 30 ticks a second
const kGap_s = 1;          // no line is drawn across a longer silence
const kSilent_s = 1;       // without a tick from the runner: it is waiting
const kMostLines = 500;
const kNear = 0.9;         // of a limit
const kAtRest_rpm = 96;    // slower: at rest, as for the drivers: 10 rad/s

const kMostGhost = 20000;  // points of one run
const kNearGhost_s = 1.5;  // of bench time: the simulated one may be fast
const state = { hello: null, limits: [], tick: null, trace: [], steps: [], ended: false, asked: false, drawn: 0, cost: 0,
                numbersDue: false, chartsDue: false, stepsDue: false, curve: 'thrust', question: null, well: true, atRest: false, held: {},
                run: null, before: new Map() };

/// What the lower chart can show: unit, and the value of a tick.
const kCurves = {
  thrust: ['Thrust', 'N', tick => tick.thrust_n, 3],
  torque: ['Torque', 'mN m', tick => tick.torque_nm === null ? null : 1e3 * tick.torque_nm, 1],
  power: ['Power', 'W', tick => product(tick.supply_v ?? tick.module_v, tick.supply_a ?? tick.module_a), 1],
  current: ['Current', 'A', tick => tick.supply_a ?? tick.module_a, 2],
  voltage: ['Voltage', 'V', tick => tick.supply_v ?? tick.module_v, 2],
  coil: ['Coil', '°C', tick => tick.coil_degc, 1],
};
const kCurveNames = Object.keys(kCurves);
const product = (a, b) => a === null || b === null || a === undefined || b === undefined ? null : a * b;

// ---- numbers as text
const fixed = (value, digits) => value === null || value === undefined ? '?'
  : value.toFixed(digits).replace(/^-(?=0\.?0*$)/, '').replace('-', '−');
const thousands = value => value === null || value === undefined ? '?' : Math.round(value).toString().replace(/\B(?=(\d{3})+$)/g, ' ');
const clock = seconds => {
  const whole = Math.max(0, Math.round(seconds)), two = n => String(n).padStart(2, '0');
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return h ? `${h}:${two(m)}:${two(s)}` : `${two(m)}:${two(s)}`;
};
const text = (id, value) => { const node = at(id); if (node.textContent !== value) node.textContent = value; };

// ---- charts
const colour = name => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const occlusionColours = () => matchMedia('(prefers-color-scheme: dark)').matches
  ? ['#4fd6a0', '#6db3ff', '#ffa04d', '#ff7ab8', '#c9a6ff', '#ffe066', '#66e0ff', '#ff8a80']
  : ['#0a7d55', '#0b62c4', '#c65a00', '#b0126f', '#6a3fc0', '#857000', '#007a99', '#a01818'];
/// Dragging zooms, dragging with Shift moves, a double click follows the run again; what is under the pointer is read out.
const hands = name => {
  const known = Dygraph.defaultInteractionModel, hold = () => { state.held[name] = true; };
  return { ...known,
    mousemove(event, chart, context) {
      known.mousemove && known.mousemove(event, chart, context);
      if (context.isZooming || context.isPanning) hold();
    },
    mousedown(event, chart, context) { context.initializeMouseDown(event, chart, context); known.mousedown(event, chart, context); },
    touchmove(event, chart, context) { hold(); known.touchmove(event, chart, context); },
    dblclick() { state.held[name] = false; state.chartsDue = state.stepsDue = true; } };
};
const readOut = (name, words) => ({
  highlightCallback: (event, x, points) => text(name + '_read', words(x, points.filter(point => Number.isFinite(point.yval)))),
  unhighlightCallback: () => text(name + '_read', ''),
  zoomCallback: () => { state.held[name] = true; } });
/// Numbers of an axis that spans this: two digits of it.
const axisOf = span => value => fixed(value, Math.min(4, Math.max(0, Math.ceil(1 - Math.log10(span)))));
const common = name => ({ legend: 'never', interactionModel: hands(name), showLabelsOnHighlight: false, highlightCircleSize: 0,
  gridLineColor: colour('line'), axisLineColor: colour('line'), rightGap: 12, strokeWidth: 2, animatedZooms: false,
  axisLabelFontSize: 14, xAxisHeight: 24 });
const charts = {};

function makeCharts() {
  for (const chart of Object.values(charts)) chart.destroy();
  // Before anything was measured: axes as they will be.
  const empty = n => [[0, ...Array(n).fill(null)], [1, ...Array(n).fill(null)]];
  const rpm = [0, 1.06 * Math.max(state.hello.speed_max_rpm, 100)], minute = [0, 60];
  charts.speed = new Dygraph(at('speed_chart'), empty(2), { ...common('speed'),
    ...readOut('speed', (x, points) => `${fixed(x, 1)} s: ` + points.map(p => `${p.name} ${thousands(p.yval)}`).join(', ')),
    labels: ['t', 'commanded', 'measured'],
    colors: [colour('commanded'), colour('measured')], series: { commanded: { stepPlot: true, strokeWidth: 3 } },
    dateWindow: minute, valueRange: rpm, axes: { y: { axisLabelWidth: 62, axisLabelFormatter: thousands } } });
  charts.thrust = new Dygraph(at('thrust_chart'), empty(2), { ...common('thrust'),
    ...readOut('thrust', (x, points) => { const [, unit, , digits] = kCurves[state.curve];
      return `${fixed(x, 1)} s: ` + points.map(p => `${p.name === 'before' ? 'before ' : ''}${fixed(p.yval, digits)} ${unit}`).join(', '); }),
    labels: ['t', 'before', 'now'], series: { before: { strokePattern: [6, 4], strokeWidth: 1.5 } },
    colors: [colour('soft'), colour('thrust')], dateWindow: minute, valueRange: [0, 2],
    axes: { y: { axisLabelWidth: 62, axisLabelFormatter: axisOf(2) } } });
  charts.k = new Dygraph(at('k_chart'), empty(1), { ...common('k'),
    ...readOut('k', (x, points) => points.map(p => `φ ${p.name}: ${fixed(p.yval, 4)} at ${thousands(x)} RPM`).join(', ')),
    labels: ['x', 'k'], strokeWidth: 0, drawPoints: true, dateWindow: rpm, valueRange: [0, 2],
    pointSize: 5, drawPointCallback: drawStep,
    axes: { x: { axisLabelFormatter: thousands }, y: { axisLabelWidth: 62, axisLabelFormatter: axisOf(2) } } });
  for (const place of document.querySelectorAll('.chart')) place.style.width = place.style.height = '';  // set by a chart made while hidden
  state.chartsDue = state.stepsDue = true;
}

/// A dot with a bar of plus and minus one standard uncertainty.
function drawStep(chart, name, ctx, x, y, paint, size, row) {
  const step = state.steps[row];
  ctx.fillStyle = ctx.strokeStyle = paint;
  if (step && step.u_k_n_s2) {
    const half = Math.abs(chart.toDomYCoord(0) - chart.toDomYCoord(1e6 * step.u_k_n_s2));
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.moveTo(x, y - half);
    ctx.lineTo(x, y + half);
    ctx.stroke();
  }
  ctx.beginPath();
  ctx.arc(x, y, size, 0, 2 * Math.PI);
  ctx.fill();
}

/// What the run before this one at the same φ showed as long after its start; null: nothing.
function ghostAt(time_s) {
  const ghost = state.run && state.before.get(state.run.occlusion_deg);
  if (!ghost) return null;
  const since = time_s - state.run.began_s, column = 1 + kCurveNames.indexOf(state.curve);
  let low = 0, high = ghost.length - 1;
  while (low < high) { const middle = (low + high) >> 1; ghost[middle][0] < since ? low = middle + 1 : high = middle; }
  return ghost.length && Math.abs(ghost[low][0] - since) < kNearGhost_s ? ghost[low][column] : null;
}

/// Where nobody has zoomed: the newest minute, whole.
const view = (name, dateWindow, valueRange) => state.held[name] ? {} : { dateWindow, valueRange };

function drawTraces() {
  const rows = state.trace;
  if (rows.length < 2) return;
  const window_ = [rows[0].t, rows[rows.length - 1].t], column = kCurveNames.indexOf(state.curve);
  const shown = rows.map(row => [row.t, ghostAt(row.t), row.values[column] ?? null]);
  let top = -Infinity, bottom = Infinity;
  for (const [, before, now] of shown)
    for (const value of [before, now]) if (value !== null) { top = Math.max(top, value); bottom = Math.min(bottom, value); }
  if (state.curve === 'thrust') { top = Math.max(top, 1); bottom = Math.min(bottom, 0); }
  if (!(top > -Infinity)) [bottom, top] = [0, 1];
  const room = Math.max(0.08 * (top - bottom), 1e-3 * Math.abs(top), 1e-3);
  const speedTop = 1.06 * Math.max(state.hello.speed_max_rpm, 100);
  charts.speed.updateOptions({ file: rows.map(row => [row.t, row.commanded, row.measured]), ...view('speed', window_, [0, speedTop]) });
  charts.thrust.updateOptions({ file: shown, ...view('thrust', window_, [bottom - room, top + room]),
    axes: { y: { axisLabelWidth: 62, axisLabelFormatter: axisOf(top - bottom + 2 * room) } } });
  at('ghost_key').hidden = !shown.some(([, before]) => before !== null);
}

function drawSteps() {
  const steps = state.steps.sort((a, b) => a.speed_rpm - b.speed_rpm);
  if (steps.length === 0) return;
  const angles = [...new Set(steps.map(step => step.occlusion_deg))].sort((a, b) => a - b);
  const paints = angles.map((_, i) => occlusionColours()[i % 8]);
  const rows = steps.map(step => [step.speed_rpm,
    ...angles.map(angle => angle === step.occlusion_deg ? 1e6 * step.k_n_s2 : null)]);
  // Below a third of the highest speed noise hides the thrust: such points do not set the scale.
  const fastest = steps[steps.length - 1].speed_rpm, u = step => step.u_k_n_s2 || 0;
  const shown = steps.filter(step => step.speed_rpm >= fastest / 3);
  const low = 1e6 * Math.min(...shown.map(step => step.k_n_s2 - u(step)));
  const high = 1e6 * Math.max(...shown.map(step => step.k_n_s2 + u(step)));
  const room = Math.max(0.08 * (high - low), 0.01 * Math.abs(high)) || 1;
  charts.k.updateOptions({ file: rows.length > 1 ? rows : [rows[0], rows[0]], labels: ['x', ...angles.map(a => a + '°')],
    colors: paints, ...view('k', [0, 1.05 * rows[rows.length - 1][0]], [low - room, high + room]),
    axes: { x: { axisLabelFormatter: thousands }, y: { axisLabelWidth: 62, pixelsPerLabel: 16, axisLabelFormatter: axisOf(high - low + 2 * room) } } });
  at('k_keys').replaceChildren(...angles.map((angle, i) => {
    const key = document.createElement('span');
    key.className = 'key';
    key.textContent = angle + '°';
    key.style.color = paints[i];
    return key;
  }));
}

// ---- numbers
function showNumbers() {
  const tick = state.tick;
  if (!tick) return state.question && showFirstQuestion(state.question);
  const untared = tick.thrust_n === null && tick.thrust_age_s < kSilent_s;
  showFigure('thrust', tick.thrust_n, value => fixed(value, 3), tick.thrust_age_s,
    tick.torque_nm === null ? '\u00a0' : `torque ${fixed(1e3 * tick.torque_nm, 1)} mN m`, untared ? 'no zero yet' : '');
  const turns = tick.step >= 0;
  showFigure('speed', tick.speed_rpm, thousands, tick.speed_age_s,
    turns ? `commanded ${thousands(tick.commanded_rpm)}` : 'not commanded');
  at('speed_beside').classList.toggle('off', turns && !state.ended && tick.speed_rpm !== null &&
    Math.abs(tick.speed_rpm - tick.commanded_rpm) > 0.05 * tick.commanded_rpm + 100);
  at('run_place').hidden = !tick.runs;
  const next = state.question || tick;
  text('run', `${next.run}/${Math.max(next.run, tick.runs)}`);
  text('occlusion', fixed(next.occlusion_deg, 0) + '°');
  text('repetition', `${next.repetition}/${Math.max(next.repetition, tick.repetitions)}`);
  const waits = state.question !== null || (tick.silent_s > kSilent_s && !state.ended);
  text('step', state.ended ? '–' : waits ? 'waiting' : turns ? `${tick.step + 1}/${tick.steps}` : tick.phase || '–');
  text('step_word', state.ended || (turns && !waits) ? 'step' : '');
  text('left', state.ended ? '–' : clock(tick.remaining_s || 0));
  at('progress_bar').style.transform = `scaleX(${Math.min(1, Math.max(0, tick.progress))})`;
  at('progress').setAttribute('aria-valuenow', Math.round(100 * tick.progress));
  if (state.hello.weighs && tick.phase === 'measuring' && !state.ended) banner('', 'Measuring.', 'Hands off.');
  showReadings(tick);
  showLimits(tick);
}

/// Asked before the first run: no reading yet but that of the rest.
function showFirstQuestion(question) {
  const { occlusion_deg, repetition, run, has_power } = question;
  for (const [id, words] of Object.entries({ run, repetition, occlusion: fixed(occlusion_deg, 0) + '°', step: 'waiting', step_word: '', speed: '0',
    speed_beside: 'at rest', thrust_beside: 'not measured now', ...(has_power ? {} : { supply: 'off', module: 'no power' }) })) text(id, String(words));
}

/// A stale value is a '?' with its age; `none` is the reason why there is no value yet. While a person is asked, the
/// rotor is at rest: kphi watches it. After the end nobody reads it.
function showFigure(id, value, words, age_s, beside, none = '') {
  const silent_s = Math.max(age_s, state.tick.silent_s), asked = state.question !== null && !state.ended;
  const stale = !asked && !none && (value === null || state.tick.silent_s > kSilent_s);
  text(id, state.ended || none ? '–' : asked ? (id === 'speed' ? '0' : '–') : stale ? '?' : words(value));
  const rest = id !== 'speed' || value === null ? '' : value <= kAtRest_rpm ? ', at rest' : state.atRest ? ', then at rest' : ', not seen at rest';
  text(id + '_beside', state.ended ? `last value ${words(value)}${rest}` : asked ? (id === 'speed' ? 'at rest' : 'not measured now')
    : none || (stale ? `no reading for ${fixed(silent_s, 1)} s` : beside));
  at(id).closest('.figure').classList.toggle('stale', stale && !state.ended);
  at(id).closest('.figure').classList.toggle('over', state.ended);
}

function showReadings(tick) {
  const electric = (volts, amps) => volts === null || amps === null ? 'none'
    : `${fixed(volts, 2)} V · ${fixed(amps, 2)} A · ${fixed(volts * amps, 0)} W`;
  const off = state.question !== null && !state.question.has_power;
  text('supply', off ? 'off' : electric(tick.supply_v, tick.supply_a));
  text('module', off ? 'no power' : electric(tick.module_v, tick.module_a).replace('none', '?'));
  text('coil', fixed(tick.coil_degc, 0) + ' °C');
  const faulty = tick.fault_bits !== 0 || (tick.derate !== null && tick.derate < 0.9999);
  text('drive', tick.fault_bits !== 0 ? `fault 0x${tick.fault_bits.toString(16)}`
    : tick.derate === null ? '?' : faulty ? `derates to ${fixed(100 * tick.derate, 0)} %` : 'no fault');
  at('drive').classList.toggle('bad', faulty);
  const rms = Math.hypot(...(tick.vibration || [null]).slice(0, 3).map(each => each ?? NaN));
  text('vibration', Number.isNaN(rms) ? '–' : `${fixed(rms, 2)} N` + (tick.blade_pass_n === null ? ''
    : ` · ${fixed(tick.blade_pass_n, 2)} N at ${fixed(tick.blade_pass_hz, 0)} Hz`));
  text('received', thousands(tick.samples));
  text('samples_word', tick.runs ? 'Samples so far' : 'Samples');
  text('lost', `${thousands(tick.lost_network)}, ${thousands(tick.lost_host)}`);
  at('lost').classList.toggle('bad', tick.lost_network + tick.lost_host > 0);
}

// ---- limits of the guard, and who set them
function makeLimits(limits) {
  state.limits = limits;
  at('limits').replaceChildren(...limits.map(limit => {
    const row = document.createElement('div'), bar = document.createElement('div');
    row.className = 'limit';
    row.title = `${limit.name} ${limit.lower ? 'below' : 'above'} ${limitNumber(limit, limit.limit)} ${limit.unit} coasts the motor. Set by: ${limit.source}`;
    bar.append(document.createElement('i'));
    row.append(document.createElement('b'), bar, document.createElement('span'), document.createElement('small'));
    row.children[0].textContent = limit.name;
    row.children[3].textContent = limit.source;
    return row;
  }));
  showLimits({ watched: {} });
}

/// Three digits of the limit.
const limitNumber = (limit, value) => value === null || value === undefined ? '–' : limit.limit >= 1000 ? thousands(value)
  : fixed(value, Math.max(0, 2 - Math.floor(Math.log10(limit.limit))));

function showLimits(tick) {
  state.limits.forEach((limit, i) => {
    const row = at('limits').children[i], value = tick.watched[limit.key] ?? null;
    const share = value === null ? 0 : limit.lower ? limit.limit / value : value / limit.limit;
    const holds = limit.lower ? (share > 1 ? '<' : '≥') : (share > 1 ? '>' : '≤');
    const words = `${limitNumber(limit, value)} ${holds} ${limitNumber(limit, limit.limit)} ${limit.unit}`;
    if (row.children[2].textContent !== words) row.children[2].textContent = words;
    row.querySelector('i').style.transform = `scaleX(${Math.min(1, Math.max(0, share)).toFixed(3)})`;
    row.classList.toggle('near', share >= kNear && share <= 1);
    row.classList.toggle('over', share > 1);
  });
}

function addLine(time_s, words) {
  const lines = at('lines'), line = document.createElement('li'), when = document.createElement('time');
  when.textContent = `${time_s.toFixed(1)} s`;
  line.append(when, words);
  lines.prepend(line);
  if (lines.children.length > kMostLines) lines.lastChild.remove();
}

// ---- time of day, sound, title
const tell = () => text('clock', new Date().toLocaleTimeString([], { hour12: false }));
setInterval(tell, 1000);
tell();

let tones = null;  // only a click may make it
at('sound').addEventListener('click', () => {
  tones = tones ? (tones.close(), null) : new AudioContext();
  at('sound').setAttribute('aria-pressed', String(tones !== null));
  text('sound', tones ? 'sound on' : 'sound off');
  if (tones) tone(0, 660, 0.1);
});
function tone(after_s, hertz, seconds) {
  const oscillator = tones.createOscillator(), gain = tones.createGain(), from = tones.currentTime + after_s;
  oscillator.frequency.value = hertz;
  gain.gain.value = 0.2;
  oscillator.connect(gain).connect(tones.destination);
  oscillator.start(from);
  oscillator.stop(from + seconds);
}
function alarm() { if (tones) for (let i = 0; i < 6; ++i) tone(0.4 * i, i % 2 ? 880 : 660, 0.3); }

/// As the state is.
function showTitle() {
  const { tick, hello } = state, turning = tick && (tick.step >= 0 || tick.speed_rpm > kAtRest_rpm) && !state.question;
  const words = !hello ? '' : state.ended ? (state.well ? 'finished – ' : 'STOPPED – ') : state.asked ? 'stopping – '
    : state.question ? 'waiting – ' : hello.replay ? 'replay – ' : turning ? 'turning – ' : '';
  const all = `${words}${hello ? hello.name : 'kphi'} – kphi`;
  if (document.title !== all) document.title = all;
}

// ---- stop
function banner(kind, title, words) {
  at('banner').className = kind;
  text('banner_title', title);
  text('banner_text', words);
  at('banner').hidden = title === '';
}

function showStop() {
  document.body.classList.toggle('over', state.ended);
  const button = at('stop'), replay = state.hello && state.hello.replay;
  const open = link !== null && link.readyState === WebSocket.OPEN;
  const word = state.ended ? (replay ? 'REPLAY OVER' : 'ENDED') : replay ? 'REPLAY' : state.asked ? 'STOPPING' : 'STOP';
  text('stop_word', word);
  at('stop_word').classList.toggle('long', word.length > 5);
  text('stop_keys', replay ? 'recorded run' : state.ended ? 'see the log' : open ? 'Space or Esc' : 'no connection');
  button.classList.toggle('asked', state.asked && !state.ended);
  button.classList.toggle('over', state.ended);
  button.disabled = state.ended || replay || !open;
}

function stop() {
  if (state.ended || !state.hello || state.hello.replay || !link || link.readyState !== WebSocket.OPEN) return;
  link.send('stop');
  banner('', 'STOP sent.', 'Waiting for kphi to confirm.');
}

const steers = () => state.hello && (state.hello.by_hand || state.hello.weighs) && !state.ended && link && link.readyState === WebSocket.OPEN;
const kSteering = { ArrowUp: 'up', ArrowDown: 'down', Enter: 'hold' };
for (const word of Object.values(kSteering)) at(word).addEventListener('click', () => { if (steers()) link.send(word); });

addEventListener('keydown', event => {
  if (steers() && kSteering[event.key]) {
    event.preventDefault();
    link.send(kSteering[event.key]);
    return;
  }
  if (event.key !== ' ' && event.key !== 'Escape') return;
  event.preventDefault();
  if (!event.repeat) stop();
}, { capture: true });
at('stop').addEventListener('pointerdown', event => { if (event.button === 0) stop(); });
at('stop').addEventListener('click', event => { if (event.detail === 0) stop(); });  // Enter, or an assistive device

// ---- messages
const take = {
  hello(message) {
    Object.assign(state, { hello: message, tick: null, trace: [], steps: [], ended: false, asked: false });
    Object.assign(state, { question: null, held: {}, run: null, before: new Map() });
    showPlate();
    showTitle();
    at('link').className === 'good' && text('link', message.replay ? 'replay' : 'live');
    text('name', message.name);
    text('what', message.propeller + (message.simulated ? ' · SIMULATED' : '') +
      (message.replay ? ' · replay of a recorded run' : ''));
    at('lines').replaceChildren();
    at('hand').hidden = !message.by_hand && !message.weighs;
    document.body.classList.toggle('hand', message.by_hand || message.weighs);
    document.body.classList.toggle('weigh', message.weighs);
    text('hold', message.weighs ? 'done ⏎' : 'hold ⏎');
    for (const heading of document.querySelectorAll('.of_cell')) heading.textContent = message.weighs ? 'Load' : 'Thrust';
    at('curve').options[0].text = message.weighs ? 'Load [N]' : 'Thrust [N]';
    makeLimits(message.limits);
    makeCharts();
    const comes = !message.replay && !message.by_hand && !message.weighs;
    banner('', comes ? 'Before the first run.' : '', comes ? 'The motor is locked.' : '');
    showStop();
  },
  history(message) {
    for (const [time_s, thrust_n, commanded_rpm, speed_rpm] of message.trace) addPoint({ time_s, thrust_n, commanded_rpm, speed_rpm });
    for (const old of message.messages) take[old.type](old);
  },
  tick(message) {
    if (!state.tick && !state.question && !state.asked && !state.ended) banner('', '', '');
    state.tick = message;
    if (message.silent_s < kSilent_s) { followRun(message); addPoint(message); }
    state.numbersDue = true;
  },
  limits(message) { makeLimits(message.limits); },
  step(message) { state.steps.push(message); state.stepsDue = true; },
  line(message) {
    addLine(message.time_s, message.text);
    if (state.hello.weighs) banner('', message.text, '');
  },
  ask(message) {
    state.question = message.text ? message : null;
    state.numbersDue = true;
    showPlate();
    showTitle();
    if (state.ended || state.asked) return;
    banner('', message.text ? 'Asked in the terminal:' : '', message.text ? `${message.text} The motor is locked.` : '');
  },
  reached(message) { text('reached', message.text); },
  stop(message) {
    state.asked = true;
    addLine(message.time_s, 'STOP pressed on this page');
    banner('', 'STOP received.', 'Coasting the motor.');
    showTitle();
    showStop();
  },
  end(message) {
    state.ended = true;
    state.numbersDue = true;
    addLine(message.time_s, message.text);
    const { replay, by_hand, weighs } = state.hello;
    state.well = message.well;
    state.atRest = message.at_rest;
    state.question = null;
    showPlate();
    showTitle();
    if (!message.well) alarm();
    const well = replay ? 'The replay is over.' : weighs ? 'Weighed.' : by_hand ? 'The motor is at rest.' : 'Campaign finished.';
    banner(message.well || (state.asked && message.at_rest) ? 'good' : state.asked ? '' : 'bad', message.well ? well : state.asked ? 'Stopped as asked.' : 'The run is over.', message.well ? (weighs ? message.text : '') : message.text);
    showStop();
  },
};

/// What is to be mounted, as kphi draws it.
function showPlate() {
  const drawing = state.question && !state.ended ? state.question.drawing : '';
  document.body.classList.toggle('asked', drawing !== '');
  at('plate_card').hidden = drawing === '';
  text('plate_word', !drawing ? '' : state.question.occlusion_deg === 0 ? 'Nothing under the propeller' : 'Mount this under the propeller');
  const svg = drawing ? new DOMParser().parseFromString(drawing, 'image/svg+xml').documentElement : null;
  at('plate').replaceChildren(...(svg ? [svg] : []));
}

/// A run that begins ends the one before: from then on that is the ghost of the next at its φ.
function followRun(tick) {
  const { occlusion_deg, repetition, step } = tick;
  if (state.run && state.run.occlusion_deg === occlusion_deg && state.run.repetition === repetition) {
    if (state.run.points.length < kMostGhost)
      state.run.points.push([tick.time_s - state.run.began_s, ...kCurveNames.map(name => kCurves[name][2](tick) ?? null)]);
    return;
  }
  if (step < 0) return;
  if (state.run) state.before.set(state.run.occlusion_deg, state.run.points);
  state.run = { occlusion_deg, repetition, began_s: tick.time_s, points: [] };
}

function addPoint(tick) {
  const trace = state.trace, last = trace.length ? trace[trace.length - 1].t : -Infinity, t = tick.time_s;
  if (t <= last) return;
  const none = kCurveNames.map(() => null);
  if (t - last > kGap_s * 30 && trace.length) trace.push({ t: last + 1e-3, commanded: null, measured: null, values: none });
  trace.push({ t, commanded: tick.commanded_rpm, measured: tick.speed_rpm,
    values: kCurveNames.map(name => kCurves[name][2](tick) ?? null) });
  if (trace.length > kPoints) trace.splice(0, trace.length - kPoints);
  state.chartsDue = true;
}

at('curve').append(...kCurveNames.map(name => new Option(`${kCurves[name][0]} [${kCurves[name][1]}]`, name)));
at('curve').addEventListener('change', () => { state.curve = at('curve').value; state.held.thrust = false; state.chartsDue = true; });

// ---- frames: numbers with every message, curves less often
function frame(now) {
  requestAnimationFrame(frame);
  if (!state.hello) return;
  if (state.numbersDue) { state.numbersDue = false; showNumbers(); showTitle(); }
  const due = now - state.drawn >= Math.max(50, 4 * state.cost);
  if (!due || !(state.chartsDue || state.stepsDue)) return;
  const began = performance.now();
  if (state.chartsDue) drawTraces();
  if (state.stepsDue) drawSteps();
  state.chartsDue = state.stepsDue = false;
  state.drawn = now;
  state.cost = performance.now() - began;
}

// ---- the link
let link = null;
function connect() {
  link = new WebSocket(`ws://${location.host}/live${location.search}`);
  link.onopen = () => { at('link').className = 'good'; text('link', state.hello && state.hello.replay ? 'replay' : 'live'); showStop(); };
  link.onmessage = event => { const message = JSON.parse(event.data); if (take[message.type]) take[message.type](message); };
  link.onclose = () => {
    at('link').className = state.ended ? 'over' : 'bad';
    text('link', state.ended ? 'over' : 'no connection');
    showStop();
    if (state.ended) return;
    banner('bad', 'No connection to kphi.', 'STOP does not work here now. If the motor is turning, press Ctrl-C in the terminal of kphi, or cut the 12 V.');
    setTimeout(connect, 500);
  };
}
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { if (state.hello) makeCharts(); });
const sizes = new ResizeObserver(() => { for (const chart of Object.values(charts)) chart.resize(); });
for (const place of document.querySelectorAll('.chart')) sizes.observe(place);
requestAnimationFrame(frame);
connect();
