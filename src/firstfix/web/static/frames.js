/** Binary frames of /v1/live: the scan and the particles. */

const HEADER_BYTES = 16;
const VERSION = 1;
const SCAN = 1;
const PARTICLES = 2;

/**
 * Read one frame.
 *
 * @param {ArrayBuffer} buffer
 * @returns {?{kind: "scan"|"particles", stamp: number, count: number,
 *     values: Float32Array, classes: ?Uint8Array}} null if its kind is unknown
 */
export function readFrame(buffer) {
  if (buffer.byteLength < HEADER_BYTES) return null;
  const header = new DataView(buffer, 0, HEADER_BYTES);
  if (header.getUint8(1) !== VERSION) return null;
  const kind = header.getUint8(0);
  const count = header.getUint32(4, true);
  const stamp = header.getFloat64(8, true);
  if (kind === SCAN && buffer.byteLength === HEADER_BYTES + 9 * count) {
    const values = new Float32Array(buffer, HEADER_BYTES, 2 * count);
    const classes = new Uint8Array(buffer, HEADER_BYTES + 8 * count, count);
    return { kind: "scan", stamp, count, values, classes };
  }
  if (kind === PARTICLES && buffer.byteLength === HEADER_BYTES + 12 * count) {
    const values = new Float32Array(buffer, HEADER_BYTES, 3 * count);
    return { kind: "particles", stamp, count, values, classes: null };
  }
  return null;
}
