// Data of the page: packed columns become arrays of numbers. `columns.rs` writes what is read here.

/** @import { Header, Index } from "./data" */

/**
 * Bytes of a base64 text.
 * @param {string} text
 */
function bytesOf(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

/**
 * A zlib stream, inflated by the browser.
 * @param {Uint8Array<ArrayBuffer>} bytes
 */
async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * Reads `count` variable-length integers from a place on; gives them and the place after.
 * @param {Uint8Array} bytes
 * @param {number} from
 * @param {number} count
 * @returns {[Float64Array, number]}
 */
function integers(bytes, from, count) {
  const values = new Float64Array(count);
  let at = from;
  for (let i = 0; i < count; i += 1) {
    let value = 0;
    let factor = 1;
    while (bytes[at] >= 0x80) {
      value += (bytes[at] & 0x7f) * factor;
      factor *= 128;
      at += 1;
    }
    value += bytes[at] * factor;
    at += 1;
    values[i] = value % 2 === 1 ? -(value + 1) / 2 : value / 2;
  }
  return [values, at];
}

/**
 * Undoes the differences of a column, and gives its values in their unit.
 * @param {Float64Array} values
 * @param {number} order
 * @param {number} step
 */
function restored(values, order, step) {
  for (let round = 0; round < order; round += 1) {
    let sum = 0;
    for (let i = 0; i < values.length; i += 1) {
      sum += values[i];
      values[i] = sum;
    }
  }
  // A step is a decimal such as 0.01: dividing by 100 is exact where multiplying is not.
  const parts = Math.round(1 / step);
  return step < 1 ? values.map((value) => value / parts) : values;
}

/**
 * What an element of the page holds.
 * @param {string} id
 */
function textOf(id) {
  return document.getElementById(id)?.textContent ?? "";
}

/**
 * The header and the columns of an element's data.
 * @param {string} id
 */
export const unpacked = (id) => unpackedText(textOf(id).trim());

/**
 * As `unpacked`, from the text itself.
 * @param {string} text
 * @returns {Promise<{ header: Header, columns: Float64Array[] }>}
 */
export async function unpackedText(text) {
  const bytes = await inflated(bytesOf(text));
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const { columns: layouts, header } = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  let at = 4 + length;
  const columns = layouts.map((/** @type {[number, number, number]} */ [step, order, count]) => {
    const [values, next] = integers(bytes, at, count);
    at = next;
    return restored(values, order, step);
  });
  return { header, columns };
}

/** @type {Index | null} */
let known = null;

/**
 * What the page was made with: everything but what is packed.
 * @returns {Index}
 */
export function index() {
  const read = known ?? JSON.parse(textOf("index"));
  known = read;
  return read;
}
