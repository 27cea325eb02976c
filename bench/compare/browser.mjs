// Shows one page in a headless Chromium of its own: node browser.mjs CHROMIUM < JOB
// The job (JSON) has the page's URL and what measure.mjs wants to know. Writes the measured figures as JSON to standard output.
import fs from 'node:fs';
import {chromium} from 'playwright-core';

/// Process ids of `root` and all below it.
function family(root) {
  const children = new Map();
  for (const pid of fs.readdirSync('/proc').filter(name => /^\d+$/.test(name))) {
    try {
      const stat = fs.readFileSync(`/proc/${pid}/stat`, 'utf8');
      const parent = Number(stat.slice(stat.lastIndexOf(')') + 2).split(' ')[1]);
      children.set(parent, [...(children.get(parent) ?? []), Number(pid)]);
    } catch {} // it has ended
  }
  const found = [root];
  for (let i = 0; i < found.length; ++i) found.push(...(children.get(found[i]) ?? []));
  return found;
}

/// Bytes resident in the processes that run pages and draw. Pages shared by several count by their share (Pss).
function residentBytes(root) {
  let total = 0;
  for (const pid of family(root)) {
    try {
      const command = fs.readFileSync(`/proc/${pid}/cmdline`, 'utf8');
      if (!/--type=(renderer|gpu-process)/.test(command)) continue;
      total += 1024 * Number(/^Pss:\s+(\d+)/m.exec(fs.readFileSync(`/proc/${pid}/smaps_rollup`, 'utf8'))[1]);
    } catch {}
  }
  return total;
}

const job = JSON.parse(fs.readFileSync(0, 'utf8'));
const browser = await chromium.launch({
  executablePath: process.argv[2], headless: true, chromiumSandbox: false,
  args: ['--use-angle=gl-egl', '--ignore-gpu-blocklist', '--disable-background-networking'],
});
const page = await browser.newPage({viewport: {width: job.width, height: job.height}, deviceScaleFactor: 1});
const complaints = [];
page.on('pageerror', error => complaints.push(String(error)));
page.on('console', message => { if (message.type() === 'error') complaints.push(message.text()); });
await page.goto(job.url);
await page.waitForFunction(() => window.compare, null, {timeout: 60_000});
const result = await page.evaluate(what => window.compare(what), job);
result.resident_bytes = residentBytes(process.pid);
result.browser = browser.version();
result.complaints = complaints.slice(0, 10);
if (job.picture) {
  // A frame drawn in the same task in which it is read: the drawing buffer is not kept.
  await page.screenshot({path: job.picture});
}
await browser.close();
process.stdout.write(JSON.stringify(result) + '\n');
