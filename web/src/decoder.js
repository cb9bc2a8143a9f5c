// The library's own decoder, as WebAssembly (web/decoder): sections in, levels, skins and poses out.
import bytes from 'filigree-decoder.wasm';

const kNumbersOfAPose = 12;

export class Decoder {
  static async make() {
    const decoder = new Decoder();
    const { instance } = await WebAssembly.instantiate(bytes, {});
    decoder.calls = instance.exports;
    decoder.calls._initialize?.();
    return decoder;
  }

  /// Calls a function of the decoder with sections lying one behind the other; what makes no sense to it is damaged.
  read(call, sections, ...numbers) {
    let size = 0;
    for (const section of sections) size += section.length;
    const at = this.calls.take(size) >>> 0;
    let offset = at;
    for (const section of sections) {
      new Uint8Array(this.calls.memory.buffer).set(section, offset);
      offset += section.length;
    }
    let is_sound = false;
    try {
      is_sound = this.calls[call](...sections.map((section) => section.length), ...numbers) !== 0;
    } catch (cause) {
      if (!(cause instanceof WebAssembly.RuntimeError)) throw cause;
    }
    if (!is_sound) throw new Error('model.fil is damaged.');
  }

  begin(steps, low, step, most_triangles) {
    this.calls.begin(steps.normal, steps.tangential, steps.is_refined, most_triangles, ...low, step);
  }
  read_clip(section, numbers) {
    if (numbers !== kNumbersOfAPose) throw new Error('model.fil has poses without gradients.');
    this.read('read_clip', [section], numbers);
  }

  array(type, call, length) { return new type(this.calls.memory.buffer, this.calls[call]() >>> 0, length); }

  get surface_vertex_count() { return this.calls.surface_vertex_count(); }
  get vertex_count() { return this.calls.vertex_count(); }
  get frame_count() { return this.calls.frame_count(); }
  get positions() { return this.array(Float32Array, 'positions', 3 * this.vertex_count); }
  get normals() { return this.array(Int8Array, 'normals', 4 * this.vertex_count); }
  get corners() { return this.array(Uint32Array, 'corners', this.calls.corner_count()); }
  /// Of each vertex four joints and four weights.
  get skins() { return this.array(Uint16Array, 'skins', 8 * this.vertex_count); }
  /// Two texture coordinates a vertex, and four bytes of colour; null where there are none.
  get uvs() { return this.calls.uvs() ? this.array(Float32Array, 'uvs', 2 * this.vertex_count) : null; }
  get colors() { return this.calls.colors() ? this.array(Uint8Array, 'colors', 4 * this.vertex_count) : null; }
  /// Runs of corners, one behind the other: of each its material, its region and its length.
  get runs() { return this.array(Uint32Array, 'runs', 3 * this.calls.run_count()); }
  get parents() { return this.array(Uint32Array, 'parents', this.vertex_count); }
  get levels() { return this.array(Uint8Array, 'levels', this.vertex_count); }
  get regions() { return this.array(Uint32Array, 'regions', this.vertex_count); }
  get reaches() { return this.array(Float32Array, 'reaches', this.calls.region_count()); }
  get driver_triangles() { return this.array(Uint32Array, 'driver_triangles', 3 * this.calls.driver_triangle_count()); }

  driver_rest(driver_vertices) { return this.array(Float32Array, 'driver_rest', 3 * driver_vertices); }

  /// Matrices of the driver's vertices; frame -1 is at rest.
  pose(frame, between, driver_vertices) {
    const at = this.calls.pose(frame, between) >>> 0;
    return new Float32Array(this.calls.memory.buffer, at, 16 * driver_vertices);
  }
}
