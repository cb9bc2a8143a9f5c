// The worker of the standing page: it makes bodies of a mesh, and bends the last of them.
import packed from 'filigree-site.wasm.gz';
import { compile, Maker } from './maker.js';

const kStraight = [0, 0, 0, 1];
let maker;
let start = kStraight, now = kStraight; // when the pull began, and now

/// Two bends, one after the other: angles add, stretches multiply.
function both(a, b) { return [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] * b[3]]; }

const actions = {
  /// module: of an earlier worker. name, bytes: of a file; or sample: of the library's own shapes.
  async read({ module, name, bytes, sample }) {
    const code = module ?? await compile(packed);
    let told = 0;
    maker = await Maker.start(code, (phase, part) => {
      if (performance.now() - told < 60 && part < 1) return;
      told = performance.now();
      postMessage({ kind: 'progress', phase, part, at: told });
    });
    const begun = performance.now();
    if (sample) maker.sample(sample);
    else maker.read(name, new Uint8Array(bytes));
    postMessage({ kind: 'read', module: code, vertices: maker.vertices, triangles: maker.triangles, milliseconds: performance.now() - begun });
  },
  make({ options }) {
    const begun = performance.now(), page = maker.make(options);
    start = now = kStraight;
    postMessage({ kind: 'made', page, milliseconds: performance.now() - begun, memory: maker.memory.byteLength }, [page.buffer]);
  },
  /// Where the driver is when a point at rest is pulled a way; holds: a new pull begins. Or bent as told.
  bend({ holds, rest, way, bend, values }) {
    if (holds) start = now;
    now = bend ?? both(start, maker.bend_of(rest, way));
    const driver = maker.bend(now, values);
    postMessage({ kind: 'bent', driver }, [driver.buffer]);
  },
  measure() {
    const errors = maker.measure();
    postMessage({ kind: 'measured', errors }, [errors.buffer]);
  },
};

onmessage = async ({ data }) => {
  try {
    await actions[data.kind](data);
  } catch (cause) {
    postMessage({ kind: 'failed', message: cause.message });
  }
};
