// The worker of a live page: it moves the bodies frame by frame when the page asks, and does in turn what the user did.
import packed from 'filigree-live.wasm.gz';
import { LiveWorld } from './live_world.js';

let world;
let obstacles = []; // numbers of those that the page draws

/// Where everything is, in buffers that the page gives back.
function look(buffers = []) {
  const drivers = world.sizes.map((size, driver) => {
    const values = buffers[driver] ?? new Float32Array(12 * size);
    values.set(world.positions(driver));
    values.set(world.gradients(driver), 3 * size);
    return values;
  });
  return { drivers, poses: obstacles.map((number) => world.obstacle_pose(number)) };
}
function show(kind, seen, facts = {}) {
  postMessage({ kind, ...seen, ...facts }, seen.drivers.map(({ buffer }) => buffer));
}

const actions = {
  async open({ world: bytes, obstacles: numbers }) {
    const code = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
    world = await LiveWorld.open(code, new Uint8Array(bytes));
    obstacles = numbers;
    show('opened', look(), { frame_seconds: world.frame_seconds, particles: world.particles });
  },
  step({ frames, buffers }) {
    const start = performance.now();
    for (let frame = 0; frame < frames; ++frame) world.advance();
    const milliseconds = (performance.now() - start) / frames;
    show('moved', look(buffers), { frames, milliseconds, substeps: world.substeps, contacts: world.contacts, parts: world.parts, bytes: world.bytes });
  },
  grab({ body, rest, place }) { world.grab(body, rest, place); },
  move({ place }) { world.move(place); },
  let_go() { world.let_go(); },
  gravity({ gravity }) { world.set_gravity(gravity); },
  drop_again() {
    world.drop_again();
    show('dropped', look());
  },
};

onmessage = async ({ data }) => {
  try {
    await actions[data.kind](data);
  } catch (cause) {
    postMessage({ kind: 'failed', message: cause.message });
  }
};
