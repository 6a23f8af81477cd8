'use strict';
// The page of the live view. Messages are those of daq/live/messages.hpp.
const at = id => document.getElementById(id);
const kPoints = 1800;      // of the curves over time: a minute at 30 ticks a second
const kGap_s = 1;          // no line is drawn across a longer silence
const kSilent_s = 1;       // without a tick from the runner: it is waiting
const kMostLines = 500;
const kNear = 0.9;         // of a limit

const state = { hello: null, limits: [], tick: null, trace: [], steps: [], ended: false, asked: false, drawn: 0, cost: 0,
                numbersDue: false, chartsDue: false, stepsDue: false };

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
const common = () => ({ legend: 'never', interactionModel: {}, showLabelsOnHighlight: false, highlightCircleSize: 0,
  gridLineColor: colour('line'), axisLineColor: colour('line'), rightGap: 12, strokeWidth: 2, animatedZooms: false,
  axisLabelFontSize: 14, xAxisHeight: 24 });
const charts = {};

function makeCharts() {
  for (const chart of Object.values(charts)) chart.destroy();
  const empty = n => [[0, ...Array(n).fill(null)], [1, ...Array(n).fill(null)]];
  charts.speed = new Dygraph(at('speed_chart'), empty(2), { ...common(), labels: ['t', 'commanded', 'measured'],
    colors: [colour('commanded'), colour('measured')], series: { commanded: { stepPlot: true, strokeWidth: 3 } },
    axes: { y: { axisLabelWidth: 62, axisLabelFormatter: thousands } } });
  charts.thrust = new Dygraph(at('thrust_chart'), empty(1), { ...common(), labels: ['t', 'thrust'],
    colors: [colour('thrust')], axes: { y: { axisLabelWidth: 62 } } });
  charts.k = new Dygraph(at('k_chart'), empty(1), { ...common(), labels: ['x', 'k'], strokeWidth: 0, drawPoints: true,
    pointSize: 5, drawPointCallback: drawStep, axes: { y: { axisLabelWidth: 62 } } });
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

function drawTraces() {
  const rows = state.trace;
  if (rows.length < 2) return;
  const last = rows[rows.length - 1][0], window_ = [rows[0][0], last];
  let top = 1, bottom = 0;
  for (const [, thrust] of rows) if (thrust !== null) { top = Math.max(top, thrust); bottom = Math.min(bottom, thrust); }
  const speedTop = 1.06 * Math.max(state.hello.speed_max_rpm, 100);
  charts.speed.updateOptions({ file: rows.map(([t, , commanded, measured]) => [t, commanded, measured]),
    dateWindow: window_, valueRange: [0, speedTop] });
  charts.thrust.updateOptions({ file: rows.map(([t, thrust]) => [t, thrust]), dateWindow: window_,
    valueRange: [1.08 * bottom - 0.02 * top, 1.08 * top] });
}

function drawSteps() {
  const steps = state.steps.sort((a, b) => a.speed2_rad2_s2 - b.speed2_rad2_s2);
  if (steps.length === 0) return;
  const angles = [...new Set(steps.map(step => step.occlusion_deg))].sort((a, b) => a - b);
  const paints = angles.map((_, i) => occlusionColours()[i % 8]);
  const rows = steps.map(step => [step.speed2_rad2_s2 / 1e6,
    ...angles.map(angle => angle === step.occlusion_deg ? 1e6 * step.k_n_s2 : null)]);
  // Below a third of the highest speed noise hides the thrust: such points do not set the scale.
  const fastest = steps[steps.length - 1].speed2_rad2_s2, u = step => step.u_k_n_s2 || 0;
  const shown = steps.filter(step => step.speed2_rad2_s2 >= fastest / 9);
  const low = 1e6 * Math.min(...shown.map(step => step.k_n_s2 - u(step)));
  const high = 1e6 * Math.max(...shown.map(step => step.k_n_s2 + u(step)));
  const room = Math.max(0.08 * (high - low), 0.01 * Math.abs(high)) || 1;
  const digits = Math.max(0, Math.ceil(1 - Math.log10(high - low + 2 * room)));
  charts.k.updateOptions({ file: rows.length > 1 ? rows : [rows[0], rows[0]], labels: ['x', ...angles.map(a => a + '°')],
    colors: paints, dateWindow: [0, 1.05 * rows[rows.length - 1][0]], valueRange: [low - room, high + room],
    axes: { y: { axisLabelWidth: 62, axisLabelFormatter: value => fixed(value, digits) } } });
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
  if (!tick) return;
  showFigure('thrust', tick.thrust_n, value => fixed(value, 3), tick.thrust_age_s,
    tick.torque_nm === null ? '\u00a0' : `torque ${fixed(1e3 * tick.torque_nm, 1)} mN m`);
  const turns = tick.step >= 0;
  showFigure('speed', tick.speed_rpm, thousands, tick.speed_age_s,
    turns ? `commanded ${thousands(tick.commanded_rpm)}` : 'not commanded');
  at('speed_beside').classList.toggle('off', turns && !state.ended && tick.speed_rpm !== null &&
    Math.abs(tick.speed_rpm - tick.commanded_rpm) > 0.05 * tick.commanded_rpm + 100);
  text('occlusion', fixed(tick.occlusion_deg, 0) + '°');
  text('repetition', `${tick.repetition}/${tick.repetitions}`);
  const waits = tick.silent_s > kSilent_s && !state.ended;
  text('step', waits ? 'waiting' : turns ? `${tick.step + 1}/${tick.steps}` : tick.phase || '–');
  text('step_word', waits ? 'see the terminal' : turns ? 'step' : '');
  text('left', clock(tick.remaining_s || 0));
  at('progress_bar').style.transform = `scaleX(${Math.min(1, Math.max(0, tick.progress))})`;
  at('progress').setAttribute('aria-valuenow', Math.round(100 * tick.progress));
  if (state.hello.weighs && tick.phase === 'measuring' && !state.ended) banner('', 'Measuring.', 'Hands off.');
  showReadings(tick);
  showLimits(tick);
}

/// Stale values are shown as '?' with their age.
function showFigure(id, value, words, age_s, beside) {
  const silent_s = Math.max(age_s, state.tick.silent_s), stale = value === null || state.tick.silent_s > kSilent_s;
  text(id, state.ended ? '–' : stale ? '?' : words(value));
  text(id + '_beside', state.ended ? `run over, last value ${words(value)}` : stale ? `no reading for ${fixed(silent_s, 1)} s` : beside);
  at(id).closest('.figure').classList.toggle('stale', stale && !state.ended);
  at(id).closest('.figure').classList.toggle('over', state.ended);
}

function showReadings(tick) {
  const electric = (volts, amps) => volts === null || amps === null ? 'none'
    : `${fixed(volts, 2)} V · ${fixed(amps, 2)} A · ${fixed(volts * amps, 0)} W`;
  text('supply', electric(tick.supply_v, tick.supply_a));
  text('module', electric(tick.module_v, tick.module_a).replace('none', '?'));
  text('coil', fixed(tick.coil_degc, 0) + ' °C');
  const faulty = tick.fault_bits !== 0 || (tick.derate !== null && tick.derate < 0.9999);
  text('drive', tick.fault_bits !== 0 ? `fault 0x${tick.fault_bits.toString(16)}`
    : tick.derate === null ? '?' : faulty ? `derates to ${fixed(100 * tick.derate, 0)} %` : 'no fault');
  at('drive').classList.toggle('bad', faulty);
  const rms = Math.hypot(...(tick.vibration || [null]).slice(0, 3).map(each => each ?? NaN));
  text('vibration', Number.isNaN(rms) ? '–' : `${fixed(rms, 2)} N` + (tick.blade_pass_n === null ? ''
    : ` · ${fixed(tick.blade_pass_n, 2)} N at ${fixed(tick.blade_pass_hz, 0)} Hz`));
  text('received', thousands(tick.received));
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
    document.title = `${message.name} – kphi`;
    text('name', message.name);
    text('what', message.propeller + (message.replay ? ' · replay of a recorded run' : ''));
    at('lines').replaceChildren();
    at('hand').hidden = !message.by_hand && !message.weighs;
    document.body.classList.toggle('hand', message.by_hand || message.weighs);
    document.body.classList.toggle('weigh', message.weighs);
    text('hold', message.weighs ? 'done ⏎' : 'hold ⏎');
    for (const heading of document.querySelectorAll('.of_cell')) heading.textContent = message.weighs ? 'Load' : 'Thrust';
    makeLimits(message.limits);
    makeCharts();
    banner('', '', '');
    showStop();
  },
  history(message) {
    for (const point of message.trace) addPoint(...point);
    for (const old of message.messages) take[old.type](old);
  },
  tick(message) {
    state.tick = message;
    if (message.silent_s < kSilent_s) addPoint(message.time_s, message.thrust_n, message.commanded_rpm, message.speed_rpm);
    state.numbersDue = true;
  },
  limits(message) { makeLimits(message.limits); },
  step(message) { state.steps.push(message); state.stepsDue = true; },
  line(message) {
    addLine(message.time_s, message.text);
    if (state.hello.weighs) banner('', message.text, '');
  },
  stop(message) {
    state.asked = true;
    addLine(message.time_s, 'STOP pressed on this page');
    banner('', 'STOP received.', 'Coasting the motor.');
    showStop();
  },
  end(message) {
    state.ended = true;
    state.numbersDue = true;
    addLine(message.time_s, message.text);
    const { replay, by_hand, weighs } = state.hello;
    const well = replay ? 'The replay is over.' : weighs ? 'Weighed.' : by_hand ? 'The motor is at rest.' : 'Campaign finished.';
    banner(message.well || state.asked ? 'good' : 'bad', message.well ? well : state.asked ? 'Stopped as asked.' : 'The run is over.', message.well ? (weighs ? message.text : '') : message.text);
    showStop();
  },
};

function addPoint(time_s, thrust_n, commanded_rpm, speed_rpm) {
  const trace = state.trace, last = trace.length ? trace[trace.length - 1][0] : -Infinity;
  if (time_s <= last) return;
  if (time_s - last > kGap_s * 30 && trace.length) trace.push([last + 1e-3, null, null, null]);
  trace.push([time_s, thrust_n, commanded_rpm, speed_rpm]);
  if (trace.length > kPoints) trace.splice(0, trace.length - kPoints);
  state.chartsDue = true;
}

// ---- frames: numbers with every message, curves less often
function frame(now) {
  requestAnimationFrame(frame);
  if (!state.hello) return;
  if (state.numbersDue) { state.numbersDue = false; showNumbers(); }
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
  link.onopen = () => { at('link').className = 'good'; text('link', 'live'); showStop(); };
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
