// The server's binary answer: a magic word, the length of a header, the header in JSON, arrays.

import { type Arrays, decodeArrays, type Entry } from "../shared/arrays";

const MAGIC = "SFSTUDIO";

export interface Packet<Header> {
  header: Header;
  arrays: Arrays;
}

export function readPacket<Header>(buffer: ArrayBuffer): Packet<Header> {
  const textOf = (start: number, length: number): string =>
    new TextDecoder().decode(new Uint8Array(buffer, start, length));
  if (textOf(0, MAGIC.length) !== MAGIC) throw new Error("the server sent something else than a mesh");
  const start = MAGIC.length + 4;
  const length = new DataView(buffer).getUint32(MAGIC.length, true);
  const header = JSON.parse(textOf(start, length)) as Header & { arrays: Entry[] };
  return { header, arrays: decodeArrays(buffer, start + length, header.arrays) };
}
