// `kphi sim` and `kphi run --live` as processes of their own, for tests that look at the page as a person would.
import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import os from 'node:os';
import path from 'node:path';

/// Priorities of the bench and of the run, where this process may grant them.
const kBenchPriority = 20, kRunPriority = 10;
const mayKeepRealTime = spawnSync('chrt', ['-f', '1', 'true']).status === 0;
const inRealTime = (priority, command) => ['chrt', ...(mayKeepRealTime ? ['-f', `${priority}`] : ['-o', '0']), ...command];

/// A child process whose words are read as they come.
export class Child {
  constructor([program, ...args]) {
    this.words = '';
    this.child = spawn(program, args, { stdio: ['ignore', 'pipe', 'pipe'] });
    for (const stream of [this.child.stdout, this.child.stderr])
      stream.setEncoding('utf8').on('data', text => { this.words += text; this.child.emit('words'); });
    this.ended = new Promise(done => this.child.on('close', code => { this.code = code; done(code); this.child.emit('words'); }));
  }
  /// Waits for words that match; returns the match.
  waitFor(pattern, limit_ms = 30_000) {
    return new Promise((done, fail) => {
      const timer = setTimeout(() => fail(new Error(`${pattern} did not come:\n${this.words}`)), limit_ms);
      const look = () => {
        const found = this.words.match(pattern);
        if (!found && this.code === undefined) return;
        clearTimeout(timer);
        this.child.off('words', look);
        found ? done(found) : fail(new Error(`ended without ${pattern}:\n${this.words}`));
      };
      this.child.on('words', look);
      look();
    });
  }
  signal(name) { this.child.kill(name); }
}

const campaign = `format: kphi-campaign/1
name: browser
propeller: {id: 5x3, name: 5-inch three-blade, diameter_in: 5, blades: 3}
occlusions_deg: [90]
repetitions: 20
profile: {steps: 3, dwell_s: 1.2, first_rpm: 6000, last_rpm: 12000}
zero_s: 0.3
minimum_discard_s: 0.25
supply_v: 12.0
limits: {speed_max_rpm: 19100, thrust_max_n: 20, supply_current_max_a: 35, coil_temperature_max_degc: 110}
`;

const bench = (folder, supply) => `format: kphi-bench/1
name: browser
netbox: {host: 127.0.0.1, rdt_port: 49152, http_port: 8049, rate_hz: 7000, records_per_datagram: 40}
iq: {device: ${folder}/motor, baud: 921600, module_id: 0, spin: +1, telemetry_hz: 50, speed_max_rpm: 19300}
thrust_axis: "+Fz"
${supply ? `supply: {uri: "modbus-rtu:${folder}/supply?model=RD6024", voltage_v: 12, current_limit_a: 24, over_voltage_v: 14, over_current_a: 24}` : ''}
simulation: {time_scale: 1, seed: 3, control: ${folder}/control}
`;

/// The simulated bench in real time: 7,000 samples a second.
export class Bench {
  static async start(kphi, { supply = true } = {}) {
    const bench_ = new Bench();
    bench_.kphi = kphi;
    bench_.folder = mkdtempSync(path.join(os.tmpdir(), 'kphi-browser-'));
    writeFileSync(bench_.path('wanted.yaml'), bench(bench_.folder, supply));
    writeFileSync(bench_.path('campaign.yaml'), campaign);
    writeFileSync(bench_.path('short.yaml'), campaign.replace('repetitions: 20', 'repetitions: 1'));
    bench_.sim = new Child(inRealTime(kBenchPriority, [kphi, 'sim', bench_.path('wanted.yaml'), '--free-ports', '--resolved',
      bench_.path('bench.yaml'), '--truth-log', bench_.path('wire.jsonl')]));
    await bench_.sim.waitFor(/"rdt"/);
    return bench_;
  }
  path(name) { return path.join(this.folder, name); }
  run(...more) { return this.runs('campaign.yaml', ...more); }
  runs(campaign, ...more) {
    if (this.child && this.child.code === undefined) throw new Error('another run is under way');
    this.child = new Child(inRealTime(kRunPriority, [this.kphi, 'run', this.path(campaign), '--bench',
      this.path('bench.yaml'), '--yes', '--out', this.path('results'), ...more]));
    return this.child;
  }
  /// What the simulated bench says of itself now.
  status() {
    return new Promise((done, fail) => {
      const line = net.connect(this.path('control'), () => line.write('status\n'));
      let answer = '';
      line.setEncoding('utf8').on('data', text => {
        answer += text;
        if (answer.includes('\n')) { line.end(); done(JSON.parse(answer)); }
      }).on('error', fail);
    });
  }
  /// Bench time minus calendar time, ms: of several questions that which was answered soonest.
  async clockOffset() {
    let best = { took: Infinity, offset: 0 };
    for (let i = 0; i < 10; ++i) {
      const asked = performance.timeOrigin + performance.now(), status = await this.status();
      const took = performance.timeOrigin + performance.now() - asked;
      if (took < best.took) best = { took, offset: 1e3 * status.bench_time_s - asked - took / 2 };
    }
    return best.offset;
  }
  /// What the simulated motor did: [[ms, "drive" or "coast" …], …]; ends the bench.
  async stages() {
    this.sim.signal('SIGTERM');
    await this.sim.ended;
    return readFileSync(this.path('wire.jsonl'), 'utf8').split('\n').filter(line => line.startsWith('{"at_ns"'))
      .map(line => JSON.parse(line)).filter(item => item.stage !== undefined).map(item => [1e-6 * item.at_ns, item.stage]);
  }
  clear() {
    for (const child of [this.child, this.sim]) if (child && child.code === undefined) child.signal('SIGKILL');
    rmSync(this.folder, { recursive: true, force: true });
  }
}
