// Runs the live world of a page in WebAssembly, by the same calls as run_frames.cpp, and prints a hash a frame; and what a
// frame took, in processor time.
//   node frames.mjs LIVE.wasm MODEL.live FRAMES
import { readFileSync } from 'node:fs';
import { LiveWorld } from '../../web/live/live_world.js';
import { open_page_file } from '../../web/live/page_file.js';

const [code, path, count] = process.argv.slice(2), frames = Number(count);
const { head, part } = open_page_file(readFileSync(path));
const world = await LiveWorld.open(readFileSync(code), part(head.world));

/// FNV-1a of 32-bit words.
function add(hash, floats) {
  for (const word of new Uint32Array(floats.buffer, floats.byteOffset, floats.length)) hash = Math.imul(hash ^ word, 16777619);
  return hash;
}

let milliseconds = 0;
const lines = [];
for (let frame = 0; frame < frames; ++frame) {
  const quarter = Math.floor(frames / 4);
  if (frame === quarter) {
    world.grab(0, [0.125, 0.125, 0.0625], world.positions(0).slice(0, 3));
  }
  if (frame > quarter && frame < Math.floor(frames / 2)) {
    const way = (frame - quarter) / 64;
    world.move([way, 0.5 + way, -0.5 * way]);
  }
  if (frame === Math.floor(frames / 2)) world.let_go();
  if (frame === Math.floor((3 * frames) / 4)) world.set_gravity([4, -8, 2]);
  const start = process.cpuUsage();
  world.advance();
  const { user, system } = process.cpuUsage(start);
  milliseconds += (user + system) / 1000;
  let hash = 2166136261;
  for (let driver = 0; driver < world.sizes.length; ++driver)
    hash = add(add(hash, world.positions(driver)), world.gradients(driver));
  lines.push(`${frame} ${(hash >>> 0).toString(16).padStart(8, '0')} ${world.substeps} ${world.contacts} ${world.parts}`);
}
console.log(lines.join('\n'));
console.error(`${(milliseconds / frames).toFixed(3)} ms a frame, ${world.particles} particles, ${world.bytes} bytes of memory`);
