// A browser and a server for tests: storage in memory, and a server that is slow, hangs, or refuses.

import { vi } from "vitest";
import { toBase64 } from "../src/shared/arrays";
import { Mesh } from "../src/studio/data/mesh";
import { Paints, Regions } from "../src/studio/data/labeling";
import type { State } from "../src/studio/data/contract";
import type { Drawing } from "../src/studio/view/drawing";

export interface Request {
  path: string; // without "/api"
  body: Record<string, unknown>;
}

/** Storage in memory with the methods that the studio uses. Object.keys lists the keys, as in a browser. */
export function fakeStorage(capacity = Infinity): Storage {
  const storage = {} as Record<string, string>;
  const hidden = (value: unknown): PropertyDescriptor => ({ value, enumerable: false });
  Object.defineProperties(storage, {
    getItem: hidden((key: string) => storage[key] ?? null),
    setItem: hidden((key: string, text: string) => {
      if (text.length > capacity) throw new Error("full");
      storage[key] = text;
    }),
    removeItem: hidden((key: string) => delete storage[key]),
  });
  return storage as unknown as Storage;
}

type Mode = "answers" | "hangs" | "fails" | { status: number } | "wait";

/** A server with files of `nCells` cells, where every cell is a region. It applies each part of a stroke once. */
export class FakeServer {
  mode: Mode = "answers";
  readonly requests: Request[] = [];
  readonly paint: number[][];
  seq = 0;
  private readonly parts = new Map<string, number>();
  private readonly held: (() => void)[] = [];

  constructor(readonly nCells = 8, nFiles = 2) {
    this.paint = Array.from({ length: nFiles }, () => Array<number>(nCells).fill(0));
    vi.stubGlobal("fetch", (path: string, options: RequestInit) => this.fetch(path, options));
    vi.stubGlobal("localStorage", fakeStorage());
    vi.stubGlobal("window", { addEventListener: vi.fn(), setTimeout });
    vi.stubGlobal("document", { hidden: false });
  }

  /** Answer the requests that were held in the mode "wait", in order. */
  answer(): void {
    this.mode = "answers";
    for (const go of this.held.splice(0)) go();
  }

  sent(name: string): Request[] {
    return this.requests.filter(({ path }) => path.endsWith(`/${name}`));
  }

  private async fetch(url: string, { body, signal }: RequestInit): Promise<Response> {
    const [path] = url.replace("/api", "").split("?");
    const request = { path, body: JSON.parse((body as string | undefined) ?? "{}") as Record<string, unknown> };
    this.requests.push(request);
    const { mode } = this;
    if (mode === "fails") throw new TypeError("no connection");
    if (mode === "hangs") await aborted(signal);
    if (mode === "wait") await Promise.race([new Promise<void>((go) => this.held.push(go)), aborted(signal)]);
    if (typeof mode === "object") return Response.json({ error: "no space left" }, { status: mode.status });
    return this.reply(request);
  }

  private reply({ path, body }: Request): Response {
    const [, , file, name] = path.split("/");
    const paint = this.paint[Number(file)];
    if (name === "paint" && "cells" in body) this.take(paint, body);
    if (name === "paint" && !("cells" in body)) return new Response(Uint32Array.from(paint).buffer);
    if (name === "borders") return new Response(packet({}, { shown: Uint32Array.of(1), sources: Uint32Array.of(0) }));
    if (name === "similar") return Response.json({ regions: [1, 2, 3] });
    return Response.json({ seq: this.seq });
  }

  take(paint: number[], body: Record<string, unknown>): void {
    const [stroke, part] = [body.stroke as string, body.part as number];
    if (part <= (this.parts.get(stroke) ?? -1)) return;
    this.parts.set(stroke, part);
    const bytes = Uint8Array.from(atob(body.cells as string), (character) => character.charCodeAt(0));
    for (const cell of new Uint32Array(bytes.buffer)) paint[cell] = body.class as number;
    this.seq++;
  }
}

function aborted(signal: AbortSignal | null | undefined): Promise<never> {
  return new Promise((_, reject) => signal?.addEventListener("abort", () => reject(new Error("aborted"))));
}

/** A packet of the server with a header and arrays of uint32 or float32 numbers. */
export function packet(header: object, arrays: Record<string, Uint32Array | Float32Array>): ArrayBuffer {
  let offset = 0;
  const entries = Object.entries(arrays).map(([name, { length, constructor }]) => {
    const entry = { name, dtype: constructor === Float32Array ? "float32" : "uint32", shape: [length], offset, coding: "plain" };
    offset += 4 * length;
    return entry;
  });
  let text = JSON.stringify({ ...header, arrays: entries });
  text = text.padEnd(4 * Math.ceil(text.length / 4));
  const bytes = new Uint8Array(12 + text.length + offset);
  bytes.set(new TextEncoder().encode("SFSTUDIO"));
  new DataView(bytes.buffer).setUint32(8, text.length, true);
  bytes.set(new TextEncoder().encode(text), 12);
  Object.values(arrays).forEach(({ buffer, byteLength }, i) => bytes.set(new Uint8Array(buffer, 0, byteLength), 12 + text.length + entries[i].offset));
  return bytes.buffer;
}

/** A cloud of cells in a row, where every cell is a region that is adjacent to the next one. */
export function fakeFile(nCells: number): { mesh: Mesh; regions: Regions; paints: Paints; state: State } {
  const areas = new Float32Array(nCells).fill(1);
  const mesh = new Mesh(packet({ kind: "points", n_cells: nCells, measure: "area", palette: [[0, 0, 0]] }, { areas, positions: new Float32Array(3 * nCells) }));
  const arcs = Uint32Array.from({ length: 2 * nCells - 2 }, (_, i) => (i + 1) >> 1);
  const regions = new Regions(Int32Array.from(areas.keys()), areas, packet({}, { arcs }), 0);
  const classes = [1, 2].map((id) => ({ id, name: `class ${id}`, color: "#102030", key: String(id) }));
  const state = { seq: 0, revision: 0, classes, object_names: [], work: "a.jsonl", n_suggestions: 0, input: { name: "a", n_cells: nCells } };
  return { mesh, regions, paints: new Paints(new Uint32Array(nCells), areas), state: state as unknown as State };
}

/** A drawing that draws nothing. */
export function fakeDrawing(canvas?: HTMLCanvasElement): Drawing {
  const cells = { setPaint: vi.fn(), isHidden: () => false };
  const drawing = { canvas, isCut: () => false, onView: [], afterView: [], cells, mark: vi.fn(), redraw: vi.fn(), select: vi.fn(), setShades: vi.fn(), setLabels: vi.fn(), setParts: vi.fn() };
  return drawing as unknown as Drawing;
}

export const base64 = (...cells: number[]): string => toBase64(Uint32Array.from(cells));
