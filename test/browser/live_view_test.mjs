// The live view as a person sees it: a real browser, the real program, the simulated bench in real time.
//   node live_view_test.mjs KPHI NODE_MODULES_PARENT PICTURE_FOLDER
// Exit code 77: skipped, for want of a browser or of what drives it; 3: a stop was not prompt.
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync, writeFileSync } from 'node:fs';
import http from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';
import { Bench, Child } from './bench.mjs';

const [kphi, modules, pictures] = process.argv.slice(2);
const kSkipped = 77, kNotSafe = 3, kInterrupted = 130, kRate_hz = 20, kPrompt_ms = 200;

function skip(why) {
  console.log(`SKIPPED: ${why}`);
  process.exit(kSkipped);
}

const browserAt = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find(file => file && existsSync(file));
if (!browserAt) skip('no chromium; apt-get install chromium');
let playwright;
try {
  playwright = createRequire(path.resolve(modules, 'here.js'))('playwright-core');
} catch {
  skip('no playwright-core; ./run peers installs it');
}

const began = performance.now();
const results = [];
async function it(says, what) {
  const began = performance.now();
  await what();
  results.push(says);
  console.log(`ok   ${says} (${Math.round(performance.now() - began)} ms)`);
}

/// In the page, before anything of it: when keys and clicks came, and when the numbers changed.
function watchThePage() {
  window.seen = { asked: [], ticks: [], changes: [], last: null };
  const Real = window.WebSocket;
  window.WebSocket = class extends Real {
    constructor(...args) {
      super(...args);
      this.addEventListener('message', event => {
        const message = JSON.parse(event.data);
        if (message.type !== 'tick') return;
        window.seen.ticks.push(performance.now());
        window.seen.last = message;
      });
    }
  };
  for (const kind of ['keydown', 'pointerdown'])
    addEventListener(kind, event => window.seen.asked.push(performance.timeOrigin + event.timeStamp), { capture: true });
  addEventListener('DOMContentLoaded', () => new MutationObserver(() => window.seen.changes.push(performance.now()))
    .observe(document.getElementById('thrust'), { childList: true, characterData: true, subtree: true }));
}

const answerTo = (url, headers) => new Promise((done, fail) => {
  const asked = http.get(url, { headers }, answer => { answer.resume(); done(answer.statusCode); });
  asked.on('upgrade', (answer, socket) => { socket.destroy(); done(answer.statusCode); }).on('error', fail);
});
const upgrade = { Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'dGhlIHNhbXBsZSBub25jZQ==' };

/// Where the page is, with the token.
const addressOf = async child => (await child.waitFor(/^live: (http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]{32})$/m))[1];

const asked = [], complaints = [];
async function open(browser, url, more = {}) {
  const page = await browser.newPage({ viewport: { width: 1440, height: 900 }, ...more });
  page.setDefaultTimeout(60_000);
  page.on('request', request => asked.push([url, request.url()]));
  page.on('websocket', socket => asked.push([url, socket.url()]));
  page.on('console', message => { if (message.type() !== 'log') complaints.push(message.text()); });
  page.on('pageerror', error => complaints.push(error.message));
  await page.addInitScript(watchThePage);
  await page.goto(url);
  return page;
}

const kReadings = ['thrust', 'speed', 'run', 'occlusion', 'repetition', 'step', 'left', 'supply', 'module', 'coil', 'drive', 'vibration', 'received', 'lost'];
const kWidest = { run: '10/20', repetition: '10/20', supply: '12.00 V · 17.53 A · 210 W', module: '12.00 V · 17.53 A · 210 W', drive: 'derates to 95 %', vibration: '0.26 N · 0.12 N at 916 Hz', received: '9 187 500', lost: '12 345, 0' };
const readings = page => page.evaluate(ids => Object.fromEntries(ids.map(id => [id, at(id).textContent])), kReadings);

/// Numbers of each axis that is shown are such as a person writes, and no two of them alike.
async function expectReadableAxes(page) {
  const axes = await page.evaluate(() => [...document.querySelectorAll('.chart')].filter(chart => chart.offsetParent).flatMap(chart =>
    ['x', 'y'].map(axis => [`${chart.id} ${axis}`, [...chart.querySelectorAll(`.dygraph-axis-label-${axis}`)].map(node => node.textContent)])));
  assert.ok(axes.length >= 2);
  for (const [name, labels] of axes) {
    for (const label of labels) assert.match(label, /^−?\d[\d ]*(\.\d{1,4})?$/, `${name}: ${labels}`);
    assert.equal(new Set(labels).size, labels.length, `${name}: ${labels}`);
  }
}

/// Until the motor of `run` turns on the page that shows it, in this repetition or a later one.
async function turns(page, run, repetition) {
  const ended = run.ended.then(() => { throw new Error(`ended before it turned:\n${run.words}`); });
  await Promise.race([ended, page.waitForFunction(of => window.seen.last && window.seen.last.repetition >= of
    && window.seen.last.step >= 0 && window.seen.last.speed_rpm > 5000, repetition)]);
  ended.catch(() => {});  // it may end from now on
}

/// Asks for the stop on the page as a person would, sees the run to its end, and ends the bench: the motor has coasted
/// within kPrompt_ms.
async function stopBy(how, ask, page, bench, run) {
  const offset = await bench.clockOffset();
  const lost = await page.evaluate(() => window.seen.last.lost_network + window.seen.last.lost_host);
  assert.equal(lost, 0, 'samples of the stopped run were lost');
  await ask();
  await page.waitForFunction(() => state.asked);
  const asked = await page.evaluate(() => window.seen.asked.at(-1)) + offset;
  assert.equal(await Promise.race([run.ended, new Promise(done => setTimeout(done, 20_000, 'no end').unref())]), kInterrupted, run.words);
  await page.waitForFunction(() => state.ended);
  assert.match(await page.locator('#banner').innerText(), /stopped by request/);
  assert.equal(await page.locator('#banner').getAttribute('class'), '', 'nobody saw it at rest');
  assert.equal(await page.locator('.limit.over').count(), 0, 'a rotor that coasts has no wanted speed');
  assert.equal(await page.locator('#stop_word').innerText(), 'ENDED');
  await page.waitForFunction(() => document.getElementById('speed').textContent === '–');
  assert.match(await page.locator('#speed_beside').innerText(), /^last value [\d ]+, not seen at rest$/, 'its power was cut while it turned');
  assert.match(await page.title(), /^STOPPED – browser/);
  await page.waitForFunction(() => document.getElementById('link').textContent === 'over');
  assert.ok(await page.evaluate(() => state.trace.length > 5), 'it keeps what it has');
  const reason = await page.evaluate(() => [at('banner').scrollHeight, at('banner').clientHeight]);
  assert.ok(reason[0] <= reason[1] + 1, `the reason is cut: ${reason}`);
  await page.screenshot({ path: path.join(pictures, `live_view_stopped_by_${how}.png`) });
  const stages = await bench.stages();
  assert.equal(stages.filter(([at]) => at <= asked).at(-1)?.[1], 'drive', `it turned at the ${how}`);
  const [coasts] = stages.find(([at, stage]) => at > asked && stage === 'coast');
  console.log(`     coasts ${(coasts - asked).toFixed(1)} ms after the ${how}; ${lost} samples lost`);
  if (!(coasts - asked <= kPrompt_ms)) process.on('exit', () => { process.exitCode = kNotSafe; });
  assert.ok(coasts - asked <= kPrompt_ms, `${coasts - asked} ms`);
  assert.equal(stages.at(-1)[1], 'coast');
}

const bench = await Bench.start(kphi);
let other, unpowered, browser;
try {
  // In a session of its own, it would keep the kernel from handing on what a pseudo-terminal hears: see run, too.
  const polite = bench.path('browser');
  writeFileSync(polite, `#!/bin/sh\necho 19 >/proc/self/autogroup\nexec ${browserAt} "$@"\n`, { mode: 0o755 });
  // Without its own checks of pages that reach into this machine: ours are asked.
  const launched = playwright.chromium.launch({ executablePath: polite, args: ['--no-sandbox', '--disable-gpu', '--disable-features=LocalNetworkAccessChecks'] });
  const run = bench.run('--live');
  browser = await launched;
  const url = await addressOf(run), { origin } = new URL(url);
  const page = await open(browser, url);

  await it(`updates at ${kRate_hz} Hz or more`, async () => {
    await turns(page, run, 1);
    // A host that is busy with other things may stutter; what counts is one second in which it was not.
    const rates = await page.waitForFunction(rate => {
      const within = times => times.filter(time => time > performance.now() - 1000).length;
      const rates = [within(window.seen.ticks), within(window.seen.changes)];
      return Math.min(...rates) >= rate ? rates : false;
    }, kRate_hz, { timeout: 8000, polling: 50 });
    const [messages, numbers] = await rates.jsonValue();
    console.log(`     ${messages} messages, ${numbers} changes of the number of thrust per second`);
  });

  await it('refuses a foreign origin, a foreign host, a wrong token', async () => {
    const live = url.replace('/?', '/live?');
    const here = new URL(url).host, evil = 'http://evil.example';
    const knocks = [
      ['a foreign origin', live, { Host: here, Origin: evil }, 403],
      ['a foreign host', live, { Host: 'evil.example', Origin: evil }, 403],
      ['a wrong token', live.replace(/.$/, c => c === '0' ? '1' : '0'), { Host: here, Origin: origin }, 403],
      ['the page itself', live, { Host: here, Origin: origin }, 101],
    ];
    const told = [];
    for (const [who, address, headers, answer] of knocks) {
      assert.equal(await answerTo(address, { ...upgrade, ...headers }), answer, who);
      told.push(`${who} ${answer}`);
    }
    const stranger = await browser.newPage();
    await stranger.route(`${evil}/`, route => route.fulfill({ contentType: 'text/html', body: '<p>evil' }));
    await stranger.goto(`${evil}/`);
    const came_in = await stranger.evaluate(address => new Promise(done => {
      const socket = new WebSocket(address);
      socket.onopen = () => { socket.send('stop'); done(true); };
      socket.onclose = () => done(false);
    }), live.replace('http', 'ws'));
    assert.equal(came_in, false);
    await stranger.close();
    console.log(`     ${told.join(', ')}; a page of evil.example in the browser: refused`);
  });

  // Meanwhile the first run goes on.
  await it('shows a recorded run again, in which nothing can be stopped', async () => {
    const file = new URL('../../results/reference/runs/5x3_phi090_rep1.h5', import.meta.url).pathname;
    const replay = new Child([kphi, 'replay', file, '--live']);
    try {
      const seen = await open(browser, await addressOf(replay), { colorScheme: 'dark' });
      const during = await seen.waitForFunction(() => state.steps.length >= 1 && !state.ended
        && { word: at('stop_word').textContent, disabled: at('stop').disabled });
      assert.deepEqual(await during.jsonValue(), { word: 'REPLAY', disabled: true });
      assert.equal(await seen.locator('#link').innerText(), 'replay');
      assert.match(await seen.title(), /^replay – /);
      assert.match(await seen.locator('.limit', { hasText: 'Thrust' }).innerText(), /≤ 20\.0 N/);
      await seen.keyboard.press('Escape');
      await seen.screenshot({ path: path.join(pictures, 'live_view_replay.png') });
      await seen.waitForFunction(() => state.ended);
      assert.equal(await replay.ended, 0, replay.words);
      assert.equal(await seen.locator('#stop_word').innerText(), 'REPLAY OVER');
      assert.ok(await seen.locator('#run_place').isHidden(), 'a run by itself has no number');
      assert.equal(await seen.locator('#left').innerText(), '–');
      assert.match(await seen.title(), /^finished – /);
      await expectReadableAxes(seen);
      await seen.close();
    } finally {
      if (replay.code === undefined) replay.signal('SIGKILL');
    }
  });

  await it('shows every reading in a run, and axes with numbers that can be read', async () => {
    // As they are in one frame: a run may end before the next one.
    const shown = await (await page.waitForFunction(ids => state.steps.length >= 2 && state.trace.length > 50 && /^[123]\/3$/.test(at('step').textContent)
      && Object.fromEntries(ids.map(id => [id, at(id).textContent])), kReadings)).jsonValue();
    const patterns = { thrust: /^−?\d+\.\d{3}$/, speed: /^\d[\d ]*$/, run: /^\d+\/20$/, occlusion: /^90°$/, repetition: /^\d+\/20$/, step: /^[123]\/3$/,
      left: /^\d\d:\d\d$/, supply: /^1\d\.\d\d V · \d+\.\d\d A · \d+ W$/, module: /^1\d\.\d\d V · \d+\.\d\d A · \d+ W$/, coil: /^\d+ °C$/, drive: /^no fault$/,
      vibration: /^\d+\.\d\d N( · .*)?$/, received: /^\d[\d ]*$/, lost: /^0, 0$/ };
    for (const id of kReadings) assert.match(shown[id], patterns[id], id);
    await expectReadableAxes(page);
  });

  await it('shows k of every step, lines, and what the guard holds the bench to', async () => {
    await run.waitFor(/run\s+1\/20/);
    await page.waitForFunction(() => state.steps.length >= 3 && state.trace.length > 50);
    assert.match(await page.locator('#lines').innerText(), /run\s+1\/20/);
    const k = await page.evaluate(() => state.steps.map(step => step.k_n_s2));
    for (const value of k) assert.ok(value > 0.5e-6 && value < 3e-6, `k = ${value} N s²`);
    const limits = await page.evaluate(() => Object.fromEntries(state.limits.map(limit => [limit.key, limit.source])));
    assert.match(limits.thrust_n, /^campaign /);
    assert.match(limits.voltage_high_v, /^bench /);
    assert.match(limits.motor_a, /^device motor /);
    assert.match(limits.fz_n, /^device load cell/);
    assert.equal(await page.locator('.limit').count(), Object.keys(limits).length);
    assert.match(await page.locator('.limit', { hasText: 'Coil' }).getAttribute('title'), /Set by: campaign limits\.coil/);
    // At their widest: as many digits as the limit has, beyond it, in bold.
    const cut = await page.evaluate(() => {
      const beyond = state.limits.map(limit => [limit.key, limit.lower ? limit.limit * 0.99 : limit.limit * 1.01]);
      showLimits({ watched: Object.fromEntries(beyond) });
      return [...document.querySelectorAll('.limit b, .limit span')].filter(node => node.scrollWidth > node.clientWidth).map(node => `${node.textContent} (${node.scrollWidth} of ${node.clientWidth} px)`);
    });
    assert.deepEqual(cut, [], 'words that do not fit');
  });

  await it('says what is asked in the terminal, and that the motor is locked', async () => {
    const drawing = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path class="plate" d="M0,0 L9,9"/></svg>';
    await page.evaluate(drawing => take.ask({ text: 'Mount 45°, then type 45.', occlusion_deg: 45, repetition: 2, run: 7, has_power: false, drawing }), drawing);
    assert.equal(await page.locator('#banner').innerText(), 'Asked in the terminal: Mount 45°, then type 45. The motor is locked.');
    assert.match(await page.title(), /^waiting – /);
    await page.waitForFunction(() => at('speed_beside').textContent === 'at rest');
    const shown = await page.evaluate(() => ['thrust', 'speed', 'supply', 'module', 'occlusion', 'repetition', 'run', 'step'].map(id => at(id).textContent));
    assert.deepEqual(shown, ['–', '0', 'off', 'no power', '45°', '2/20', '7/20', 'waiting']);
    assert.ok(await page.locator('#plate .plate').isVisible(), 'the plate is drawn');
    assert.equal(await page.locator('#speed_card').isHidden(), true);
    for (const colorScheme of ['dark', 'light']) await page.emulateMedia({ colorScheme });  // charts are made again
    await page.evaluate(() => take.ask({ text: '', occlusion_deg: 0, repetition: 0, run: 0, has_power: true, drawing: '' }));
    for (const id of ['#banner', '#plate_card']) assert.equal(await page.locator(id).isHidden(), true);
    await page.waitForFunction(() => Object.values(charts).every(chart => chart.size().width === at('k_chart').clientWidth));
    await turns(page, run, 1);
    await page.waitForFunction(() => document.title.startsWith('turning – '));
    assert.match(await page.locator('#run').innerText(), /^\d+\/20$/);
    assert.match(await page.locator('#clock').innerText(), /^\d\d:\d\d:\d\d$/);
  });

  await it('says what is known so far', async () => {
    await page.evaluate(() => take.reached({ text: 'so far K_T ± 0.05 %' }));
    assert.equal(await page.locator('#k_card #reached').innerText(), 'so far K_T ± 0.05 %');
  });

  await it('lets a person zoom, read a value, choose a curve, and compare with the repetition before', async () => {
    await turns(page, run, 3);
    await page.waitForFunction(() => !at('ghost_key').hidden);
    const { x, y, width, height } = await page.locator('#thrust_chart').boundingBox();
    await page.mouse.move(x + 0.5 * width, y + 0.5 * height);
    await page.mouse.move(x + 0.6 * width, y + 0.5 * height);
    await page.waitForFunction(() => / s: .* N/.test(at('thrust_read').textContent));
    assert.doesNotMatch(await page.locator('#thrust_read').innerText(), /NaN/);
    const words = await page.evaluate(widest => { Object.entries(widest).forEach(each => text(...each)); return [...document.querySelectorAll('#where p, h2, #readings dd')].filter(node => node.offsetParent && node.scrollWidth > node.clientWidth + 1).map(node => node.textContent).concat([...document.querySelectorAll('#readings dt')].filter((node, _, all) => node.offsetTop !== all[0].offsetTop).map(node => `${node.textContent} in a second row`)); }, kWidest);
    assert.deepEqual(words, [], 'words that do not fit');
    await page.mouse.down();
    await page.mouse.move(x + 0.9 * width, y + 0.5 * height, { steps: 5 });
    await page.mouse.up();
    const zoomed = await page.evaluate(() => [state.held.thrust, charts.thrust.xAxisRange(), window.seen.ticks.length]);
    assert.equal(zoomed[0], true);
    await page.waitForFunction(ticks => window.seen.ticks.length > ticks + 20, zoomed[2]);
    assert.deepEqual(await page.evaluate(() => charts.thrust.xAxisRange()), zoomed[1], 'what is zoomed stays');
    await page.mouse.dblclick(x + 0.5 * width, y + 0.5 * height);
    await page.waitForFunction(range => charts.thrust.xAxisRange()[1] > range[1], zoomed[1]);
    for (const curve of ['torque', 'power', 'current', 'voltage', 'coil']) {
      await page.selectOption('#curve', curve);
      await page.waitForFunction(() => charts.thrust.yAxisRange()[1] > charts.thrust.yAxisRange()[0]
        && state.trace.at(-1).values[kCurveNames.indexOf(state.curve)] !== null);
    }
    await page.selectOption('#curve', 'thrust');
  });

  await it('fits a telephone', async () => {
    const phone = await open(browser, url, { viewport: { width: 390, height: 844 } });
    await phone.waitForFunction(() => state.trace.length > 20);
    const cut = await phone.evaluate(widest => [Object.entries(widest).forEach(each => text(...each)), document.documentElement.scrollWidth,
      ...[...document.querySelectorAll('#where b, #where span, .number, header *, #readings dd')].filter(node => node.offsetParent && node.scrollWidth > node.clientWidth + 1 && getComputedStyle(node).display !== 'inline').map(node => node.textContent)].slice(1), kWidest);
    assert.deepEqual(cut, [390]);
    await phone.screenshot({ path: path.join(pictures, 'live_view_phone.png'), fullPage: true });
    await phone.close();
  });

  await it('says before the first run that there is none yet, and at its question what is to be mounted', async () => {
    // The page as it is until the first tick, and as the question before the first run makes it.
    const fresh = await open(browser, url, { viewport: { width: 390, height: 844 } });
    await fresh.waitForFunction(() => state.hello && state.tick);
    await fresh.evaluate(() => { link.onmessage = null; take.hello(state.hello); });
    assert.equal(await fresh.title(), 'browser – kphi');
    assert.equal(await fresh.locator('#banner').innerText(), 'Before the first run. The motor is locked.');
    await expectReadableAxes(fresh);
    await fresh.evaluate(() => take.ask({ text: 'Mount 90°, then type 90.', occlusion_deg: 90, repetition: 1, run: 1, has_power: false, drawing: '<svg xmlns="http://www.w3.org/2000/svg"/>' }));
    await fresh.waitForFunction(() => at('module').textContent === 'no power');
    const { speed, run, occlusion, repetition, step, supply } = await readings(fresh);
    assert.deepEqual([speed, run, occlusion, repetition, step, supply], ['0', '1', '90°', '1', 'waiting', 'off']);
    assert.equal(await fresh.title(), 'waiting – browser – kphi');
    const [plate, thrust] = await fresh.evaluate(() => ['plate_card', 'thrust'].map(id => at(id).getBoundingClientRect().top));
    assert.ok(plate < thrust, 'on a telephone the plate comes first');
    await expectReadableAxes(fresh);
    await fresh.close();
  });

  await it(`coasts the motor within ${kPrompt_ms} ms of a key`, async () => {
    await turns(page, run, 2);
    await page.screenshot({ path: path.join(pictures, 'live_view.png') });  // which may outlast the repetition
    await turns(page, run, 1 + await page.evaluate(() => window.seen.last.repetition));
    await stopBy('key', () => page.keyboard.press('Escape'), page, bench, run);
    await page.close();
  });

  await it(`coasts the motor within ${kPrompt_ms} ms of a click of the mouse`, async () => {
    other = await Bench.start(kphi);  // what a cut supply leaves of the first one's module is latched in it
    const again = other.run('--live');
    const page = await open(browser, await addressOf(again));
    await turns(page, again, 1);
    const { x, y, width, height } = await page.locator('#stop').boundingBox();
    await stopBy('click', () => page.mouse.click(x + width / 2, y + height / 2), page, other, again);
    await page.close();
  });

  await it('shows the coast to rest after STOP where the motor keeps its power', async () => {
    unpowered = await Bench.start(kphi, { supply: false });
    const coasting = unpowered.run('--live');
    const page = await open(browser, await addressOf(coasting));
    await turns(page, coasting, 1);
    await page.evaluate(() => { window.coast = []; });
    await page.keyboard.press('Escape');
    await page.evaluate(() => { const tick = take.tick; take.tick = message => { window.coast.push(message.speed_rpm); tick(message); }; });
    assert.equal(await coasting.ended, kInterrupted, coasting.words);
    await page.waitForFunction(() => state.ended);
    // The newest picture may be one of the rotor just before.
    await page.waitForFunction(() => at('speed').textContent === '–');
    assert.match(await page.locator('#speed_beside').innerText(), /^last value (\d\d?, at rest|\d{2,3}, then at rest)$/, coasting.words);
    assert.equal(await page.locator('#banner').getAttribute('class'), 'good');
    assert.equal(await page.locator('.limit.over').count(), 0, 'nothing is beyond a limit');
    const speeds = (await page.evaluate(() => window.coast)).filter(speed => speed !== null);
    assert.ok(speeds.filter(speed => speed > 100 && speed < 5000).length >= 2, `it falls before the eyes: ${speeds}`);
    assert.match(await page.title(), /^STOPPED – browser/);
    await expectReadableAxes(page);
    await page.close();
  });

  await it('says that a campaign has finished, and of each reading that it is the last one', async () => {
    const short = unpowered.runs('short.yaml', '--live');
    const page = await open(browser, await addressOf(short));
    assert.equal(await short.ended, 0, short.words);
    await page.waitForFunction(() => state.ended && document.getElementById('speed').textContent === '–');
    assert.match(await page.title(), /^finished – browser/);
    assert.equal(await page.locator('#banner').innerText(), 'Campaign finished.');
    assert.equal(await page.locator('#banner').getAttribute('class'), 'good');
    assert.match(await page.locator('#speed_beside').innerText(), /^last value \d\d?, at rest$/);
    assert.match(await page.locator('#thrust_beside').innerText(), /^last value −?0\.0\d\d$/);
    const { run, occlusion, repetition, step, left, supply, module, coil, drive, received, lost } = await readings(page);
    assert.deepEqual([run, occlusion, repetition, step, left, supply, drive, lost], ['1/1', '90°', '1/1', '–', '–', 'none', 'no fault', '0, 0']);
    assert.match(`${module} ${coil} ${received}`, /^1\d\.\d\d V · 0\.\d\d A · \d W \d\d °C \d\d \d{3}$/);
    assert.equal(await page.locator('#progress').getAttribute('aria-valuenow'), '100');
    assert.match(await page.evaluate(() => getComputedStyle(document.querySelector('#readings dt'), '::after').content), /last/);
    await expectReadableAxes(page);
    await page.screenshot({ path: path.join(pictures, 'live_view_finished.png') });
    await page.close();
  });

  await it('cost the acquisition at 7 kHz no sample', () => {
    const results = bench.path('results'), journal = path.join(results, readdirSync(results).sort()[0], 'journal.jsonl');
    const accepted = readFileSync(journal, 'utf8').split('\n').filter(line => line.includes('"run_accepted"')).map(line => JSON.parse(line));
    assert.ok(accepted.length >= 1);
    for (const line of accepted) {
      const entry = line.data ?? line;
      assert.ok(entry.samples > 25_000, `${entry.samples} samples`);
      assert.equal(entry.lost, 0);
    }
    console.log(`     0 samples lost in ${accepted.length} runs`);
  });

  await it('asks no other place for anything, and complains of nothing', () => {
    for (const [page, address] of asked) {
      const own = new URL(page).origin;
      assert.ok([own, own.replace('http', 'ws'), 'data:'].some(start => address.startsWith(start)), address);
    }
    assert.ok(asked.length >= 6);
    assert.deepEqual(complaints.filter(text => !text.includes('ERR_CONNECTION_REFUSED')), []);
  });
  console.log(`${results.length} of 16 shown in ${((performance.now() - began) / 1000).toFixed(1)} s`);
} finally {
  await browser?.close();
  for (const each of [bench, other, unpowered]) each?.clear();
}
