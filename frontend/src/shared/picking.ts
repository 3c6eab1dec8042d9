// Pointer positions on the canvas, and the cells drawn at these positions.

import type { Camera } from "./camera";
import type { Frame, Gpu } from "./gl";

const LINE_PIXELS = 30; // pixels per line, for mouse wheels that report lines
const BESIDE = 15; // distance in pixels from the pointer to the tooltip, in x and in y
const FREE = 4; // smallest gap in pixels between the tooltip and the edge of the canvas

/** Position in CSS pixels, relative to the upper left corner of the canvas. */
export interface Place {
  x: number;
  y: number;
}

export function placeOf(canvas: HTMLCanvasElement, event: MouseEvent): Place {
  const { left, top } = canvas.getBoundingClientRect();
  return { x: event.clientX - left, y: event.clientY - top };
}

/** Zoom with the mouse wheel; the point under the pointer stays fixed. */
export function zoomByWheel(canvas: HTMLCanvasElement, camera: Camera, event: WheelEvent): void {
  event.preventDefault();
  const { x, y } = placeOf(canvas, event);
  const { clientWidth, clientHeight } = canvas;
  const pixels = event.deltaY * (event.deltaMode ? LINE_PIXELS : 1);
  const off = [(x - clientWidth / 2) / clientHeight, (y - clientHeight / 2) / clientHeight];
  camera.zoomBy(Math.exp(-pixels * 0.0015), off[0], off[1]);
}

/** Move the tooltip next to a position, but keep it inside the canvas. */
export function putTip(tip: HTMLElement, canvas: HTMLCanvasElement, { x, y }: Place): void {
  const { left, top, right, bottom } = canvas.getBoundingClientRect();
  tip.style.left = `${Math.min(left + x + BESIDE, right - tip.offsetWidth - FREE)}px`;
  tip.style.top = `${Math.min(top + y + BESIDE, bottom - tip.offsetHeight - FREE)}px`;
}

/**
 * Reads the cell drawn at each pixel of a rectangle of a framebuffer, or NONE where no cell is drawn.
 * Rows run from bottom to top.
 */
export function cellsIn(gpu: Gpu, frame: Frame, left: number, bottom: number, width: number, height: number): Uint32Array {
  frame.bind();
  const cells = new Uint32Array(gpu.read(left, bottom, width, height).buffer);
  for (let i = 0; i < cells.length; i++) cells[i] -= 1; // pixels store the cell number plus 1; 0 (no cell) wraps around to NONE
  return cells;
}
