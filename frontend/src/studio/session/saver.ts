// Queue of strokes that are sent to the server in order. A stroke stays in the queue, and in the storage of the browser,
// until the server has saved or rejected it.

import { type Api, ServerError, ServerGone } from "./api";
import { fromBase64, toBase64 } from "../../shared/arrays";
import type { Progress } from "../data/contract";
import { classOf, joined, objectOf } from "../data/labeling";
import { remember, remembered, rememberedKeys } from "./remembered";

export interface Stroke {
  paint: number; // class and object of the stroke as one number, see data/labeling.ts
  cells: Uint32Array;
  strokeId: string; // entries with the same id belong to one stroke, and are undone together
}

/** A part of a stroke in the queue. The server applies each part once, so it may be sent again. */
interface Entry extends Stroke {
  part: number; // parts of a stroke have ascending numbers
  keys: string[]; // keys in the storage of the browser
  isKept: boolean; // false if the storage is full or disabled
  isSent: boolean; // whether the server may have the part, so that no other part may be joined to it
}

// Ids and keys that begin with this text sort in the order in which pages were opened, and differ between pages.
const PAGE = `${Date.now().toString(36)}-${Math.random().toString(36).slice(2, 8)}`;
let nStrokes = 0;
let nParts = 0;

/** A unique id for a stroke. */
export function newStrokeId(): string {
  return `${PAGE}-${nStrokes++}`;
}

type Kept = [paint: number, cells: string, strokeId: string, part: number];

interface Listener {
  saved(reply: Progress): void;
  refused(error: unknown): void;
  gone(error: Error): void;
}

/**
 * Sends strokes to the server. Each part of a stroke is stored in the browser before it is sent. A page that opens the
 * file later sends what is still stored.
 */
export class Saver {
  private waiting: Entry[];
  private running: Promise<void> = Promise.resolve();
  private isRunning = false;
  private isHeld = false;

  constructor(
    private readonly api: Api,
    private readonly path: string,
    private readonly key: string, // prefix of the keys in the storage of the browser; one per file and work file
    private readonly listener: Listener,
  ) {
    this.waiting = rememberedKeys(`${key} `).flatMap((stored) => entryOf(stored));
  }

  /** Number of unsaved strokes. */
  get count(): number {
    return new Set(this.waiting.map(({ strokeId }) => strokeId)).size;
  }

  get strokes(): readonly Stroke[] {
    return this.waiting;
  }

  /** Whether all unsaved strokes are stored in the browser. */
  get isKept(): boolean {
    return this.waiting.every(({ isKept }) => isKept);
  }

  add(stroke: Stroke): void {
    const part = nParts++;
    const key = `${this.key} ${PAGE} ${String(part).padStart(9, "0")}`;
    const kept: Kept = [stroke.paint, toBase64(stroke.cells), stroke.strokeId, part];
    const isKept = remember(key, JSON.stringify(kept));
    this.waiting.push({ ...stroke, part, keys: [key], isKept, isSent: false });
    void this.flush();
  }

  /**
   * Send all waiting strokes. Resolves when each stroke is saved or rejected, when the server does not respond, or
   * after a call of `hold`.
   */
  flush(): Promise<void> {
    if (!this.isRunning) this.running = this.send();
    return this.running;
  }

  private async send(): Promise<void> {
    this.isRunning = true;
    while (this.waiting.length && !this.isHeld) {
      const entry = this.joinFirst();
      const { paint, cells, strokeId: stroke, part } = entry;
      const body = { class: classOf(paint), object: objectOf(paint), cells: toBase64(cells), stroke, part };
      const reply = await this.api.post<Progress>(`${this.path}/paint`, body, "short").catch((error: Error) => error);
      if (reply instanceof ServerGone || (reply instanceof ServerError && reply.isTemporary)) {
        this.listener.gone(reply);
        break;
      }
      this.waiting = this.waiting.filter((one) => one !== entry);
      for (const key of entry.keys) remember(key, null);
      if (reply instanceof Error) this.listener.refused(reply);
      else this.listener.saved(reply); // see `Session.openNow`
    }
    this.isRunning = false; // without a gap in which a new stroke could miss the end of the loop
  }

  /** Stop sending strokes until `release` is called, so that strokes do not overtake a running operation. */
  hold(): void {
    this.isHeld = true;
  }

  release(): void {
    this.isHeld = false;
    void this.flush();
  }

  /** The first entry, joined with the next entries of its stroke if none of them has been sent before. */
  private joinFirst(): Entry {
    const [first] = this.waiting;
    if (first.isSent) return first; // later entries are sent only after it
    const end = this.waiting.findIndex(({ strokeId }) => strokeId !== first.strokeId);
    const parts = this.waiting.splice(0, end < 0 ? this.waiting.length : end);
    const { part } = parts[parts.length - 1];
    const keys = parts.flatMap((one) => one.keys);
    const isKept = parts.every((one) => one.isKept);
    const entry = { ...first, cells: joined(parts.map(({ cells }) => cells)), part, keys, isKept, isSent: true };
    this.waiting.unshift(entry);
    return entry;
  }
}

/** The stored entry with this key, as a list; empty if it is damaged. Whether the server has it is unknown. */
function entryOf(key: string): Entry[] {
  try {
    const [paint, cells, strokeId, part] = JSON.parse(remembered(key) ?? "") as Kept;
    const numbers = new Uint32Array(fromBase64(cells).buffer);
    return [{ paint, cells: numbers, strokeId, part, keys: [key], isKept: true, isSent: true }];
  } catch {
    return [];
  }
}
