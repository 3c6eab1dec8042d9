// @vitest-environment happy-dom

import { beforeEach, expect, test, vi } from "vitest";
import page from "../index.html?raw";
import { Keys } from "../src/studio/input/keys";
import type { Modes } from "../src/studio/input/modes";
import { Pointer } from "../src/studio/input/pointer";
import { Views } from "../src/studio/panels/views";
import { Session } from "../src/studio/session/session";
import { Api } from "../src/studio/session/api";
import { Workbench } from "../src/studio/workbench";
import { fakeDrawing, fakeFile, fakeStorage } from "./fake";

const camera = { orbit: vi.fn(), zoomBy: vi.fn(), isWide: false };
let canvas: HTMLCanvasElement;
let workbench: Workbench;
let parts: Record<string, unknown>;

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setInterval"] });
  vi.clearAllMocks();
  vi.stubGlobal("localStorage", fakeStorage());
  vi.stubGlobal("requestAnimationFrame", (run: () => void) => queueMicrotask(run));
  document.body.innerHTML = /<body>(.*)<\/body>/s.exec(page)![1];
  canvas = document.querySelector("canvas")!;
  canvas.setPointerCapture = vi.fn();
  const session = new Session(new Api("token"));
  workbench = new Workbench(session, Object.assign(fakeDrawing(canvas), { camera }));
  Object.assign(session, { fileId: 0, ...fakeFile(8) });
  Object.assign(workbench, { picker: { cellAt: () => 3 } });
  const modes = { tool: { resize: vi.fn(), turnsBeside: false } } as unknown as Modes;
  new Pointer(workbench, modes);
  parts = { modes, views: new Views(workbench), clip: {}, comparison: {}, palette: {}, suggestions: {}, walk: { press: () => false }, goToFile: vi.fn() };
  new Keys(workbench, parts as never);
});

/** Press a key; returns whether the page has handled it. */
function press(code: string, key: string, held: KeyboardEventInit = {}): boolean {
  return !canvas.dispatchEvent(new KeyboardEvent("keydown", { code, key, bubbles: true, cancelable: true, ...held }));
}

test("with keys as in Blender, the number pad turns, zooms and shows an object alone, but leaves keys with Ctrl, Meta or Alt to the browser", () => {
  const isolate = vi.spyOn(workbench, "isolatePaint").mockReturnValue();
  document.querySelector<HTMLSelectElement>("#scheme")!.value = "blender";
  const presses = (held?: KeyboardEventInit): boolean[] => [press("NumpadAdd", "+", held), press("NumpadSubtract", "-", held), press("Numpad9", "9", held), press("NumpadDivide", "/", held)];
  for (const held of [{ ctrlKey: true }, { metaKey: true }, { altKey: true }]) expect(presses(held)).toEqual([false, false, false, false]);
  expect([camera.zoomBy, camera.orbit, isolate].map((one) => one.mock.calls.length)).toEqual([0, 0, 0]);
  expect(presses()).toEqual([true, true, true, true]);
  expect(camera.zoomBy.mock.calls).toEqual([[1.25], [0.8]]);
  expect(camera.orbit).toHaveBeenCalledWith(Math.PI, 0);
  expect(isolate).toHaveBeenCalledOnce();
});

test("no two commands have the same key", () => {
  const views = { keys: () => [{ names: ["Alt+9", "f"], what: "", run: vi.fn() }] };
  expect(() => new Keys(workbench, { ...parts, views } as never)).toThrow("two commands have the key f");
});

test("F1 opens the help", () => {
  expect(press("F1", "F1")).toBe(true);
  expect(document.querySelector<HTMLDialogElement>("#help")!.open).toBe(true);
});

test("keys act on the cell under a resting pointer after a jump of the view, unless a region was chosen by a key", async () => {
  const jump = (): void => [...workbench.drawing.onView, ...workbench.drawing.afterView].forEach((run) => run());
  Object.assign(workbench.drawing, { isEmpty: false });
  const hide = vi.spyOn(workbench as unknown as { hide: () => void }, "hide").mockReturnValue();
  jump();
  expect(workbench.hoveredCell).toBe(-1); // the pointer was never over the mesh
  canvas.dispatchEvent(new PointerEvent("pointermove", { pointerType: "mouse" }));
  await Promise.resolve();
  expect(workbench.hoveredCell).toBe(3);
  jump();
  expect(workbench.hoveredCell).toBe(3);
  press("KeyH", "h");
  expect(hide).toHaveBeenCalledWith(Uint32Array.of(3), expect.stringContaining("Region 3 is hidden"));
  workbench.cursor = 5;
  jump();
  expect(workbench.hoveredCell).toBe(-1);
  workbench.cursor = -1;
  canvas.dispatchEvent(new PointerEvent("pointerleave"));
  jump();
  expect(workbench.hoveredCell).toBe(-1);
});
