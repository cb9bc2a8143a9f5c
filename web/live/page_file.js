// The file of a live page: "FLGPAGE1", the length of a JSON text, the text, then the parts that it names by their place.

const kMagic = 'FLGPAGE1', kHeadBytes = 16;

/// The bytes of model.live, with progress where the server says how many there are. A page that was opened from disk may
/// not read other files, but may run scripts: there they come from model.live.js. tell: called with the part done, 0 to 1.
export async function load_page_file(tell) {
  if (!location.protocol.startsWith('http')) return bytes_of_script();
  const response = await fetch('model.live');
  if (!response.ok) throw new Error(`model.live cannot be fetched: the server answers ${response.status}.`);
  const expected = Number(response.headers.get('Content-Length')) || 0, pieces = [];
  let size = 0;
  for (const reader = response.body.getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) break;
    pieces.push(value);
    size += value.length;
    if (expected > 0) tell(Math.min(size / expected, 1)); // of packed bytes the server may say fewer
  }
  return new Uint8Array(await new Blob(pieces).arrayBuffer());
}

async function bytes_of_script() {
  const parts = [];
  window.filigree_part = (text) => parts.push(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
  await new Promise((resolve, reject) => {
    const script = document.createElement('script');
    script.src = 'model.live.js';
    script.onload = resolve;
    script.onerror = () => reject(new Error('model.live.js is not beside this page; it holds the bodies when the page is opened from disk.'));
    document.head.append(script);
  });
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

/// { head, bytes, part(place) }: what the JSON says, and a part of it as bytes of its own.
export function open_page_file(bytes) {
  const damaged = () => new Error('model.live is damaged.');
  if (bytes.length < kHeadBytes || new TextDecoder().decode(bytes.subarray(0, 8)) !== kMagic) throw damaged();
  const length = Number(new DataView(bytes.buffer, bytes.byteOffset).getBigUint64(8, true));
  if (length > bytes.length - kHeadBytes) throw damaged();
  let head;
  try {
    head = JSON.parse(new TextDecoder().decode(bytes.subarray(kHeadBytes, kHeadBytes + length)));
  } catch {
    throw damaged();
  }
  const part = (place) => {
    const begin = kHeadBytes + length + place.at;
    if (!(begin + place.bytes <= bytes.length)) throw damaged();
    return bytes.slice(begin, begin + place.bytes);
  };
  return { head, bytes: bytes.length, part };
}
