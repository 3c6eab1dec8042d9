// Entry point of the studio: creates its parts and connects them.

import "./studio.css";
import { Api } from "./session/api";
import type { Rgb } from "./data/colors";
import { ClipBox } from "./input/clip";
import { Workbench } from "./workbench";
import { Drawing } from "./view/drawing";
import { Keys } from "./input/keys";
import { Modes } from "./input/modes";
import { classOf, objectOf } from "./data/labeling";
import { showNotices } from "./panels/notices";
import { element, onClick } from "../shared/dom";
import type { Place } from "../shared/picking";
import { ClassesPanel } from "./panels/classes";
import { Comparison } from "./panels/comparison";
import { ExchangePanel } from "./panels/exchange";
import { watchFolds } from "./panels/folds";
import { FilesPanel } from "./panels/files";
import { Palette } from "./panels/palette";
import { ParametersPanel } from "./panels/parameters";
import { Suggestions } from "./panels/suggestions";
import { Walk } from "./input/walk";
import { Pointer } from "./input/pointer";
import { PlaceKeeper } from "./input/place";
import { remember, remembered } from "./session/remembered";
import { Session } from "./session/session";
import { Views } from "./panels/views";
import { fillPage } from "./text/index";

declare global {
  interface Window {
    studio: ReturnType<typeof makeHook>;
  }
}

async function start(): Promise<void> {
  fillPage();
  const token = new URLSearchParams(location.search).get("token") ?? "";
  const session = new Session(new Api(token));
  showNotices(session);
  try {
    const drawing = new Drawing(element<HTMLCanvasElement>("canvas"), (line) => session.events.emit("error", line));
    const workbench = new Workbench(session, drawing);
    const modes = new Modes(workbench);
    const files = new FilesPanel(session);
    new Pointer(workbench, modes);
    const views = new Views(workbench);
    new PlaceKeeper(workbench, modes, views);
    const classes = new ClassesPanel(workbench);
    new Keys(workbench, {
      modes, views, palette: new Palette(workbench, (name, isStuff) => classes.add(isStuff, name)), clip: new ClipBox(workbench), comparison: new Comparison(workbench),
      suggestions: new Suggestions(workbench), walk: new Walk(workbench), goToFile: (steps) => files.go(steps),
    });
    new ParametersPanel(session);
    new ExchangePanel(session);
    watchTools(workbench);
    watchFolds();
    welcome();
    window.studio = makeHook(workbench, modes, () => element("loading").hidden === true);
    const isDrawn = new Promise<void>((resolve) => drawing.afterView.push(() => session.regions && drawing.hasSize && resolve()));
    void isDrawn.then(() => (element("welcome-inside").hidden = element("welcome").hidden || !views.isSeenFromBehind));
    await session.loadFiles();
    await files.openFirst();
    element("welcome-name").hidden = session.state.classes[0]?.name !== "class 1";
  } catch (error) {
    session.report(error);
  }
  element("loading").hidden = true;
}

/** Connect the controls that work without the server. */
function watchTools(workbench: Workbench): void {
  const tolerance = element<HTMLInputElement>("tolerance");
  const show = (): void => {
    workbench.tolerance = Number(tolerance.value);
    element("tolerance-text").textContent = tolerance.value;
  };
  tolerance.value = String(workbench.tolerance);
  tolerance.addEventListener("input", show);
  show();
  const parts = element<HTMLInputElement>("parts");
  parts.value = String(workbench.nParts);
  parts.addEventListener("change", () => (workbench.nParts = Math.max(2, Number(parts.value) || 2)));
  const borders = element<HTMLInputElement>("borders");
  borders.addEventListener("change", () => {
    workbench.drawing.hasBorders = borders.checked;
    workbench.drawing.redraw();
  });
}

const WELCOMED = "superfacets welcome";

/** Show an introduction on the first visit. */
function welcome(): void {
  element("welcome").hidden = remembered(WELCOMED) !== null;
  onClick("welcome-close", () => {
    element("welcome").hidden = true;
    element("canvas").focus(); // keys that paint work only while the canvas has the focus
    remember(WELCOMED, "seen");
  });
}

/**
 * Returns the object `window.studio` for tests and benchmarks. Its positions are in CSS pixels, relative
 * to the upper left corner of the canvas.
 */
function makeHook(workbench: Workbench, modes: Modes, isLoaded: () => boolean) {
  const { session, drawing } = workbench;
  const cellAt = (x: number, y: number): number => workbench.picker.cellAt({ x, y });
  return {
    workbench, // used by benchmarks and screenshots
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
    screenOf: (cell: number): Place | null => workbench.picker.placeOf(cell),
    regionAt: (x: number, y: number): number => workbench.regionOf(cellAt(x, y)),
    pixelAt: (x: number, y: number): Rgb => {
      drawing.draw(2);
      return drawing.pixel(x, y);
    },
    cursor: (): number => workbench.cursor,
    cellCursor: (): number => modes.cellCursor.cell,
  };
}

void start();
