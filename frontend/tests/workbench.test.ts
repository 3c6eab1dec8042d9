import { afterEach, beforeEach, expect, type Mock, test, vi } from "vitest";
import { Api } from "../src/studio/session/api";
import { Saver } from "../src/studio/session/saver";
import { Session } from "../src/studio/session/session";
import type { Drawing } from "../src/studio/view/drawing";
import { Workbench } from "../src/studio/workbench";
import { paintOf } from "../src/studio/data/labeling";
import { RegionBrush } from "../src/studio/input/tools";
import { FakeServer, fakeDrawing, fakeFile } from "./fake";

let server: FakeServer;
let session: Session;
let workbench: Workbench;
let said: string[];

/** Open a file of the fake server without its geometry. */
function open(fileId: number): void {
  const saver = new Saver(new Api("token"), `/api/files/${fileId}`, `file ${fileId}`, { saved: vi.fn(), refused: vi.fn(), gone: vi.fn() });
  Object.assign(session, { fileId, saver, ...fakeFile(server.nCells) });
  session.events.emit("regions", session.regions);
  session.events.emit("classes", session.state.classes);
}

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setInterval"] });
  server = new FakeServer();
  session = new Session(new Api("token"));
  workbench = new Workbench(session, fakeDrawing());
  said = [];
  session.events.on("message", (line) => said.push(line));
  session.events.on("error", (line) => said.push(line));
  open(0);
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

/** Let the view come to rest; afterwards, return the numbers of parts that the drawing got, in order. */
async function rest(nRequests: number): Promise<number[]> {
  const { afterView, setParts } = vi.mocked(workbench.drawing) as { afterView: (() => void)[]; setParts: Mock<Drawing["setParts"]> };
  for (const run of afterView) run();
  await vi.waitFor(() => expect(setParts).toHaveBeenCalledTimes(nRequests));
  return setParts.mock.calls.map(([{ shown }]) => shown?.length ?? 0);
}

test("at rest, smooth borders are requested once for the current regions", async () => {
  Object.assign(workbench.drawing, { isEmpty: false });
  vi.stubGlobal("document", { hidden: false, getElementById: () => ({ textContent: "" }) });
  expect(await rest(1)).toEqual([1]);
  expect(await rest(1)).toEqual([1]);
  session.regions = fakeFile(server.nCells).regions;
  expect(await rest(2)).toEqual([1, 1]);
  expect(server.sent("borders")).toHaveLength(2);
});

test("whole faces are drawn if the server cannot compute smooth borders", async () => {
  Object.assign(workbench.drawing, { isEmpty: false });
  vi.stubGlobal("document", { hidden: false, getElementById: () => ({ textContent: "" }) });
  server.mode = { status: 410 };
  expect(await rest(1)).toEqual([0]);
});

test("smooth borders of a file that is no longer open are dropped", async () => {
  Object.assign(workbench.drawing, { isEmpty: false });
  vi.stubGlobal("document", { hidden: false, getElementById: () => ({ textContent: "" }) });
  server.mode = "wait";
  for (const run of workbench.drawing.afterView) run();
  await vi.waitFor(() => expect(server.sent("borders")).toHaveLength(1));
  open(1);
  server.answer();
  expect(await rest(1)).toEqual([1]);
  expect(server.sent("borders").map(({ path }) => path)).toEqual(["/files/0/borders", "/files/1/borders"]);
});

/** Press F on region 0 while the server waits; run `meanwhile`, and then let the server answer. */
async function fill(meanwhile: () => void): Promise<void> {
  workbench.choose(1);
  workbench.cursor = 0;
  server.mode = "wait";
  const filled = workbench.fillSimilar();
  await vi.waitFor(() => expect(server.sent("similar")).toHaveLength(1));
  meanwhile();
  server.answer();
  await filled;
}

const ONE = paintOf(1, 1);

test("similar regions get the class that was chosen when F was pressed", async () => {
  await fill(() => workbench.choose(2));
  expect([...session.paints.of]).toEqual([ONE, ONE, ONE, ONE, 0, 0, 0, 0]);
});

test("a lock that is set after F was pressed does not change what F paints", async () => {
  session.paints.set(0, paintOf(2, 1));
  await fill(() => (session.isLocked = true));
  expect(session.paints.of[0]).toBe(ONE);
});

test("a class painted after F was pressed stays", async () => {
  await fill(() => session.paint(Uint32Array.of(2), paintOf(2, 1)));
  expect([...session.paints.of.slice(0, 4)]).toEqual([ONE, ONE, paintOf(2, 1), 0]);
});

test.each([
  ["the region was painted", () => session.paint(Uint32Array.of(0), paintOf(2, 1))],
  ["the regions changed", () => (session.regions = fakeFile(server.nCells).regions)],
  ["another file was opened", () => open(1)],
])("F paints nothing if %s before the server answered", async (_, meanwhile) => {
  await fill(() => void meanwhile());
  expect(said.pop()).toContain("nothing was painted");
  expect([...session.paints.of]).not.toContain(ONE);
});

test("a step of a file is dropped with a note if another file is opened before its turn", async () => {
  server.mode = "wait";
  session.paint(Uint32Array.of(1), 1); // the step waits for this stroke
  const undone = session.undo();
  open(1);
  server.answer();
  await undone;
  expect(server.sent("undo")).toEqual([]);
  expect(said.join()).toContain("Another file was opened");
});

test("an undo that the server does not answer is told, and no stroke is lost", async () => {
  server.mode = "fails";
  session.paint(Uint32Array.of(1), 1);
  await session.undo();
  expect(session.online).toBe(false);
  expect(said.pop()).toContain("undo has to wait");
  expect(session.nWaiting).toBe(1);
});

test("no class stays chosen when the list of classes is loaded again", () => {
  workbench.choose(0);
  session.events.emit("classes", session.state.classes);
  expect(workbench.currentPaint).toBe(0);
});

test("a new object takes the lowest number that no cell and no name has", () => {
  const objects = (): number => {
    workbench.newObject();
    return workbench.currentPaint >>> 16;
  };
  [1, 2, 3, 5].forEach((object, cell) => session.paints.set(cell, paintOf(1, object)));
  expect(objects()).toBe(4);
  session.paints.set(1, 0); // object 2 is deleted
  expect(objects()).toBe(2);
  session.state.object_names = [{ class: 1, object: 2, name: "throne" }];
  expect(objects()).toBe(4);
});

test("a late message of another file names that file", async () => {
  session.files = ["a.ply", "b.ply"].map((name, id) => ({ id, name, done: 0 }));
  server.mode = "wait";
  const exported = session.exportTo("npy", "cells");
  await vi.waitFor(() => expect(server.sent("export")).toHaveLength(1));
  open(1);
  server.answer();
  await exported;
  expect(said).toEqual(["a.ply: Written: undefined"]);
  session.tell("Written: /x/b.ply", 1);
  session.report(new Error("/x/a.ply is damaged"), 0);
  expect(said.slice(1)).toEqual(["Written: /x/b.ply", "/x/a.ply is damaged"]);
});

/** Camera poses whose pictures show `counts` pixels of any target. */
function fakeViews(counts: number[]): { flyTo: ReturnType<typeof vi.fn>; setFocus: ReturnType<typeof vi.fn> } {
  const poses = counts.map((_, k) => ({ azimuth: k }));
  const camera = { size: 1, zoom: 1, distance: 9, distanceFor: () => 1, posesAround: () => poses, flyTo: vi.fn() };
  const setFocus = vi.fn();
  Object.assign(workbench.drawing, { camera, setFocus, countSeen: () => counts });
  return { flyTo: camera.flyTo, setFocus };
}

test("the camera flies to the side from which most of a region is seen", () => {
  const { flyTo, setFocus } = fakeViews([3, 90, 70]);
  workbench.fly(Uint32Array.of(2, 3));
  expect(flyTo).toHaveBeenCalledWith({ azimuth: 1 });
  expect(setFocus.mock.lastCall?.[1]).toBeNull();
});

test("what hides a region from all sides is left out", () => {
  const { flyTo, setFocus } = fakeViews([0, 2]);
  workbench.fly(Uint32Array.of(2, 3));
  expect(flyTo).toHaveBeenCalledWith({ azimuth: 0 });
  expect(setFocus.mock.lastCall?.[0]).toEqual(Uint32Array.of(2, 3));
  expect(setFocus.mock.lastCall?.[1]).toMatchObject({ middle: [0, 0, 0] });
});

test("everything labeled can be hidden, and everything else blinks", () => {
  const [blink, mark, unmarkAll] = [vi.fn(), vi.fn(), vi.fn()];
  Object.assign(workbench.drawing.cells, { mark, unmarkAll, isHidden: (cell: number) => cell === 4 });
  Object.assign(workbench.drawing, { blink, changeView: vi.fn() });
  workbench.hideLabeled();
  expect(said.pop()).toContain("No cell has a class");
  session.paint(Uint32Array.of(1, 4), ONE);
  workbench.hideLabeled();
  expect(unmarkAll).toHaveBeenCalledWith(4);
  expect(mark).toHaveBeenCalledWith(Uint32Array.of(1, 4), 4, true);
  session.paint(Uint32Array.of(1, 4), 0);
  expect(mark).toHaveBeenLastCalledWith(Uint32Array.of(4), 4, false); // what is unlabeled again is shown
  session.paint(Uint32Array.of(1, 4), ONE);
  workbench.blinkBare();
  expect(blink).toHaveBeenCalledOnce();
  expect(said.pop()).toContain("6 points");
  session.paint(Uint32Array.from({ length: 8 }, (_, i) => i), ONE);
  workbench.blinkBare();
  expect(said.pop()).toContain("Every cell");
  expect(blink).toHaveBeenCalledOnce();
});

test("a stroke that would replace a label is announced, unless labels are protected", () => {
  session.paint(Uint32Array.of(3), paintOf(2, 1));
  workbench.choose(1);
  expect(workbench.harmAt(3)).toContain("K protects");
  expect([workbench.harmAt(2), workbench.harmAt(3, paintOf(2, 1)), workbench.harmAt(-1)]).toEqual(["", "", ""]);
  session.isLocked = true;
  expect(workbench.harmAt(3)).toBe("");
});

test("the next unlabeled region is the nearest one in view; those chosen before come last", () => {
  vi.spyOn(session.mesh, "middleOf").mockImplementation((cell) => [cell, 0, 0]);
  vi.spyOn(workbench, "setCursor").mockImplementation((region) => (workbench.cursor = region));
  Object.assign(workbench, { picker: { cellsSeen: () => ({ cells: Uint32Array.of(1, 2, 7, 6) }) } });
  Object.assign(workbench.drawing, { camera: { target: [5, 0, 0] } });
  const chosen = (n: number): number[] => Array.from({ length: n }, () => (workbench.showNextBare(), workbench.cursor));
  expect(chosen(4)).toEqual([6, 7, 2, 1]); // in view
  session.paint(Uint32Array.of(4), ONE);
  expect(chosen(3)).toEqual([5, 3, 0]);
  expect(chosen(2)).toEqual([6, 7]);
  workbench.cursor = -1;
  expect(chosen(1)).toEqual([6]);
});

test("each press goes to another unlabeled region, also in the next rounds, as long as there is another", () => {
  const camera = { target: [5, 0, 0] };
  vi.spyOn(session.mesh, "middleOf").mockImplementation((cell) => [cell, 0, 0]);
  vi.spyOn(workbench, "setCursor").mockImplementation((region) => {
    workbench.cursor = region;
    camera.target = [region, 0, 0];
  });
  Object.assign(workbench, { picker: { cellsSeen: () => ({ cells: session.regions.labels }) } });
  Object.assign(workbench.drawing, { camera });
  const press = (): number => (workbench.showNextBare(), workbench.cursor);
  const chosen = Array.from({ length: 29 }, press);
  expect(new Set(chosen.slice(0, 8)).size).toBe(8);
  chosen.slice(1).forEach((region, i) => expect(region).not.toBe(chosen[i]));
  workbench.cursor = 3; // by N, or by a click
  expect(press()).not.toBe(3);
  session.paint(Uint32Array.of(0, 1, 2, 3, 4, 6, 7), ONE);
  expect([press(), press()]).toEqual([5, 5]);
});

/** Hide cells; the result counts the cells that are looked up. */
function hide(...cells: number[]): ReturnType<typeof vi.fn> {
  const isHidden = vi.fn((cell: number) => cells.includes(cell));
  Object.assign(workbench.drawing.cells, { isHidden });
  Object.assign(workbench.drawing, { isCut: () => false });
  return isHidden;
}

test("N and P go to the regions that are shown, look no farther, and say so if there is none", () => {
  vi.spyOn(workbench, "setCursor").mockImplementation((region) => (workbench.cursor = region));
  const isHidden = hide(1, 2, 6);
  const moved = (...steps: (1 | -1)[]): number[] => steps.map((step) => (workbench.moveCursor(step), workbench.cursor));
  workbench.cursor = 0;
  expect(moved(1)).toEqual([3]);
  expect(isHidden).toHaveBeenCalledTimes(3);
  expect(moved(1, 1, 1, 1, -1, -1, -1, -1, -1)).toEqual([4, 5, 7, 0, 7, 5, 4, 3, 0]);
  workbench.cursor = 2; // it was hidden after it was chosen
  expect(moved(-1)).toEqual([0]);
  hide(0, 1, 2, 3, 4, 5, 6, 7);
  expect(moved(1, -1)).toEqual([0, 0]);
  expect(said).toEqual(Array(2).fill(expect.stringContaining("All regions are hidden")));
  hide(0, 1, 2, 4, 5, 6, 7);
  workbench.cursor = 3;
  expect(moved(1, -1)).toEqual([3, 3]);
});

test("G frames the chosen region, or all that is shown if this region is hidden; an object shown alone is framed", () => {
  const fly = vi.spyOn(workbench, "fly").mockReturnValue(true);
  workbench.cursor = 2;
  hide(3);
  workbench.frameActive();
  expect(fly).toHaveBeenLastCalledWith(Uint32Array.of(2), true);
  hide(2, 3);
  workbench.frameActive();
  expect(fly).toHaveBeenLastCalledWith(Uint32Array.of(0, 1, 4, 5, 6, 7), true);
  Object.assign(workbench.drawing, { changeView: vi.fn() });
  Object.assign(workbench.drawing.cells, { mark: vi.fn() });
  session.paint(Uint32Array.of(4, 6), ONE);
  workbench.isolatePaint(ONE);
  expect(fly).toHaveBeenLastCalledWith(Uint32Array.of(4, 6), true);
  expect(said.pop()).toContain("Only class 1 #1 is shown");
});

test("a click on a region that has this class already says so", () => {
  Object.assign(workbench, { picker: { cellAt: () => 2 } });
  const brush = new RegionBrush(workbench);
  const click = (withShift = false): string => {
    brush.begin({ x: 0, y: 0 }, withShift);
    brush.end();
    return said.pop()!;
  };
  workbench.choose(1);
  expect(click()).toBe("Region 2: class 1 #1.");
  expect(click()).toBe("Region 2: already class 1 #1, so nothing changed.");
  session.isLocked = true;
  expect(click()).toContain("already");
  workbench.choose(2);
  expect(click()).toContain("nothing was painted");
  expect(click(true)).toContain("class removed");
  expect(click()).toBe("Region 2: class 2 #1.");
});

test("a download starts when all strokes are saved, and is out of date after the next stroke", async () => {
  const start = vi.fn(() => expect(session.nWaiting).toBe(0));
  server.mode = "wait";
  session.paint(Uint32Array.of(1), ONE);
  const done = session.download(start);
  session.paint(Uint32Array.of(2), ONE); // before the strokes are saved
  expect(session.isExportOld).toBe(false); // nothing was exported
  server.answer();
  expect(await done).toBe(true);
  expect(start).toHaveBeenCalledOnce();
  expect([...server.paint[0].slice(0, 3)]).toEqual([0, 1, 1]);
  expect(session.isExportOld).toBe(false);
  session.paint(Uint32Array.of(2), 0);
  expect(session.isExportOld).toBe(true);
  session.paint(Uint32Array.of(2), ONE);
  expect(session.isExportOld).toBe(false);
});

test("a download without a server does not start, and notes nothing", async () => {
  const start = vi.fn();
  server.mode = "fails";
  session.paint(Uint32Array.of(1), ONE);
  expect(await session.download(start)).toBe(false);
  expect(start).not.toHaveBeenCalled();
  session.paint(Uint32Array.of(2), ONE);
  expect(session.isExportOld).toBe(false);
});

test("classes chosen last come first, then classes of labeled cells, and then the others", () => {
  const others = [3, 4, 5, 6].map((id) => ({ id, name: `class ${id}`, color: "#102030", key: "" }));
  session.state.classes.push(...others);
  for (const id of [6, 2, 6, 1]) workbench.choose(id);
  session.paint(Uint32Array.of(0), paintOf(5, 1));
  session.paint(Uint32Array.of(1, 2), paintOf(2, 1));
  expect(workbench.classesByUse.map(({ id }) => id)).toEqual([1, 6, 2, 5, 3, 4]);
});

test("a double click goes half the way to a cell, and turns the view around it", () => {
  const fly = vi.fn();
  Object.assign(workbench.drawing, { camera: { size: 1, closeness: 1, distanceTo: () => 4, fly } });
  workbench.approach(2);
  expect(fly).toHaveBeenCalledWith([0, 0, 0], [0, 0, 0], 2);
});
