// @vitest-environment happy-dom

import { beforeAll, expect, test, vi } from "vitest";
import ts from "typescript";
import page from "../index.html?raw";
import { Camera } from "../src/shared/camera";
import type { Mesh } from "../src/studio/data/mesh";
import { base64, fakeStorage, packet } from "./fake";

type Table = string | ((...values: unknown[]) => Table) | readonly Table[] | { [key: string]: Table };

/** A pseudo language: every phrase of a table is in brackets, also results of functions. */
function bracketed(table: Table): Table {
  if (typeof table === "string") return table && `⟦${table}⟧`;
  if (typeof table === "function") return (...values) => bracketed(table(...values));
  if (Array.isArray(table)) return table.map(bracketed);
  return Object.fromEntries(Object.entries(table).map(([key, value]) => [key, bracketed(value)]));
}

vi.mock("../src/studio/text/en", async (original) => ({ en: bracketed((await original<{ en: Table }>()).en) }));
vi.mock("../src/studio/view/drawing", () => ({ COVER: 4, Drawing: FakeDrawing }));

const nothing = (): void => undefined;

/** A drawing in which the last hovered cell is everywhere. */
class FakeDrawing {
  readonly camera = new Camera(nothing);
  readonly cells = { hasHidden: false, isAllHidden: false, isHidden: () => false, mark: nothing, unmarkAll: nothing, setPaint: nothing };
  readonly setMesh = ({ shape }: Mesh): void => this.camera.show(shape.facts, shape.positions);
  readonly [list: string]: unknown;
  readonly [kind: symbol]: unknown;

  constructor(readonly canvas: HTMLCanvasElement) {
    const members = { onView: [], afterView: [], afterDraw: [], clip: null, blend: { toggle: () => false }, coversSeen: () => seen(), cellsSeen: () => seen(), countSeen: (poses: unknown[]) => poses.map(() => 99) };
    Object.assign(this, members);
    return new Proxy(this, { get: (own, name) => (name in own ? own[name as string] : nothing) });
  }
}

const seen = (): object => ({ cells: Uint32Array.of(0), depths: Float32Array.of(0.5), width: 1, height: 1, scale: 1 });

const N = 8; // number of cells and regions
const LETTERS = /\p{L}/u;
const KEY = /^((Ctrl|Alt|Shift)\+)*(\S|Arrows?|Enter|Delete|Home|PageUp|PageDown|1 … 9)$/;
const PHRASE = /^(?!superfacets |[#.[]).*\p{L}{2} \p{L}/u; // two words, but no name in the storage and no selector
const ATTRIBUTES = ["title", "aria-label", "placeholder", "alt", "aria-valuetext"];
const said: string[] = [];

const state = {
  seq: 0, revision: 0, object_names: [], work: "1.2", n_suggestions: 2, input: { name: "1.2", n_cells: N }, notes: [], levels: [N, 4, 2], n_regions: N,
  classes: ["11", "22"].map((name, i) => ({ id: i + 1, name, color: "#102030", key: "" })), can_undo: true, can_redo: true, is_reviewed: true, is_changed: true, statistics: { seconds: 90, strokes: 2 },
  parameters: { n_segments: 4, alpha: 1, ridges: 1, smooth: true, scans: false, color: false, level: 4 }, has_colors: false, ranges: { n_segments: [2, 8] },
  exports: { cells: { 9: "1.9" }, objects: { json: "1.1", npz: "1.2", csv: "1.3", "aggregation.json": "1.4", zip: "1.5" }, vertices: {}, instances: {}, regions: {}, region_classes: {} },
};
const paint = Uint32Array.of(0, 0x10001, 0x20001, 0x10002, 0, 0, 0, 0);
const agreement = { name: "3.4", labeled: 0.5, share: 0.25, classes: [{ class: 1, name: "11", iou: 0.5, objects: [{ object: 1, mine: null, theirs: 2, iou: 0.5 }, { object: 2, mine: 1, theirs: null, iou: null }] }] };
const effect = { ...state, kind: "paint", cells: base64(1), paint: base64(0x10001), regions: [1, 2, 3], path: "1.2", agreement, differs: base64(1, 2), bare: base64(3) };
const areas = new Float32Array(N).fill(1);
const look = { low: [0, 0, 0], step: [1, 1, 1], axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], view: { azimuth: 0, elevation: 0, zoom: 1, look_at: [0, 0, 0] }, point_size: 1 };
const suggestions = [{ id: 1, class: 1, score: 0.9, n_cells: 1, area: 1 }, { id: 2, class: 0, score: null, n_cells: 1, area: 1 }];
const replies: Record<string, () => BodyInit | object> = {
  files: () => ["1.2", "3.4"].map((name, id) => ({ id, name, done: 0.5, reviewed: true, changed_since_review: id > 0, statistics: state.statistics })),
  mesh: () => packet({ kind: "points", n_cells: N, measure: "area", palette: [[0, 0, 0]], has_normals: false, texture_problem: "", ...look }, { areas, positions: new Float32Array(3 * N) }),
  labels: () => Int32Array.from(areas.keys()).buffer,
  regions: () => packet({}, { arcs: Uint32Array.from({ length: 2 * N - 2 }, (_, i) => (i + 1) >> 1) }),
  suggestions: () => packet({ suggestions }, { owners: Uint32Array.of(1, 0, 0, 0, 2, 0, 0, 0) }),
  theirs: () => paint.buffer,
};

/** Answer a request as the server does. All names are numbers. */
function answer(url: string, { body }: RequestInit): Promise<Response> {
  const name = url.split("?")[0].split("/").pop()!;
  const reply = name === "paint" && body === undefined ? paint.buffer : (replies[name] ?? (() => (name === "state" ? state : effect)))();
  return Promise.resolve(reply instanceof ArrayBuffer ? new Response(reply) : Response.json(reply));
}

/** Whether a text has letters outside brackets. */
function isStranger(shown: string): boolean {
  const rest = shown.replace(/⟦[^⟦⟧]*⟧/g, "");
  return rest === shown ? LETTERS.test(rest) : isStranger(rest);
}

/** Texts in the page, and messages, that a user can read and that are not in brackets. Names of keys are left out. */
function strangers(): string[] {
  const found = [...document.querySelectorAll("*")].flatMap((element) => {
    const isWhole = element.matches("[data-html]"); // a phrase with elements
    const nodes = isWhole ? [element] : element.closest("[data-html]") ? [] : [...element.childNodes].filter(({ nodeType }) => nodeType === Node.TEXT_NODE);
    const own = nodes.map(({ textContent }) => textContent!.trim()).filter((one) => !(element.matches("kbd") && KEY.test(one)));
    return [...own, ...ATTRIBUTES.map((name) => element.getAttribute(name) ?? "")];
  });
  return [document.title, ...said, ...found].filter(isStranger);
}

const settle = (): Promise<void> => new Promise((done) => setTimeout(done, 2));

async function press(key: string, options: KeyboardEventInit = {}): Promise<void> {
  document.querySelector("canvas")!.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...options }));
  await settle();
}

beforeAll(async () => {
  document.documentElement.innerHTML = page;
  vi.stubGlobal("fetch", answer);
  vi.stubGlobal("localStorage", fakeStorage());
  vi.stubGlobal("confirm", (line: string) => said.push(line) > 0);
  await import("../src/studio/main");
  await vi.waitFor(() => expect(window.studio?.ready).toBe(true));
  const { events } = window.studio.workbench.session;
  events.on("message", (line) => said.push(line));
  events.on("error", (line) => said.push(line));
});

test("the page is built from the table of texts", () => {
  expect(document.querySelector("#classes .class")).not.toBeNull();
  expect(document.querySelector("#files button")).not.toBeNull();
  expect(document.querySelector("#suggestions button")).not.toBeNull();
  expect(strangers()).toEqual([]);
});

test("all keys and buttons show only texts of the table", async () => {
  const { workbench } = window.studio;
  const keys = [..."nnfffohmkgwqqtdyjarscbblxvpiu0123456789/?.,+-=xyz", "Enter", "Delete", "ArrowUp", "PageDown", "PageUp", "Home", "Escape"];
  const held = [{}, { shiftKey: true }, { ctrlKey: true }, { altKey: true }];
  for (const cell of [-1, 1]) {
    for (const options of held) {
      for (const key of keys) {
        if (cell >= 0) workbench.hover(cell);
        await press(key, options);
        expect(strangers(), key).toEqual([]);
        for (const dialog of document.querySelectorAll("dialog")) dialog.close();
      }
    }
  }
  for (const button of document.querySelectorAll<HTMLElement>(":is(button, select, input:not([type=file])):enabled")) {
    button.click();
    button.dispatchEvent(new Event("change", { bubbles: true }));
    await settle();
    expect(strangers(), button.outerHTML).toEqual([]);
  }
  expect(new Set(said).size).toBeGreaterThan(50);
}, 60_000);

test("no other source of the studio contains a phrase", () => {
  const sources = import.meta.glob<string>(["../src/studio/**/*.ts", "!../src/studio/text/**", "!**/shaders.ts"], { query: "?raw", import: "default", eager: true });
  expect(Object.keys(sources).length).toBeGreaterThan(30);
  const phrases = Object.entries(sources).flatMap(([path, source]) => {
    const file = ts.createSourceFile(path, source, ts.ScriptTarget.Latest, true);
    const found: string[] = [];
    const visit = (node: ts.Node): void => {
      const isText = ts.isStringLiteralLike(node) || ts.isTemplateHead(node) || ts.isTemplateMiddleOrTemplateTail(node);
      if (isText && PHRASE.test(node.text)) found.push(`${path}: ${node.text}`);
      ts.forEachChild(node, visit);
    };
    visit(file);
    return found;
  });
  expect(phrases).toEqual([]);
});
