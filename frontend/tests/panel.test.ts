// @vitest-environment happy-dom

import { beforeEach, expect, test, vi } from "vitest";
import page from "../index.html?raw";
import { ClassesPanel } from "../src/studio/panels/classes";
import { ExchangePanel } from "../src/studio/panels/exchange";
import { FilesPanel } from "../src/studio/panels/files";
import { watchFolds } from "../src/studio/panels/folds";
import { Palette } from "../src/studio/panels/palette";
import { Api, ServerError } from "../src/studio/session/api";
import { Session } from "../src/studio/session/session";
import { Workbench } from "../src/studio/workbench";
import type { ClassEntry } from "../src/studio/data/contract";
import type { ClassDraft } from "../src/studio/session/session";
import { fakeDrawing, fakeFile, fakeStorage } from "./fake";

const NAMES = ["wall", "floor", "cabinet", "bed", "chair", "sofa", "table", "door", "window", "bookshelf", "desk", "desk lamp"];

let session: Session;
let workbench: Workbench;
let palette: Palette;

/** A session whose server takes each list of classes. */
beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setInterval"] });
  vi.stubGlobal("localStorage", fakeStorage());
  document.body.innerHTML = /<body>(.*)<\/body>/s.exec(page)![1];
  session = new Session(new Api("token"));
  vi.spyOn(session, "setClasses").mockImplementation((edit) => {
    const list = edit(session.state.classes) as (ClassDraft & ClassEntry)[];
    session.state.classes = list.map((entry) => ({ ...entry, color: entry.color ?? "#102030" }));
    session.events.emit("classes", session.state.classes);
    return Promise.resolve();
  });
  workbench = new Workbench(session, fakeDrawing(document.querySelector("canvas")!));
  const panel = new ClassesPanel(workbench);
  palette = new Palette(workbench, (name, isStuff) => panel.add(isStuff, name));
  Object.assign(session, { fileId: 0, ...fakeFile(8) });
  session.state.classes = NAMES.map((name, i) => ({ id: i + 1, name, color: "#102030", key: "" }));
  session.events.emit("regions", session.regions);
  session.events.emit("classes", session.state.classes);
});

const key = (target: Element, name: string): boolean => target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
const dialog = (): HTMLDialogElement => document.querySelector("#palette")!;
const options = (): string[] => [...document.querySelectorAll("#palette-list span")].map((one) => one.textContent);
const keyBox = (id: number): HTMLButtonElement => document.querySelector(`[name=class][value="${id}"]`)!.closest(".class")!.querySelector(".key")!;

function type(text: string): HTMLInputElement {
  palette.open();
  const field = document.querySelector<HTMLInputElement>("#palette-text")!;
  field.value = text;
  field.dispatchEvent(new Event("input"));
  return field;
}

test("the palette finds a class by typing; arrows move, and Enter chooses", () => {
  const field = type("des");
  expect(options().slice(0, 2)).toEqual(["desk", "desk lamp"]);
  key(field, "ArrowDown");
  expect(document.querySelector("[aria-selected=true] span")!.textContent).toBe("desk lamp");
  key(field, "Enter");
  expect(workbench.currentPaint & 0xffff).toBe(12);
  expect(dialog().open).toBe(false);
  expect(keyBox(12).textContent).toBe("9"); // instead of the window, which was not used
  expect(keyBox(9).textContent.trim()).toBe("");
});

test("the palette makes a class with or without separate objects from an unknown name, and from no known name", async () => {
  expect(type("Desk") && options()).toEqual(["desk", "desk lamp"]);
  dialog().close();
  const field = type("ceiling");
  expect(options()).toEqual(["New class “ceiling”", expect.stringContaining("stuff")]);
  key(field, "ArrowUp"); // the last one
  key(field, "Enter");
  await vi.waitFor(() => expect(workbench.currentPaint).toBe(13));
  expect(session.state.classes[12]).toMatchObject({ name: "ceiling", stuff: true });
});

test("a class is stuff from the start with its own button", async () => {
  document.querySelector<HTMLElement>("#add-stuff")!.click();
  await vi.waitFor(() => expect(session.state.classes).toHaveLength(13));
  expect(session.state.classes[12].stuff).toBe(true);
});

test("a click on the box of a class assigns the next key, which then stays", () => {
  keyBox(12).click();
  key(keyBox(12), "3");
  expect(session.state.classes.map((entry) => entry.key).join("")).toBe("3");
  expect(keyBox(12).textContent).toBe("3");
  expect(keyBox(12).classList.contains("assigned")).toBe(true);
  for (const { id } of session.state.classes) workbench.choose(id);
  expect(workbench.classKeys.classOf("3")).toBe(12);
  keyBox(12).click();
  key(keyBox(12), "Escape");
  expect(keyBox(12).textContent).toBe("3");
  keyBox(12).click();
  key(keyBox(12), "Delete");
  expect(session.state.classes[11].key).toBe("");
});

test("tips say the number of a class, which may differ from its key", () => {
  keyBox(5).click();
  key(keyBox(5), "4");
  expect(keyBox(5).title).toContain("Key 4 of chair (class number 5)");
  const name = keyBox(5).closest(".class")!.querySelector<HTMLInputElement>("[type=text]")!;
  expect([name.title, name.getAttribute("aria-label")]).toEqual(["Name of chair (class number 5): click to change it", "Name of chair"]);
});

test("keys of the box choose no class, and other keys are not taken", () => {
  const pressed = vi.fn();
  window.addEventListener("keydown", pressed);
  keyBox(5).click();
  key(keyBox(5), "7");
  expect(pressed).not.toHaveBeenCalled();
  key(keyBox(5), "7");
  expect(pressed).toHaveBeenCalledOnce();
});

test("sections stay folded or open, and all are open in a high window", () => {
  const opened = (): boolean[] => [...document.querySelectorAll("details")].map((one) => one.open);
  vi.stubGlobal("innerHeight", 700);
  watchFolds();
  expect(opened()).toEqual([false, true, false, false]); // files, regions, import, export
  document.querySelector<HTMLElement>("#export-fold summary")!.click();
  document.querySelectorAll("details").forEach((one) => (one.open = false));
  watchFolds();
  expect(opened()).toEqual([false, false, false, true]);
  vi.stubGlobal("localStorage", fakeStorage());
  vi.stubGlobal("innerHeight", 1000);
  watchFolds();
  expect(opened()).toEqual([true, true, true, true]);
});

test("the list scrolls to a newly chosen class and object, and to nothing when cells are painted", () => {
  const scroll = vi.spyOn(Element.prototype, "scrollIntoView").mockImplementation(() => undefined);
  workbench.choose(12, 3);
  expect(scroll.mock.contexts.map((one) => (one as Element).className)).toEqual(["class", "object"]);
  session.events.emit("painted", new Uint32Array(1));
  expect(scroll).toHaveBeenCalledTimes(2);
});

test("exports are compared with the labels when the labels have not changed for a while, and not in each step", () => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout"] });
  const isOld = vi.spyOn(session, "isExportOld", "get").mockReturnValue(true);
  const mark = document.querySelector<HTMLElement>("#export-old")!;
  Object.assign(workbench.drawing, { setMesh: vi.fn() });
  new ExchangePanel(session);
  for (let i = 0; i < 9; i++) {
    session.events.emit("state", session.state);
    vi.advanceTimersByTime(99);
  }
  expect(isOld).not.toHaveBeenCalled();
  vi.advanceTimersByTime(999);
  expect(isOld).toHaveBeenCalledOnce();
  expect(mark.hidden).toBe(false);
  session.events.emit("file", session.mesh); // whose exports are not compared yet
  expect(mark.hidden).toBe(true);
  vi.useRealTimers();
});

test("a click on the link downloads after the strokes are saved, with the address of that time", async () => {
  new ExchangePanel(session);
  const clicked: string[] = [];
  vi.spyOn(HTMLAnchorElement.prototype, "click").mockImplementation(function (this: HTMLAnchorElement) { clicked.push(this.href); });
  const download = vi.spyOn(session, "download").mockResolvedValue(true);
  const told: string[] = [];
  session.events.on("message", (line) => told.push(line));
  const event = new MouseEvent("click", { cancelable: true });
  const link = document.querySelector<HTMLAnchorElement>("#download")!;
  link.href = "http://localhost/a.npy";
  link.dispatchEvent(event);
  expect(event.defaultPrevented).toBe(true);
  await vi.waitFor(() => expect(told).toEqual(["Downloaded: "]));
  expect(clicked).toEqual([]);
  link.href = "http://localhost/b.npy";
  download.mock.lastCall![0]();
  expect(clicked).toEqual(["http://localhost/a.npy"]);
});

test("the file of the last step is opened first, and the first file if there is none", async () => {
  const panel = new FilesPanel(session);
  const open = vi.spyOn(session, "open").mockResolvedValue();
  for (const times of [[0, 5, 7, 6], [0, 0]]) {
    session.files = times.map((time, id) => ({ id, name: "a", done: 0, ...(time && { time }) }));
    await panel.openFirst();
  }
  open.mockRejectedValueOnce(new ServerError("damaged", 400)).mockResolvedValue();
  session.files = [3, 4, 5].map((time, id) => ({ id, name: "a", done: 0, time }));
  await panel.openFirst();
  expect(open.mock.calls.map(([id]) => id)).toEqual([2, 0, 2, 1]);
});

test("active time and strokes are shown, and nothing if they are unknown", () => {
  new FilesPanel(session);
  const entries = [{}, { statistics: { seconds: 59.9, strokes: 1 } }].map((took, id) => ({ id, name: "a", done: 0.5, ...took }));
  session.events.emit("files", entries);
  const titles = (): string[] => [...document.querySelectorAll<HTMLElement>("#files progress")].map(({ title }) => title);
  expect(titles()).toEqual(["50 %", "50 %, < 1 min, 1 stroke"]);
  const effort = document.querySelector("#effort")!;
  expect(effort.textContent).toBe("");
  session.state.statistics = { seconds: 730, strokes: 43 };
  session.events.emit("state", session.state);
  expect([effort.textContent, titles()[0]]).toEqual(["12 min, 43 strokes", "0.0 %, 12 min, 43 strokes"]);
});
