// `window.studio`, for tests and measurements.

import type { Rgb } from "./colors";
import type { Desk } from "./desk";
import type { Modes } from "./modes";
import type { Place } from "../shared/picking";

export type Hook = ReturnType<typeof makeHook>;

/** Places are in pixels of the page, from the canvas's upper left corner. */
export function makeHook(desk: Desk, modes: Modes, isLoaded: () => boolean) {
  const { session, drawing } = desk;
  const cellAt = (x: number, y: number): number => desk.picker.cellAt({ x, y });
  return {
    desk, // for measurements and pictures
    cellAt,
    get ready(): boolean {
      return isLoaded() && session.classes !== undefined;
    },
    /** The page shows the state of the server. */
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
    classOf: (cell: number): number => session.classes.of[cell],
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
