// Sections of a model file that lies in memory. docs/fil-format.md has every byte.

const kHeaderBytes = 32, kEntryBytes = 40;

export class BytesFile {
  constructor(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset), count = view.getUint32(12, true);
    this.bytes = bytes;
    this.sections = new Map();
    for (let at = kHeaderBytes; at < kHeaderBytes + count * kEntryBytes; at += kEntryBytes) {
      const name = new TextDecoder().decode(bytes.subarray(at, at + 8)).replace(/\0+$/, '');
      const begin = Number(view.getBigUint64(at + 16, true));
      const size = view.getUint32(at + 12, true) * Number(view.getBigUint64(at + 24, true));
      this.sections.set(`${name} ${view.getUint32(at + 8, true)}`, { begin, end: begin + size });
    }
  }

  /// A section's bytes, on their own; empty: there is none.
  section(name, index = 0) {
    const place = this.sections.get(`${name} ${index}`);
    return place ? this.bytes.slice(place.begin, place.end) : new Uint8Array(0);
  }
  view(name, index = 0) { return new DataView(this.section(name, index).buffer); }
  floats(name) { return this.sections.has(`${name} 0`) ? new Float32Array(this.section(name).buffer) : null; }
  indices(name) { return this.sections.has(`${name} 0`) ? new Uint32Array(this.section(name).buffer) : null; }
}
