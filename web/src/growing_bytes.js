/// Bytes that arrive in pieces, of a number that is not known before. The room doubles, so each byte is moved twice at
/// most beside its arrival.
export class GrowingBytes {
  constructor(bytes = new Uint8Array(0)) {
    this.room = bytes;
    this.length = bytes.length;
  }

  append(piece) {
    const needed = this.length + piece.length;
    if (needed > this.room.length) {
      const larger = new Uint8Array(Math.max(needed, 2 * this.room.length));
      larger.set(this.room.subarray(0, this.length));
      this.room = larger;
    }
    this.room.set(piece, this.length);
    this.length = needed;
  }

  /// A view, which later pieces leave as it is.
  part(begin, end) { return this.room.subarray(begin, Math.min(end, this.length)); }
}
