// Pointer positions, and the cells under them.

import type { Camera } from "./camera";
import type { Frame, Gpu } from "./gl";

const LINE_PIXELS = 30; // pixels per line, for wheels that count lines
const BESIDE = 15; // pixels from the pointer to the tip
const FREE = 4; // smallest gap in pixels between tooltip and edge of the canvas

/** Pixels of the page, from the upper left corner of the canvas. */
export interface Place {
  x: number;
  y: number;
}

export function placeOf(canvas: HTMLCanvasElement, event: MouseEvent): Place {
  const { left, top } = canvas.getBoundingClientRect();
  return { x: event.clientX - left, y: event.clientY - top };
}

/** Zoom by the wheel around the place under the pointer. */
export function zoomByWheel(canvas: HTMLCanvasElement, camera: Camera, event: WheelEvent): void {
  event.preventDefault();
  const { x, y } = placeOf(canvas, event);
  const { clientWidth, clientHeight } = canvas;
  const pixels = event.deltaY * (event.deltaMode ? LINE_PIXELS : 1);
  const off = [(x - clientWidth / 2) / clientHeight, (y - clientHeight / 2) / clientHeight];
  camera.zoomBy(Math.exp(-pixels * 0.0015), off[0], off[1]);
}

/** Place the tip beside a point, within the canvas. */
export function putTip(tip: HTMLElement, canvas: HTMLCanvasElement, { x, y }: Place): void {
  const { left, top, right, bottom } = canvas.getBoundingClientRect();
  tip.style.left = `${Math.min(left + x + BESIDE, right - tip.offsetWidth - FREE)}px`;
  tip.style.top = `${Math.min(top + y + BESIDE, bottom - tip.offsetHeight - FREE)}px`;
}

/** Cell at each pixel of a rectangle of a frame, or NONE; rows from below. */
export function cellsIn(
  gpu: Gpu, frame: Frame, left: number, bottom: number, width: number, height: number,
): Uint32Array {
  frame.bind();
  const cells = new Uint32Array(gpu.read(left, bottom, width, height).buffer);
  for (let i = 0; i < cells.length; i++) cells[i] -= 1; // 0 wraps around to NONE
  return cells;
}
