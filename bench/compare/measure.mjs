// Drives a system in a page and measures it. A system has:
//   create(pose)   makes the view; a promise
//   look(pose)     moves the camera; pose: [lat, lon, height, heading, pitch]
//   draw()         draws one frame now
//   isComplete()   whether everything that the camera wants is drawn
//   gl()           its WebGL context

// Complete counts from the first moment after which it stays so for this long and this many frames.
const kSettledMs = 1000;
const kSettledFrames = 10;

const nextFrame = () => new Promise(requestAnimationFrame);

/// Draws, and waits until the driver is done: gl.finish() only flushes in Chromium, reading a pixel does not. Milliseconds.
function drawFully(system) {
  const start = performance.now();
  system.draw();
  const gl = system.gl();
  const bound = gl.getParameter(gl.FRAMEBUFFER_BINDING);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  gl.bindFramebuffer(gl.FRAMEBUFFER, bound);
  return performance.now() - start;
}

/// Draws until it is complete and stays so. Gives when that began (performance.now()), or null if time is up.
async function untilComplete(system, timeoutMs) {
  const start = performance.now();
  let since = null, frames = 0;
  while (performance.now() - start < timeoutMs) {
    await nextFrame();
    system.draw();
    if (!system.isComplete()) {
      since = null;
      continue;
    }
    if (since === null) {
      since = performance.now();
      frames = 0;
    }
    if (++frames >= kSettledFrames && performance.now() - since > kSettledMs) return since;
  }
  return null;
}

async function stand(system, job) {
  const start = performance.now();
  await system.create(job.pose);
  system.look(job.pose);
  const completeAt = await untilComplete(system, job.timeout_ms);
  const frames = [];
  for (let i = 0; i < job.timed_frames; ++i) {
    await nextFrame();
    frames.push(drawFully(system));
  }
  return {complete_ms: completeAt === null ? null : completeAt - start, frames};
}

/// By the wall clock: slow frames leave others out.
async function fly(system, job) {
  await system.create(job.rows[0].pose);
  const frames = [];
  const start = performance.now();
  let last = -1;
  while (last + 1 < job.rows.length) {
    await nextFrame();
    const due = Math.min(Math.floor((performance.now() - start) / 1000 * job.frames_per_second), job.rows.length - 1);
    if (due <= last) continue;
    last = due;
    system.look(job.rows[due].pose);
    const ms = drawFully(system);
    if (job.rows[due].time >= job.rest_s) frames.push(ms);
  }
  const arrivedAt = performance.now();
  const completeAt = await untilComplete(system, job.timeout_ms);
  return {complete_ms: completeAt === null ? null : Math.max(completeAt - arrivedAt, 0), frames};
}

export async function measure(system, job) {
  const result = await (job.rows ? fly(system, job) : stand(system, job));
  const gl = system.gl();
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  result.driver = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  result.detail = system.detail?.() ?? {};
  return result;
}
