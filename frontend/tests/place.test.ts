import { beforeEach, expect, test, vi } from "vitest";
import { Api } from "../src/studio/session/api";
import { PlaceKeeper } from "../src/studio/input/place";
import { Session } from "../src/studio/session/session";
import { Workbench } from "../src/studio/workbench";
import { paintOf } from "../src/studio/data/labeling";
import type { Views } from "../src/studio/panels/views";
import type { Modes } from "../src/studio/input/modes";
import { fakeDrawing, fakeFile, fakeStorage } from "./fake";

vi.mock("../src/studio/view/picker", () => ({ Picker: vi.fn() }));

const HOME = [0, 0, 10, 0, 0, 0];

let session: Session;
let workbench: Workbench;
let modes: { current: string; choose: (name: string) => void; onChoose: (() => void)[] };
let camera: { place: number[] };

/** A new page, as after a reload. The camera and the tool begin anew in each file, as in the studio. */
function openPage(): void {
  vi.stubGlobal("window", { addEventListener: vi.fn() });
  session = new Session(new Api("token"));
  const drawing = fakeDrawing();
  camera = { place: HOME };
  Object.assign(drawing, { camera, hidesBacks: false });
  workbench = new Workbench(session, drawing);
  const choose = (name: string): void => {
    modes.current = name;
    for (const run of modes.onChoose) run();
  };
  modes = { current: "paint", choose, onChoose: [] };
  session.events.on("file", () => {
    workbench.drawing.hidesBacks = false;
    move(HOME);
    choose("paint");
  });
  const views = {
    hideBacks: (on: boolean) => {
      workbench.drawing.hidesBacks = on;
      move(camera.place); // the view is another one
    },
  };
  new PlaceKeeper(workbench, modes as unknown as Modes, views as unknown as Views);
}

function move(place: number[]): void {
  camera.place = place;
  for (const run of workbench.drawing.onView) run();
}

function open(name: string): void {
  const { mesh, regions, paints, state } = fakeFile(8);
  Object.assign(session, { mesh, regions, paints, state: { ...state, work: name } });
  Object.assign(workbench.drawing, { setMesh: vi.fn() });
  session.events.emit("file", mesh);
  session.events.emit("classes", session.state.classes);
}

const place = (): unknown[] => [camera.place, workbench.drawing.hidesBacks, modes.current, workbench.currentPaint];

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setInterval"] });
  vi.stubGlobal("localStorage", fakeStorage());
  openPage();
  open("a.jsonl");
});

test("view, tool, class and object of each file survive a reload and other files", () => {
  workbench.drawing.hidesBacks = true;
  move([1, 2, 3, 4, 5, 6]);
  modes.choose("brush");
  workbench.choose(2, 7);
  open("b.jsonl");
  expect(place()).toEqual([HOME, false, "paint", paintOf(2, 1)]);
  workbench.choose(0);
  open("a.jsonl");
  expect(place()).toEqual([[1, 2, 3, 4, 5, 6], true, "brush", paintOf(2, 7)]);
  openPage();
  open("a.jsonl");
  expect(place()).toEqual([[1, 2, 3, 4, 5, 6], true, "brush", paintOf(2, 7)]);
  open("b.jsonl");
  expect(place()).toEqual([HOME, false, "paint", 0]);
});

test("a class that was deleted in the meantime is not chosen", () => {
  workbench.choose(2, 7);
  openPage();
  session.events.on("file", () => (session.state.classes = session.state.classes.slice(0, 1)));
  open("a.jsonl");
  expect(workbench.currentPaint).toBe(paintOf(1, 1));
});

test("a damaged place is left out", () => {
  const [name] = Object.keys(localStorage).filter((key) => key.includes("place"));
  localStorage.setItem(name, "{");
  openPage();
  open("a.jsonl");
  expect(place()).toEqual([HOME, false, "paint", paintOf(1, 1)]);
});
