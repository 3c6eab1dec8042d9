// Objects suggested by an imported file, and the cells of each object.

import { readPacket } from "./packet";
import type { SuggestionEntry } from "./contract";

export interface Suggested {
  entries: SuggestionEntry[];
  owners: Uint32Array; // 1-based index in `entries` of the suggestion of each cell; 0 if the cell has none
}

export const NOTHING_SUGGESTED: Suggested = { entries: [], owners: new Uint32Array(0) };

export function suggestedFrom(buffer: ArrayBuffer): Suggested {
  const { header, arrays } = readPacket<{ suggestions: SuggestionEntry[] }>(buffer);
  return { entries: header.suggestions, owners: arrays.owners as Uint32Array };
}

/**
 * 1-based indices of all suggestions, by decreasing score and, for equal scores, by decreasing area.
 * Suggestions without a score come last.
 */
export function byScore({ entries }: Suggested): number[] {
  const scoreAt = (place: number): number => entries[place - 1].score ?? -1;
  const areaAt = (place: number): number => entries[place - 1].area;
  return entries.map((_, i) => i + 1).sort((a, b) => scoreAt(b) - scoreAt(a) || areaAt(b) - areaAt(a) || a - b);
}
