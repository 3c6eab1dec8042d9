// Queue of strokes that are sent to the server in order. A stroke stays in the queue until the server
// has saved or rejected it.

import { type Api, ServerGone, type ServerError } from "./api";
import { fromBase64, toBase64 } from "../../shared/arrays";
import type { Progress } from "../data/contract";
import { classOf, joined, objectOf } from "../data/labeling";
import { remember, remembered } from "./remembered";

export interface Stroke {
  paint: number;
  cells: Uint32Array;
  strokeId: string; // entries with the same id belong to one stroke, and are undone together
}

let nStrokes = 0;

/** A unique id for a stroke. */
export function newStrokeId(): string {
  return `${Date.now().toString(36)}-${nStrokes++}`;
}

type Kept = [paint: number, cells: string, strokeId: string];

interface Listener {
  saved(reply: Progress): void;
  refused(error: ServerError): void;
  gone(): void;
}

// Unsaved strokes are stored in the browser only if their JSON text has at most this number of characters.
const MAX_KEPT = 4_000_000;

/**
 * Sends strokes to the server. When the server stops responding, unsaved strokes are also stored in the
 * browser, so that the user can close the page without losing strokes. More than `MAX_KEPT` characters
 * are not stored.
 */
export class Saver {
  private waiting: Stroke[] = [];
  private running: Promise<void> | null = null;
  private isHeld = false;

  constructor(
    private readonly api: Api,
    private readonly path: string,
    private readonly key: string,
    private readonly listener: Listener,
  ) {
    this.waiting = this.kept();
  }

  get count(): number {
    return this.waiting.length;
  }

  get strokes(): readonly Stroke[] {
    return this.waiting;
  }

  add(stroke: Stroke): void {
    this.waiting.push(stroke);
    void this.flush();
  }

  /**
   * Send all waiting strokes. Resolves when each stroke is saved or rejected, when the server does not respond, or
   * after a call of `hold`.
   */
  flush(): Promise<void> {
    this.running ??= this.send().finally(() => {
      this.running = null;
    });
    return this.running;
  }

  private async send(): Promise<void> {
    while (this.waiting.length && !this.isHeld) {
      const count = this.joinable();
      const parts = this.waiting.slice(0, count);
      try {
        const { paint, strokeId } = parts[0];
        const cells = toBase64(joined(parts.map((part) => part.cells)));
        const body = { class: classOf(paint), object: objectOf(paint), cells, stroke: strokeId };
        const reply = await this.api.post<Progress>(`${this.path}/paint`, body);
        this.waiting.splice(0, count);
        this.listener.saved(reply);
      } catch (error) {
        if (error instanceof ServerGone) {
          this.keep();
          this.listener.gone();
          return;
        }
        this.waiting.splice(0, count);
        this.listener.refused(error as ServerError);
      }
    }
    if (!this.waiting.length) remember(this.key, null);
  }

  /** Stop sending strokes until `release` is called, so that strokes do not overtake a running operation. */
  hold(): void {
    this.isHeld = true;
  }

  release(): void {
    this.isHeld = false;
    void this.flush();
  }

  /** Number of entries at the front of the queue that belong to the same stroke. */
  private joinable(): number {
    const end = this.waiting.findIndex(({ strokeId }) => strokeId !== this.waiting[0].strokeId);
    return end < 0 ? this.waiting.length : end;
  }

  private keep(): void {
    const entries = this.waiting.map(({ paint, cells, strokeId }) => [paint, toBase64(cells), strokeId]);
    const text = JSON.stringify(entries);
    if (text.length <= MAX_KEPT) remember(this.key, text);
  }

  private kept(): Stroke[] {
    try {
      const entries = JSON.parse(remembered(this.key) ?? "[]") as Kept[];
      return entries.map(([paint, cells, strokeId]) => ({
        paint, cells: new Uint32Array(fromBase64(cells).buffer), strokeId,
      }));
    } catch {
      return [];
    }
  }
}
