// The mouse on the canvas: left for the tool, right orbits, middle or Alt pans, the wheel zooms.

import type { Desk } from "./desk";
import type { Modes } from "./modes";
import { part, percent } from "../shared/dom";
import { type Place, placeOf, putTip, zoomByWheel } from "../shared/picking";

type Drag = "tool" | "orbit" | "pan";

export class Pointer {
  private drag: Drag | null = null;
  private last: Place = { x: 0, y: 0 };
  private readonly canvas: HTMLCanvasElement;
  private readonly tip = part("tip");
  private waiting: PointerEvent | null = null;

  constructor(private readonly desk: Desk, private readonly modes: Modes) {
    this.canvas = desk.drawing.canvas;
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
    canvas.addEventListener("pointerleave", () => this.left());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("auxclick", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    desk.events.on("hover", (cell) => this.showTip(cell));
  }

  private get isReady(): boolean {
    return this.desk.session.classes !== undefined && this.desk.session.regions !== undefined;
  }

  private down(event: PointerEvent): void {
    if (this.drag || !this.isReady) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.last = placeOf(this.canvas, event);
    if (event.button === 2) this.drag = "orbit";
    else if (event.button === 1 || event.altKey) this.drag = "pan";
    else if (event.ctrlKey || event.metaKey) this.pickClass();
    else {
      this.drag = "tool";
      this.modes.tool.begin(this.last, event.shiftKey);
    }
    if (event.button === 1) event.preventDefault();
  }

  private pickClass(): void {
    const { desk } = this;
    const cell = desk.picker.cellAt(this.last);
    if (cell < 0) return;
    const id = desk.session.classes.of[cell];
    desk.choose(id);
    desk.say(id ? `${desk.className(id)} is chosen.` : "No class is there: strokes erase.");
  }

  /** Events come faster than frames: only the latest event before each frame counts. */
  private moved(event: PointerEvent): void {
    if (!this.isReady) return;
    if (!this.waiting) requestAnimationFrame(() => this.move());
    this.waiting = event;
  }

  private move(): void {
    const event = this.waiting;
    this.waiting = null;
    if (!event || !this.isReady) return;
    const place = placeOf(this.canvas, event);
    const [dx, dy] = [place.x - this.last.x, place.y - this.last.y];
    const height = this.canvas.clientHeight;
    this.last = place;
    this.moveCircle(place);
    const { camera } = this.desk.drawing;
    if (this.drag === "orbit") camera.orbit((4 * dx) / height, (4 * dy) / height);
    else if (this.drag === "pan") camera.pan(dx / height, dy / height);
    else if (this.drag === "tool") this.modes.tool.move(place);
    else this.desk.hover(this.desk.picker.cellAt(place));
  }

  private moveCircle({ x, y }: Place): void {
    const circle = part<SVGCircleElement>("brush-circle");
    circle.setAttribute("cx", String(x));
    circle.setAttribute("cy", String(y));
  }

  private up(): void {
    if (this.waiting) this.move();
    if (this.drag === "tool") this.modes.tool.end();
    this.drag = null;
  }

  private left(): void {
    this.waiting = null;
    if (!this.drag && this.isReady) this.desk.hover(-1);
  }

  private wheel(event: WheelEvent): void {
    if (this.isReady) zoomByWheel(this.canvas, this.desk.drawing.camera, event);
  }

  private showTip(cell: number): void {
    this.tip.hidden = cell < 0 || this.drag === "orbit";
    if (cell < 0) return;
    const { regions, classes, mesh } = this.desk.session;
    const region = this.desk.regionOf(cell);
    const id = classes.of[cell];
    const lines = [region < 0 ? "No region" : `Region ${region}`];
    if (region >= 0) {
      const count = regions.cellsOf(region).length.toLocaleString("en");
      lines.push(`${percent(regions.areas[region] / classes.totalArea)} of the ${mesh.measure}`);
      lines.push(`${count} ${mesh.cellName}`);
    }
    lines.push(id ? this.desk.className(id) : "No class");
    this.tip.textContent = lines.join("\n");
    putTip(this.tip, this.canvas, this.last);
  }
}
