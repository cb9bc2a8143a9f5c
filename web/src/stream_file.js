// A coded model file, read piece by piece: its table, then whatever section is asked for. docs/fil-format.md has every
// byte.
import { GrowingBytes } from './growing_bytes.js';

const kHeaderBytes = 32, kEntryBytes = 40, kFirstBytes = 1 << 16;

/// Bytes of a file on a server, in ranges where it gives them, else all in order.
class ServedBytes {
  constructor(url) { this.url = url; this.kept = new GrowingBytes(); }

  /// The bytes from `begin` to `end`.
  async read(begin, end) {
    if (end <= this.kept.length) return this.kept.part(begin, end);
    if (!this.body) {
      const response = await fetch(this.url, { headers: { Range: `bytes=${begin}-${end - 1}` } });
      if (response.status === 206) return this.keep(begin, new Uint8Array(await response.arrayBuffer()));
      if (!response.ok) throw new Error(`${this.url} cannot be fetched: the server answers ${response.status}.`);
      this.body = response.body.getReader(); // it sends all; what is not read yet waits
    }
    while (this.kept.length < end) {
      const { done, value } = await this.body.read();
      if (done) throw new Error(`${this.url} ends too early.`);
      this.kept.append(value);
    }
    return this.kept.part(begin, end);
  }
  keep(begin, bytes) {
    if (begin === 0) this.kept = new GrowingBytes(bytes);
    return bytes;
  }
}

/// The same of a page that was opened from disk: it may not read files, but may run scripts.
class ScriptBytes {
  async read(begin, end) {
    this.bytes ??= await bytes_of_script();
    return this.bytes.subarray(begin, end);
  }
}

async function bytes_of_script() {
  const parts = [];
  window.filigree_part = (text) => parts.push(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
  await new Promise((resolve, reject) => {
    const script = document.createElement('script');
    script.src = 'model.fil.js';
    script.onload = resolve;
    script.onerror = () => reject(new Error('model.fil.js is not beside this page; it holds the model when the page is opened from disk.'));
    document.head.append(script);
  });
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

export class StreamFile {
  static async open() {
    const file = new StreamFile();
    file.source = location.protocol.startsWith('http') ? new ServedBytes('model.fil') : new ScriptBytes();
    const first = await file.source.read(0, kFirstBytes).catch(async () => file.source.read(0, kHeaderBytes));
    const header = new DataView(first.buffer, first.byteOffset);
    if (new TextDecoder().decode(first.subarray(0, 8)) !== 'FILIGREE') throw new Error('model.fil is no model file.');
    const count = header.getUint32(12, true);
    file.bytes = Number(header.getBigUint64(16, true));
    const table = await file.source.read(0, kHeaderBytes + count * kEntryBytes);
    const view = new DataView(table.buffer, table.byteOffset);
    file.sections = new Map();
    for (let at = kHeaderBytes; at < kHeaderBytes + count * kEntryBytes; at += kEntryBytes) {
      const name = new TextDecoder().decode(table.subarray(at, at + 8)).replace(/\0+$/, '');
      const begin = Number(view.getBigUint64(at + 16, true));
      const size = view.getUint32(at + 12, true) * Number(view.getBigUint64(at + 24, true));
      file.sections.set(`${name} ${view.getUint32(at + 8, true)}`, { begin, end: begin + size });
    }
    return file;
  }

  has(name, index = 0) { return this.sections.has(`${name} ${index}`); }
  end_of(name, index = 0) { return this.sections.get(`${name} ${index}`).end; }

  /// A section's bytes, on their own.
  async section(name, index = 0) {
    const place = this.sections.get(`${name} ${index}`);
    if (!place) return new Uint8Array(0);
    const bytes = await this.source.read(place.begin, place.end);
    if (bytes.length !== place.end - place.begin) throw new Error('model.fil ends too early.');
    return bytes.slice();
  }
  async view(name, index = 0) { return new DataView((await this.section(name, index)).buffer); }
}
