// Decodes the named arrays that superfacets_show.page.coding packs into one buffer, and converts
// arrays to and from base64.

const TYPES = {
  uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array, int32: Int32Array, float32: Float32Array,
};
const WORDS = [Uint8Array, Uint8Array, Uint16Array, Uint16Array, Uint32Array]; // unsigned array type, indexed by its element size in bytes

export type Numbers = InstanceType<(typeof TYPES)[keyof typeof TYPES]>;

export type Arrays = Record<string, Numbers | undefined>;

export interface Entry {
  name: string;
  dtype: keyof typeof TYPES;
  shape: number[];
  offset: number;
  coding: "plain" | "planes" | "difference" | "newest";
}

/**
 * Returns the decoded arrays by name, in row-major order. Offsets of entries are relative to `start`.
 * Arrays with plain coding are views of `buffer`.
 */
export function decodeArrays(buffer: ArrayBuffer, start: number, entries: Entry[]): Arrays {
  const arrays: Arrays = {};
  for (const entry of entries) {
    const count = entry.shape.reduce((product, size) => product * size, 1);
    const at = start + entry.offset;
    const Type = TYPES[entry.dtype];
    if (entry.coding === "plain") {
      arrays[entry.name] = new Type(buffer, at, count);
      continue;
    }
    const words = new WORDS[Type.BYTES_PER_ELEMENT](count);
    const rows = entry.coding === "newest" ? count : entry.shape[0];
    joinPlanes(words, new Uint8Array(buffer, at), rows, entry.coding === "difference");
    if (entry.coding === "newest") numbersOfCodes(words);
    arrays[entry.name] = new Type(words.buffer);
  }
  return arrays;
}

/**
 * Decodes byte planes: first the lowest byte of every element, then the second byte, and so on.
 * Elements are stored column by column. With `isDifference`, each element is stored as its
 * difference from the previous element of the column.
 */
function joinPlanes(
  words: Uint8Array | Uint16Array | Uint32Array, bytes: Uint8Array, rows: number, isDifference: boolean,
): void {
  const count = words.length;
  const columns = rows ? count / rows : 0;
  for (let column = 0; column < columns; column++) {
    let last = 0;
    for (let row = 0; row < rows; row++) {
      const from = column * rows + row;
      let word = 0;
      for (let plane = 0; plane < words.BYTES_PER_ELEMENT; plane++) {
        word |= bytes[plane * count + from] << (8 * plane);
      }
      last = isDifference ? (last + word) | 0 : word;
      words[row * columns + column] = last; // the typed array keeps only the low bits, as the encoder did
    }
  }
}

/**
 * Decodes numbers in place. Code 0 means the lowest number that has not occurred yet, and code k
 * means that number minus k.
 */
function numbersOfCodes(words: Uint8Array | Uint16Array | Uint32Array): void {
  let next = 0;
  for (let i = 0; i < words.length; i++) {
    const code = words[i];
    words[i] = next - code;
    if (code === 0) next++;
  }
}

const CHUNK = 0x8000; // bytes per call of String.fromCharCode, whose number of arguments is limited

interface Decoder {
  fromBase64?: (text: string) => Uint8Array<ArrayBuffer>; // static method that is missing in older browsers
}

export function toBase64(numbers: Uint32Array | Uint8Array): string {
  const bytes = new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength);
  let text = "";
  for (let start = 0; start < bytes.length; start += CHUNK) {
    text += String.fromCharCode(...bytes.subarray(start, start + CHUNK));
  }
  return btoa(text);
}

export function fromBase64(text: string): Uint8Array<ArrayBuffer> {
  const { fromBase64: decode } = Uint8Array as Decoder;
  if (decode) return decode.call(Uint8Array, text);
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes;
}
