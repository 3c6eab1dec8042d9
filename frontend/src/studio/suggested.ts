// Objects that a file suggests, and the cells of each.

import { readPacket } from "./api";
import type { SuggestionEntry } from "./contract";

export interface Suggested {
  entries: SuggestionEntry[];
  owners: Uint32Array; // for each cell the place of its suggestion in the list, from 1; 0: none
}

export const NOTHING_SUGGESTED: Suggested = { entries: [], owners: new Uint32Array(0) };

export function suggestedFrom(buffer: ArrayBuffer): Suggested {
  const { header, arrays } = readPacket<{ suggestions: SuggestionEntry[] }>(buffer);
  return { entries: header.suggestions, owners: arrays.owners as Uint32Array };
}

/** Places in the list, from 1: the highest score first, those without a score last. */
export function byScore({ entries }: Suggested): number[] {
  const scoreAt = (place: number): number => entries[place - 1].score ?? -1;
  return entries.map((_, i) => i + 1).sort((a, b) => scoreAt(b) - scoreAt(a) || a - b);
}
