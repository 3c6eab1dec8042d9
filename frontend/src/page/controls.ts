// Mouse, touch and keyboard input on the canvas of the page.

import { type Place, placeOf, zoomByWheel } from "../shared/picking";
import { NONE } from "../shared/shape";
import type { Panel } from "./panel";

const TURN = Math.PI / 24; // rotation by one press of an arrow key, in radians

export class Controls {
  private readonly canvas: HTMLCanvasElement;
  private readonly pressed = new Map<number, PointerEvent>();
  private pointer: Place | null = null; // latest pointer position that is not processed yet; null if there is none

  constructor(private readonly panel: Panel) {
    const { canvas, camera } = panel.drawing;
    this.canvas = canvas;
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", (event) => this.pressed.delete(event.pointerId));
    canvas.addEventListener("pointercancel", (event) => this.pressed.delete(event.pointerId));
    canvas.addEventListener("pointerleave", () => panel.tell(NONE));
    canvas.addEventListener("wheel", (event) => {
      zoomByWheel(canvas, camera, event);
      panel.tell(NONE);
    }, { passive: false });
    canvas.addEventListener("dblclick", () => camera.home());
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  private down(event: PointerEvent): void {
    this.canvas.setPointerCapture(event.pointerId);
    this.pressed.set(event.pointerId, event);
    this.panel.tell(NONE);
  }

  private moved(event: PointerEvent): void {
    const before = this.pressed.get(event.pointerId);
    if (before) {
      this.drag(before, event);
      this.pressed.set(event.pointerId, event);
    } else if (!this.pressed.size) {
      this.hoverSoon(placeOf(this.canvas, event));
    }
  }

  /** Pointer events can arrive faster than frames; only the latest event before each frame is processed. */
  private hoverSoon(place: Place): void {
    if (!this.pointer) {
      requestAnimationFrame(() => {
        if (this.pointer) this.panel.tellAt(this.pointer);
        this.pointer = null;
      });
    }
    this.pointer = place;
  }

  private drag(before: PointerEvent, event: PointerEvent): void {
    const { camera } = this.panel.drawing;
    const height = this.canvas.clientHeight;
    const [x, y] = [(event.clientX - before.clientX) / height, (event.clientY - before.clientY) / height];
    const other = [...this.pressed.values()].find((one) => one.pointerId !== event.pointerId);
    if (other) {
      const apart = (one: PointerEvent): number =>
        Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      camera.zoomBy(apart(event) / apart(before));
      camera.pan(x / 2, y / 2);
    } else if (event.buttons !== 1 || event.shiftKey || event.ctrlKey) {
      camera.pan(x, y);
    } else {
      camera.orbit(x * Math.PI, y * Math.PI);
    }
  }

  private key(event: KeyboardEvent): void {
    const { panel } = this;
    const { camera, borders } = panel.drawing;
    const go = (x: number, y: number): void => {
      if (event.shiftKey) camera.pan(-x * 0.05, -y * 0.05);
      else camera.orbit(-x * TURN, -y * TURN);
    };
    const actions: Record<string, () => void> = {
      ArrowLeft: () => go(-1, 0),
      ArrowRight: () => go(1, 0),
      ArrowUp: () => go(0, -1),
      ArrowDown: () => go(0, 1),
      "+": () => camera.zoomBy(1.2),
      "=": () => camera.zoomBy(1.2),
      "-": () => camera.zoomBy(1 / 1.2),
      0: () => camera.home(),
      "[": () => panel.setLevel(panel.level - 1),
      "]": () => panel.setLevel(panel.level + 1),
      i: () => panel.seeInside(!panel.drawing.hidesBacks),
      x: () => panel.nextSection("x"),
      y: () => panel.nextSection("y"),
      z: () => panel.nextSection("z"),
      b: () => panel.setBorders(!borders),
      c: () => panel.nextColoring(),
      t: () => panel.blend.toggle(),
      Enter: () => panel.tellMiddle(),
    };
    const action = actions[event.key];
    if (!action || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    panel.tell(NONE);
    action();
  }
}
