// Times @mapbox/martini: node time_martini.js GRID SIDE MAX_ERROR COUNT
// GRID holds SIDE * SIDE floats in this machine's byte order. Writes {"ms": median time, "triangles": count} to standard output.
// As there, the coordinates that depend on the side alone are made once and not timed.
'use strict';

const fs = require('fs');
const Martini = require('@mapbox/martini');

const [file, side, maxError, count] = process.argv.slice(2);
const bytes = fs.readFileSync(file);
const grid = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
const martini = new Martini(Number(side));

let triangles = 0;
function decimate() {
  const start = process.hrtime.bigint();
  triangles = martini.createTile(grid).getMesh(Number(maxError)).triangles.length / 3;
  return Number(process.hrtime.bigint() - start) / 1e6;
}

const warmUp = 30; // the compiler needs some runs to be done
const times = [];
for (let i = 0; i < warmUp + Number(count); ++i) {
  const ms = decimate();
  if (i >= warmUp) times.push(ms);
}
times.sort((a, b) => a - b);
process.stdout.write(JSON.stringify({ms: times[times.length >> 1], triangles}) + '\n');
