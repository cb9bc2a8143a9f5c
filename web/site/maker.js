// What makes a body of a mesh, in WebAssembly (site.cpp): a mesh file's bytes in, the file of a live page out; and what
// bends it. Works in workers and in node.

/// What the library says of a mesh, or memory that ran out.
export class MakerError extends Error {}

/// What the C library asks of the system for streams that nobody opens: there is nothing.
const kNotThere = 52; // ENOSYS of WASI
const system = Object.fromEntries(['environ_get', 'environ_sizes_get', 'fd_close', 'fd_seek', 'fd_write', 'proc_exit']
  .map((name) => [name, () => kNotThere]));

export class Maker {
  /// module: compiled. tell: called with a phase of the work and how far it is, 0 to 1.
  static async start(module, tell = () => {}) {
    const made = new Maker();
    const progress = (at, length, part) => tell(made.text_at(at, length), part);
    made.calls = (await WebAssembly.instantiate(module, { page: { progress }, wasi_snapshot_preview1: system })).exports;
    made.calls._initialize();
    return made;
  }

  get memory() { return this.calls.memory.buffer; }
  text_at(at, length) { return new TextDecoder().decode(new Uint8Array(this.memory, at >>> 0, length)); }
  text_until_zero(at) {
    const bytes = new Uint8Array(this.memory);
    return this.text_at(at, bytes.indexOf(0, at >>> 0) - (at >>> 0));
  }

  /// Nothing unwinds in the module: what the library throws ends it, and leaves its sentence. What leaves none has run
  /// out of memory.
  guarded(work) {
    try {
      const is_right = work();
      if (is_right === 0) throw new MakerError(this.text_until_zero(this.calls.text()));
    } catch (cause) {
      if (!(cause instanceof WebAssembly.RuntimeError)) throw cause;
      const sentence = this.text_until_zero(this.calls.thrown());
      throw new MakerError(sentence || 'This mesh needs more memory than the browser gives to a page.');
    }
  }
  /// Gives pieces of bytes, and returns how long the first is.
  give(...pieces) {
    const all = pieces.map((piece) => (typeof piece === 'string' ? new TextEncoder().encode(piece) : piece));
    let at = this.calls.take(all.reduce((sum, { length }) => sum + length, 0)) >>> 0;
    for (const piece of all) {
      new Uint8Array(this.memory).set(piece, at);
      at += piece.length;
    }
    return all[0].length;
  }

  read(name, bytes) { this.guarded(() => this.calls.read(this.give(name, bytes))); }
  /// A shape of the library's own.
  sample({ shape, resolution, frequency, amplitude }) {
    this.guarded(() => this.calls.sample(this.give(shape), resolution, frequency, amplitude));
  }
  get vertices() { return this.calls.vertex_count() >>> 0; }
  get triangles() { return this.calls.triangle_count() >>> 0; }

  /// The bytes of the page's file. young_modulus: Pa; 0: the material's. tilt: degrees.
  make({ material, young_modulus = 0, particles, pieces = 0, tilt = 0 }) {
    this.guarded(() => this.calls.make(this.give(material), young_modulus, particles, pieces, tilt));
    return new Uint8Array(this.memory, this.calls.page() >>> 0, this.calls.page_size() >>> 0).slice();
  }

  /// How to bend so that a point at rest goes a way, m: three numbers whose length is in degrees, and a stretch.
  bend_of(rest, way) { return [...new Float64Array(this.memory, this.calls.bend_of(...rest, ...way) >>> 0, 4)]; }
  /// The driver, as a live page has it: positions, then gradients. values: of the right length, to fill.
  bend(bend, values) {
    this.guarded(() => { this.calls.bend(...bend); });
    const count = this.calls.driver_size();
    const driver = values?.length === 12 * count ? values : new Float32Array(12 * count);
    driver.set(new Float32Array(this.memory, this.calls.positions() >>> 0, 3 * count));
    driver.set(new Float32Array(this.memory, this.calls.gradients() >>> 0, 9 * count), 3 * count);
    return driver;
  }
  /// Of each vertex how far it is from where the bend itself takes it, fractions of the diagonal.
  measure() {
    this.guarded(() => this.calls.measure());
    return new Float32Array(this.memory, this.calls.errors() >>> 0, this.calls.model_vertices()).slice();
  }
}

/// Packed with gzip, as the page carries it.
export async function compile(packed) {
  return WebAssembly.compile(await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer());
}
