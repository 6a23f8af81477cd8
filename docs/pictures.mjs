// Makes the pictures of the README: a campaign of the simulated bench in a browser, the first figure of its report, the stand.
//   node pictures.mjs KPHI NODE_MODULES_PARENT FOLDER   (./run pictures)
// With ALL=1 also the states that nobody prints: before the first run, stopped, on a telephone, dark.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import os from 'node:os';
import path from 'node:path';

const [kphi, modules, folder] = process.argv.slice(2).map(each => path.resolve(each));
const playwright = createRequire(path.join(modules, 'here.js'))('playwright-core');
const executablePath = ['/usr/bin/chromium', '/usr/bin/google-chrome'].find(file => existsSync(file));
const work = mkdtempSync(path.join(os.tmpdir(), 'kphi-pictures-'));
const all = Boolean(process.env.ALL);

const start = (...args) => {
  const child = spawn(kphi, args, { cwd: work, stdio: [all ? 'pipe' : 'ignore', 'pipe', 'pipe'] });
  child.words = '';
  for (const stream of [child.stdout, child.stderr]) stream.setEncoding('utf8').on('data', text => { child.words += text; });
  child.ended = new Promise(done => child.on('close', done));
  return child;
};
const until = async (holds, limit_s = 120) => {
  for (let waited = 0; !holds(); waited += 0.1) {
    if (waited > limit_s) throw new Error('it did not come');
    await new Promise(done => setTimeout(done, 100));
  }
};
const run = async (...args) => { const child = start(...args); await child.ended; return child.words; };

await run('init');
for (const file of ['bench.yaml']) {
  const text = readFileSync(path.join(work, file), 'utf8').replaceAll('/tmp/kphi-bench', work);
  writeFileSync(path.join(work, file), text);
}
const sim = start('sim', 'bench.yaml', '--free-ports', '--resolved', 'resolved.yaml');
const browser = await playwright.chromium.launch({ executablePath, args: ['--no-sandbox', '--disable-gpu', '--disable-features=LocalNetworkAccessChecks'] });
try {
  await until(() => existsSync(path.join(work, 'resolved.yaml')));
  const campaign = start('run', 'campaign.yaml', '--bench', 'resolved.yaml', '--yes', '--live');
  await until(() => campaign.words.includes('live: '));
  const url = campaign.words.match(/live: (\S+)/)[1];
  const open = async (width, height, colorScheme = 'light') => {
    const page = await browser.newPage({ viewport: { width, height }, colorScheme });
    page.on('pageerror', error => console.error(`page: ${error.message}`));
    await page.goto(url);
    return page;
  };
  const page = await open(1280, 800);
  if (all) await page.screenshot({ path: path.join(folder, 'before.png') });
  // Late in the campaign: all occlusions but the last, and a repetition before.
  await page.waitForFunction(() => state.tick && state.tick.run >= 11 && state.tick.step >= 24, undefined, { timeout: 180_000 });
  await page.screenshot({ path: path.join(folder, 'live.png') });
  if (all) {
    for (const [width, height, scheme, name] of [[1600, 900, 'dark', 'dark'], [390, 844, 'light', 'phone']]) {
      const other = await open(width, height, scheme);
      await other.waitForFunction(() => state.trace.length > 100);
      await other.screenshot({ path: path.join(folder, `${name}.png`), fullPage: true });
      await other.close();
    }
    await page.selectOption('#curve', 'power');
    await page.mouse.move(300, 500);
    await page.waitForTimeout(500);
    await page.screenshot({ path: path.join(folder, 'power.png') });
  }
  await campaign.ended;
  await page.waitForFunction(() => state.ended);
  if (all) await page.screenshot({ path: path.join(folder, 'ended.png') });
  const results = campaign.words.match(/results\/\S+/)[0];
  await run('fit', results);
  const report = await browser.newPage({ viewport: { width: 1100, height: 800 }, deviceScaleFactor: 1 });
  await report.goto(`file://${path.join(work, results, 'report.html')}`);
  await report.locator('figure').first().screenshot({ path: path.join(folder, 'report.png') });
  await report.locator('figure.stand svg').screenshot({ path: path.join(folder, 'stand.png') });
  if (all) {
    await report.screenshot({ path: path.join(folder, 'report_page.png'), fullPage: true });
    await report.pdf({ path: path.join(folder, 'report.pdf'), format: 'A4' });
  }
} finally {
  sim.kill('SIGINT');
  await browser.close();
}
