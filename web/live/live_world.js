// The library's physics in WebAssembly (live.cpp): bytes of a live world in, where its drivers are after every frame out.
// Works in workers and in node.

/// A frame that went wrong: what the library says, or memory that ran out.
export class LiveError extends Error {}

export class LiveWorld {
  /// code: bytes of live.wasm, or a compiled module. world: bytes, as write_live_world gives them.
  static async open(code, world) {
    const made = new LiveWorld();
    const compiled = code instanceof WebAssembly.Module ? code : await WebAssembly.compile(code);
    made.calls = (await WebAssembly.instantiate(compiled, {})).exports;
    made.guarded(() => {
      made.calls._initialize();
      const at = made.calls.take(world.length) >>> 0;
      new Uint8Array(made.calls.memory.buffer).set(world, at);
      made.check(made.calls.begin());
    });
    made.sizes = Array.from({ length: made.calls.driver_count() }, (_, driver) => made.calls.driver_size(driver));
    return made;
  }

  get frame_seconds() { return this.calls.frame_seconds(); }
  get particles() { return this.calls.particle_count(); }
  get substeps() { return this.calls.substeps(); }
  get contacts() { return this.calls.contacts(); }
  get parts() { return this.calls.parts(); }
  get bytes() { return this.calls.memory.buffer.byteLength; }

  check(is_right) {
    if (is_right) return;
    throw new LiveError(this.text_at(this.calls.text() >>> 0));
  }
  text_at(at) {
    const memory = new Uint8Array(this.calls.memory.buffer);
    return new TextDecoder().decode(memory.slice(at, memory.indexOf(0, at)));
  }
  /// Nothing unwinds in the module: what the library throws ends it, and leaves its sentence. What leaves none has run
  /// out of memory.
  guarded(work) {
    try {
      return work();
    } catch (cause) {
      if (!(cause instanceof WebAssembly.RuntimeError)) throw cause;
      throw new LiveError(this.text_at(this.calls.thrown() >>> 0) || 'The physics has run out of memory. Reload the page; bodies with fewer particles need less.');
    }
  }

  advance() { this.guarded(() => this.check(this.calls.advance())); }
  drop_again() { this.guarded(() => this.check(this.calls.drop_again())); }
  set_gravity(gravity) { this.check(this.calls.set_gravity(...gravity)); }
  /// Takes hold of a body. rest: a point on the body at rest, m. place: where that point is now, m.
  grab(body, rest, place) { this.calls.grab(body, ...rest, ...place); }
  /// Where the hand is at the end of the next frame, m.
  move(place) { this.calls.move(...place); }
  let_go() { this.calls.let_go(); }

  /// Views of the module's memory: they hold until the next call.
  positions(driver) { return this.floats(this.calls.positions(driver), 3 * this.sizes[driver]); }
  gradients(driver) { return this.floats(this.calls.gradients(driver), 9 * this.sizes[driver]); }
  floats(at, count) { return new Float32Array(this.calls.memory.buffer, at >>> 0, count); }
  /// 16 numbers, column by column.
  obstacle_pose(obstacle) {
    return new Float64Array(this.calls.memory.buffer, this.calls.obstacle_pose(obstacle) >>> 0, 16).slice();
  }
}
