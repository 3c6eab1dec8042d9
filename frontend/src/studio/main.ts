// Entry point of the studio: creates its parts and connects them.

import "./studio.css";
import { Api } from "./api";
import type { Rgb } from "./colors";
import { ClipBox } from "./clip";
import { Desk } from "./desk";
import { Drawing } from "./drawing";
import { Keys } from "./keys";
import { Modes } from "./modes";
import { classOf, objectOf } from "./labeling";
import { showNotices } from "./notices";
import { onClick, part } from "../shared/dom";
import type { Place } from "../shared/picking";
import { ClassesPanel } from "./panels/classes";
import { Comparison } from "./panels/comparison";
import { ExchangePanel } from "./panels/exchange";
import { FilesPanel } from "./panels/files";
import { ParametersPanel } from "./panels/parameters";
import { Suggestions } from "./panels/suggestions";
import { Pointer } from "./pointer";
import { remember, remembered } from "./remembered";
import { Session } from "./session";
import { Views } from "./views";

declare global {
  interface Window {
    studio: ReturnType<typeof makeHook>;
  }
}

async function start(): Promise<void> {
  const token = new URLSearchParams(location.search).get("token") ?? "";
  const session = new Session(new Api(token));
  showNotices(session);
  try {
    const drawing = new Drawing(part<HTMLCanvasElement>("canvas"), (line) => session.events.emit("error", line));
    const desk = new Desk(session, drawing);
    const modes = new Modes(desk);
    const files = new FilesPanel(session);
    new Pointer(desk, modes);
    const views = new Views(desk);
    new Keys(desk, {
      modes, views, clip: new ClipBox(desk), comparison: new Comparison(desk),
      suggestions: new Suggestions(desk), goToFile: (steps) => files.go(steps),
    });
    new ClassesPanel(desk);
    new ParametersPanel(session);
    new ExchangePanel(session);
    watchTools(desk);
    welcome();
    window.studio = makeHook(desk, modes, () => part("loading").hidden === true);
    await session.loadFiles();
    await files.openFirst();
    part("welcome-name").hidden = session.state.classes[0]?.name !== "class 1";
    part("welcome-inside").hidden = !views.isSeenFromBehind;
  } catch (error) {
    session.report(error);
  }
  part("loading").hidden = true;
}

/** Connect the controls that work without the server. */
function watchTools(desk: Desk): void {
  const tolerance = part<HTMLInputElement>("tolerance");
  const show = (): void => {
    desk.tolerance = Number(tolerance.value);
    part("tolerance-text").textContent = tolerance.value;
  };
  tolerance.value = String(desk.tolerance);
  tolerance.addEventListener("input", show);
  show();
  const borders = part<HTMLInputElement>("borders");
  borders.addEventListener("change", () => desk.drawing.setBorders(borders.checked));
}

const WELCOMED = "superfacets welcome";

/** Show an introduction on the first visit. */
function welcome(): void {
  part("welcome").hidden = remembered(WELCOMED) !== null;
  onClick("welcome-close", () => {
    part("welcome").hidden = true;
    part("canvas").focus(); // keys that paint work only while the canvas has the focus
    remember(WELCOMED, "seen");
  });
}

/**
 * Returns the object `window.studio` for tests and benchmarks. Its positions are in CSS pixels, relative
 * to the upper left corner of the canvas.
 */
function makeHook(desk: Desk, modes: Modes, isLoaded: () => boolean) {
  const { session, drawing } = desk;
  const cellAt = (x: number, y: number): number => desk.picker.cellAt({ x, y });
  return {
    desk, // used by benchmarks and screenshots
    cellAt,
    get ready(): boolean {
      return isLoaded() && session.paints !== undefined;
    },
    /** Whether the page shows the current state of the server. */
    get isIdle(): boolean {
      return session.online && session.isIdle;
    },
    get nRegions(): number {
      return session.regions.count;
    },
    get nWaiting(): number {
      return session.nWaiting;
    },
    labels: (): number[] => [...session.regions.labels],
    classOf: (cell: number): number => classOf(session.paints.of[cell]),
    objectOf: (cell: number): number => objectOf(session.paints.of[cell]),
    screenOf: (cell: number): Place | null => desk.picker.placeOf(cell),
    regionAt: (x: number, y: number): number => desk.regionOf(cellAt(x, y)),
    pixelAt: (x: number, y: number): Rgb => {
      drawing.draw(2);
      return drawing.pixel(x, y);
    },
    cursor: (): number => desk.cursor,
    cellCursor: (): number => modes.cellCursor.cell,
  };
}

void start();
