/** Binary frames of /v1/live: the scan, the particles and the belief. */

const HEADER_BYTES = 16;
const VERSION = 1;
const SCAN = 1;
const PARTICLES = 2;
const BELIEF = 3;
const HEAT_HEADER_BYTES = 8;

/**
 * Read one frame.
 *
 * @param {ArrayBuffer} buffer
 * @returns {?{kind: "scan"|"particles"|"belief", stamp: number, count: number,
 *     values: Float32Array, classes: ?Uint8Array, sensors: ?Uint8Array}} null if its kind is unknown
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
    const bytes = new Uint8Array(buffer, HEADER_BYTES + 8 * count, count);
    const classes = bytes.map((byte) => byte & 15);
    const sensors = bytes.map((byte) => byte >> 4);
    return { kind: "scan", stamp, count, values, classes, sensors };
  }
  if (kind === PARTICLES && buffer.byteLength === HEADER_BYTES + 12 * count) {
    const values = new Float32Array(buffer, HEADER_BYTES, 3 * count);
    return { kind: "particles", stamp, count, values, classes: null };
  }
  if (kind === BELIEF) return readHeat(buffer, count, stamp);
  return null;
}

/** The heat map: width, height and cell size (m), then one byte per cell from the map's origin. */
function readHeat(buffer, count, stamp) {
  if (count === 0) return { kind: "belief", stamp, count, heat: null };
  if (buffer.byteLength !== HEADER_BYTES + HEAT_HEADER_BYTES + count) return null;
  const layout = new DataView(buffer, HEADER_BYTES, HEAT_HEADER_BYTES);
  const [width, height] = [layout.getUint16(0, true), layout.getUint16(2, true)];
  const cell = layout.getFloat32(4, true);
  const values = new Uint8Array(buffer, HEADER_BYTES + HEAT_HEADER_BYTES, count);
  return { kind: "belief", stamp, count, heat: { width, height, cell, values } };
}
