// The live view as a person sees it: a real browser, the real program, the simulated bench in real time.
//   node live_view_test.mjs KPHI NODE_MODULES_PARENT PICTURE_FOLDER
// Exit code 77: skipped, for want of a browser or of what drives it.
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import http from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';
import { Bench, Child } from './bench.mjs';

const [kphi, modules, pictures] = process.argv.slice(2);
const kSkipped = 77, kInterrupted = 130;
const kRate_hz = 20, kPrompt_ms = 200;

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

const results = [];
async function it(says, what) {
  const began = performance.now();
  await what();
  results.push(says);
  console.log(`ok   ${says} (${Math.round(performance.now() - began)} ms)`);
}

/// In the page, before anything of it: when keys came, and when the numbers changed.
function watchThePage() {
  window.seen = { keys: [], ticks: [], changes: [], last: null };
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
  addEventListener('keydown', event => window.seen.keys.push(performance.timeOrigin + event.timeStamp), { capture: true });
  addEventListener('DOMContentLoaded', () => new MutationObserver(() => window.seen.changes.push(performance.now()))
    .observe(document.getElementById('thrust'), { childList: true, characterData: true, subtree: true }));
}

const answerTo = (url, headers) => new Promise((done, fail) => {
  const asked = http.get(url, { headers }, answer => { answer.resume(); done(answer.statusCode); });
  asked.on('upgrade', (answer, socket) => { socket.destroy(); done(answer.statusCode); }).on('error', fail);
});
const upgrade = { Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'dGhlIHNhbXBsZSBub25jZQ==' };

const bench = await Bench.start(kphi);
let browser;
try {
  const run = bench.run('--live');
  const url = (await run.waitFor(/^live: (http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]{32})$/m))[1];
  const origin = new URL(url).origin;
  // Without its own checks of pages that reach into this machine: ours are asked.
  browser = await playwright.chromium.launch({ executablePath: browserAt, args: ['--no-sandbox', '--disable-gpu', '--disable-features=LocalNetworkAccessChecks'] });
  const page = await browser.newPage({ viewport: { width: 1440, height: 900 } });
  const asked = [], complaints = [];
  page.on('request', request => asked.push(request.url()));
  page.on('websocket', socket => asked.push(socket.url()));
  page.on('console', message => { if (message.type() !== 'log') complaints.push(message.text()); });
  page.on('pageerror', error => complaints.push(error.message));
  await page.addInitScript(watchThePage);
  await page.goto(url);

  await it(`updates at ${kRate_hz} Hz or more`, async () => {
    await page.waitForFunction(() => window.seen.last && window.seen.last.step >= 0);
    // A host that is busy with other things may stutter; what counts is one second in which it was not.
    const rates = await page.waitForFunction(rate => {
      const within = times => times.filter(time => time > performance.now() - 1000).length;
      const rates = [within(window.seen.ticks), within(window.seen.changes)];
      return Math.min(...rates) >= rate ? rates : false;
    }, kRate_hz, { timeout: 8000, polling: 50 });
    console.log('     messages, numbers per second:', (await rates.jsonValue()).join(', '));
  });

  await it('refuses a foreign origin, a foreign host, a wrong token', async () => {
    const live = url.replace('/?', '/live?');
    const here = new URL(url).host;
    assert.equal(await answerTo(live, { ...upgrade, Origin: 'http://evil.example' }), 403);
    assert.equal(await answerTo(live, { ...upgrade, Host: 'evil.example', Origin: 'http://evil.example' }), 403);
    assert.equal(await answerTo(live.replace(/.$/, c => c === '0' ? '1' : '0'), { ...upgrade, Origin: origin }), 403);
    assert.equal(await answerTo(live, { ...upgrade, Host: here, Origin: origin }), 101, 'the page itself is let in');
    const stranger = await browser.newPage();
    await stranger.route('http://evil.example/', route => route.fulfill({ contentType: 'text/html', body: '<p>evil' }));
    await stranger.goto('http://evil.example/');
    const came_in = await stranger.evaluate(address => new Promise(done => {
      const socket = new WebSocket(address);
      socket.onopen = () => { socket.send('stop'); done(true); };
      socket.onclose = () => done(false);
    }), live.replace('http', 'ws'));
    assert.equal(came_in, false);
    await stranger.close();
  });

  await it('shows k of every step, limits and lines', async () => {
    await run.waitFor(/run\s+1\/2/);
    await page.waitForFunction(() => state.steps.length >= 4 && state.trace.length > 50);
    assert.equal(await page.locator('.limit').count(), 4);
    assert.match(await page.locator('#lines').innerText(), /run\s+1\/2/);
    const k = await page.evaluate(() => state.steps.map(step => step.k_n_s2));
    for (const value of k) assert.ok(value > 0.5e-6 && value < 3e-6, `k = ${value} N s²`);
  });

  await it(`coasts the motor within ${kPrompt_ms} ms of the key, and says so`, async () => {
    await page.waitForFunction(() => window.seen.last.repetition === 2 && window.seen.last.step >= 2);
    await page.screenshot({ path: path.join(pictures, 'live_view.png') });
    const offset = await bench.clockOffset();
    const lost = await page.evaluate(() => window.seen.last.lost_network + window.seen.last.lost_host);
    await page.keyboard.press('Escape');
    await page.waitForFunction(() => state.asked);
    const pressed = await page.evaluate(() => window.seen.keys[0]) + offset;
    assert.equal(await Promise.race([run.ended, new Promise(done => setTimeout(done, 20_000, 'no end'))]), kInterrupted, run.words);
    await page.waitForFunction(() => state.ended);
    assert.match(await page.locator('#banner').innerText(), /stopped by request/);
    assert.equal(await page.locator('#stop_word').innerText(), 'ENDED');
    await page.waitForFunction(() => document.getElementById('speed').textContent === '–');
    await page.screenshot({ path: path.join(pictures, 'live_view_stopped.png') });
    const stages = await bench.stages();
    const drives = stages.filter(([at]) => at <= pressed).at(-1), end = stages.at(-1);
    assert.equal(drives?.[1], 'drive', 'it turned when the key was pressed');
    assert.equal(end[1], 'coast');
    console.log(`     coasts ${(end[0] - pressed).toFixed(1)} ms after the key`);
    assert.ok(end[0] - pressed <= kPrompt_ms, `${end[0] - pressed} ms`);
    assert.equal(lost, 0, 'samples of the stopped run were lost');
  });

  await it('cost the acquisition at 7 kHz no sample', () => {
    const results = bench.path('results'), journal = path.join(results, readdirSync(results)[0], 'journal.jsonl');
    const accepted = readFileSync(journal, 'utf8').split('\n').filter(line => line.includes('"run_accepted"')).map(line => JSON.parse(line));
    assert.equal(accepted.length, 1);
    const entry = accepted[0].data ?? accepted[0];
    assert.ok(entry.samples > 25_000, `${entry.samples} samples`);
    assert.equal(entry.lost, 0);
  });

  await it('asks no other place for anything, and complains of nothing', () => {
    for (const address of asked) assert.ok(address.startsWith(origin) || address.startsWith(origin.replace('http', 'ws')) || address.startsWith('data:'), address);
    assert.ok(asked.length >= 2);
    assert.deepEqual(complaints.filter(text => !text.includes('ERR_CONNECTION_REFUSED')), []);
  });
  await it('shows a recorded run again, in which nothing can be stopped', async () => {
    const file = new URL('../../results/reference/runs/5x3_phi090_rep1.h5', import.meta.url).pathname;
    const replay = new Child(kphi, ['replay', file, '--live', '--speed', '20']);
    try {
      const seen = await browser.newPage({ viewport: { width: 1440, height: 900 }, colorScheme: 'dark' });
      await seen.goto((await replay.waitFor(/^live: (\S+)$/m))[1]);
      await seen.waitForFunction(() => state.steps.length >= 1);
      assert.equal(await seen.locator('#stop_word').innerText(), 'REPLAY');
      assert.ok(await seen.locator('#stop').isDisabled());
      await seen.keyboard.press('Escape');
      await seen.screenshot({ path: path.join(pictures, 'live_view_replay.png') });
      await seen.waitForFunction(() => state.ended);
      assert.equal(await replay.ended, 0, replay.words);
      assert.equal(await seen.locator('#stop_word').innerText(), 'REPLAY OVER');
    } finally {
      if (replay.code === undefined) replay.signal('SIGKILL');
    }
  });
  console.log(`${results.length} of 7 shown`);
} finally {
  await browser?.close();
  bench.clear();
}
