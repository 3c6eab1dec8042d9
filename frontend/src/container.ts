// The server's binary container: a magic word, a header in JSON, arrays.

const MAGIC = "SFSTUDIO";
const TYPES: Record<string, (buffer: ArrayBuffer, offset: number, length: number) => Numbers> = {
  float32: (buffer, offset, length) => new Float32Array(buffer, offset, length),
  uint32: (buffer, offset, length) => new Uint32Array(buffer, offset, length),
  int32: (buffer, offset, length) => new Int32Array(buffer, offset, length),
};

export type Numbers = Float32Array | Uint32Array | Int32Array;

interface Entry {
  name: string;
  dtype: string;
  shape: number[];
  offset: number;
}

export interface Container<Header> {
  header: Header;
  arrays: Record<string, Numbers>;
}

/** Views on the arrays of a container. Offsets count from the end of its header. */
export function readContainer<Header>(buffer: ArrayBuffer): Container<Header> {
  const magic = new TextDecoder().decode(new Uint8Array(buffer, 0, MAGIC.length));
  if (magic !== MAGIC) throw new Error("the server sent something else than a mesh");
  const length = new DataView(buffer).getUint32(MAGIC.length, true);
  const start = MAGIC.length + 4;
  const text = new TextDecoder().decode(new Uint8Array(buffer, start, length));
  const header = JSON.parse(text) as Header & { arrays: Entry[] };
  const arrays: Record<string, Numbers> = {};
  for (const { name, dtype, shape, offset } of header.arrays) {
    const count = shape.reduce((product, size) => product * size, 1);
    arrays[name] = TYPES[dtype](buffer, start + length + offset, count);
  }
  return { header, arrays };
}
