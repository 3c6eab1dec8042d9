// Decodes binary responses of the studio server.

import { type Arrays, decodeArrays, type Entry } from "../../shared/arrays";
import { text } from "../text/index";

const MAGIC = "SFSTUDIO";

/** Decodes a binary response: magic word, length of the header, header in JSON, and arrays. */
export function readPacket<Header>(buffer: ArrayBuffer): { header: Header; arrays: Arrays } {
  const textOf = (start: number, length: number): string =>
    new TextDecoder().decode(new Uint8Array(buffer, start, length));
  if (textOf(0, MAGIC.length) !== MAGIC) throw new Error(text.session.badPacket);
  const start = MAGIC.length + 4;
  const length = new DataView(buffer).getUint32(MAGIC.length, true);
  const header = JSON.parse(textOf(start, length)) as Header & { arrays: Entry[] };
  return { header, arrays: decodeArrays(buffer, start + length, header.arrays) };
}
