// `window.studio`, for tests and measurements.

import type { Rgb } from "./colors";
import type { Desk } from "./desk";
import type { Modes } from "./modes";
import type { Place } from "../shared/picking";

export interface Hook {
  readonly ready: boolean;
  readonly nRegions: number;
  readonly nWaiting: number;
  readonly isIdle: boolean; // the page shows the state of the server
  labels(): number[];
  classOf(cell: number): number;
  screenOf(cell: number): Place | null;
  cellAt(x: number, y: number): number;
  regionAt(x: number, y: number): number;
  pixelAt(x: number, y: number): Rgb;
  cursor(): number;
  cellCursor(): number;
  readonly desk: Desk; // for measurements and pictures
}

/** Places are in pixels of the page, from the canvas's upper left corner. */
export function makeHook(desk: Desk, modes: Modes, isLoaded: () => boolean): Hook {
  const { session, drawing } = desk;
  return {
    get ready() {
      return isLoaded() && session.classes !== undefined;
    },
    get nRegions() {
      return session.regions.count;
    },
    get nWaiting() {
      return session.nWaiting;
    },
    get isIdle() {
      return session.online && session.isIdle;
    },
    labels: () => [...session.regions.labels],
    classOf: (cell) => session.classes.of[cell],
    screenOf: (cell) => desk.picker.placeOf(cell),
    cellAt: (x, y) => desk.picker.cellAt({ x, y }),
    regionAt: (x, y) => desk.regionOf(desk.picker.cellAt({ x, y })),
    pixelAt: (x, y) => {
      drawing.draw(2);
      return drawing.pixel(x, y);
    },
    cursor: () => desk.cursor,
    cellCursor: () => modes.cellCursor.cell,
    desk,
  };
}
