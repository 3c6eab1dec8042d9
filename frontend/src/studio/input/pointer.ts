// Mouse, pen and touch input on the canvas. A scheme assigns an action to each mouse button; the wheel zooms.

import type { Workbench } from "../workbench";
import type { Modes } from "./modes";
import type { Tool } from "./tools";
import { classOf, objectOf } from "../data/labeling";
import { remember, remembered } from "../session/remembered";
import { element, make } from "../../shared/dom";
import { type Place, placeOf, putTip, zoomByWheel } from "../../shared/picking";
import { text } from "../text/index";

type Drag = "tool" | "pick" | "orbit" | "pan" | "zoom" | "fingers";

type Press = Pick<PointerEvent, "button" | "altKey" | "ctrlKey" | "metaKey" | "shiftKey">;

const isControl = (event: Press): boolean => event.ctrlKey || event.metaKey;

const words = text.mouse;

/** Action of a drag with each mouse button, in each scheme. */
const SCHEMES = {
  studio: (event: Press): Drag => {
    if (event.button === 2) return "orbit";
    if (event.button === 1 || event.altKey) return "pan";
    return isControl(event) ? "pick" : "tool";
  },
  blender: (event: Press): Drag => {
    if (event.button === 2) return "pick";
    if (event.button === 1) return event.shiftKey ? "pan" : isControl(event) ? "zoom" : "orbit";
    return event.altKey ? "orbit" : isControl(event) ? "pick" : "tool";
  },
  meshlab: (event: Press): Drag => {
    if (event.button === 2) return isControl(event) ? "pick" : "tool";
    if (event.button === 1 || isControl(event)) return "pan";
    return event.shiftKey ? "zoom" : "orbit";
  },
};
export type Scheme = keyof typeof SCHEMES;

const SCHEME_KEY = "superfacets mouse";
const DOUBLE_MS = 400; // longest time between the two presses of a double click, in milliseconds
const TAP = 8; // largest movement of a finger during a tap, in pixels

export class Pointer {
  private drag: Drag | null = null;
  private tool: Tool; // tool of the current stroke, which ends with this tool also if a key chooses another one
  private last: Place = { x: 0, y: 0 };
  private started: Place | null = null; // start of a touch that has not moved far enough to paint; null if there is none
  private readonly fingers = new Map<number, Place>();
  private readonly canvas: HTMLCanvasElement;
  private readonly tip = element("tip");
  private turned = { at: -Infinity, place: { x: 0, y: 0 } }; // time and place of the last press that turned or moved the view
  private waiting: PointerEvent | null = null;
  private isOver = false; // whether a mouse pointer is over the canvas
  private scheme: Scheme = "studio";

  constructor(private readonly workbench: Workbench, private readonly modes: Modes) {
    this.canvas = workbench.drawing.canvas;
    this.tool = modes.tool;
    workbench.session.events.on("file", () => (this.drag = this.started = null)); // a stroke must not go on in another file
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.up(event));
    canvas.addEventListener("pointerleave", () => this.left());
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("auxclick", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    workbench.drawing.afterView.push(() => this.hoverAgain());
    workbench.events.on("hover", (cell) => this.showTip(cell));
    workbench.session.events.on("state", () => this.showTip(workbench.hoveredCell));
    this.watchScheme(element<HTMLSelectElement>("scheme"));
  }

  private watchScheme(list: HTMLSelectElement): void {
    for (const [id, { name }] of Object.entries(words.schemes)) list.append(make("option", { value: id }, name));
    const choose = (): void => {
      this.scheme = list.value as Scheme;
      element("turning").textContent = words.schemes[this.scheme].hint;
    };
    const kept = remembered(SCHEME_KEY) ?? "studio";
    list.value = kept in SCHEMES ? kept : "studio";
    list.addEventListener("change", () => {
      remember(SCHEME_KEY, list.value);
      choose();
      if (list.value === "blender") this.workbench.say(words.blenderKeys);
    });
    choose();
  }

  private get isReady(): boolean {
    return this.workbench.session.paints !== undefined && this.workbench.session.regions !== undefined;
  }

  private down(event: PointerEvent): void {
    if (!this.isReady) return;
    if (event.pointerType === "touch") this.fingers.set(event.pointerId, placeOf(this.canvas, event));
    if (this.fingers.size > 1) return this.beginFingers();
    if (this.drag) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.last = placeOf(this.canvas, event);
    if (event.button === 1) event.preventDefault();
    this.tool = this.modes.tool;
    const isFront = event.altKey && this.tool.takesAlt;
    const { button, ctrlKey, metaKey, shiftKey } = event;
    this.drag = SCHEMES[this.scheme](isFront ? { button, ctrlKey, metaKey, shiftKey, altKey: false } : event);
    if (this.drag === "pick") this.pickPaint();
    if (this.drag === "orbit" || this.drag === "pan") this.pressToTurn(event.timeStamp);
    if (this.drag !== "tool") return;
    if (this.tool.turnsBeside && this.workbench.picker.cellAt(this.last) < 0) this.drag = "orbit";
    else if (event.pointerType === "touch") this.started = this.last; // painting waits, because a second finger may follow
    else this.tool.begin(this.last, event.shiftKey, isFront);
  }

  private beginFingers(): void {
    if (this.drag === "tool" && !this.started) this.tool.end();
    this.started = null;
    this.drag = "fingers";
  }

  /** Go closer to the cell under the pointer if this is the second press of a double click. */
  private pressToTurn(at: number): void {
    const { turned, last, workbench } = this;
    const isDouble = at - turned.at < DOUBLE_MS && Math.hypot(last.x - turned.place.x, last.y - turned.place.y) < TAP;
    this.turned = { at: isDouble ? -Infinity : at, place: last };
    const cell = isDouble ? workbench.picker.cellAt(last) : -1;
    if (cell >= 0) workbench.approach(cell);
  }

  private pickPaint(): void {
    const { workbench } = this;
    const cell = workbench.picker.cellAt(this.last);
    if (cell < 0) return;
    const paint = workbench.session.paints.of[cell];
    if (!paint) return workbench.say(words.pickedNothing);
    workbench.choose(classOf(paint), objectOf(paint));
    workbench.sayChosen();
  }

  /**
   * Pointer events can arrive faster than frames. Only the latest event before each frame is processed, except for
   * gestures with several fingers.
   */
  private moved(event: PointerEvent): void {
    if (!this.isReady) return;
    if (this.drag === "fingers") return this.moveFinger(event);
    this.isOver = event.pointerType === "mouse";
    if (!this.waiting) requestAnimationFrame(() => this.move());
    this.waiting = event;
  }

  /** Two fingers rotate and zoom the view; three fingers move the view. */
  private moveFinger(event: PointerEvent): void {
    const { fingers, canvas } = this;
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const place = placeOf(canvas, event);
    fingers.set(event.pointerId, place);
    const height = canvas.clientHeight * fingers.size;
    const [x, y] = [(place.x - before.x) / height, (place.y - before.y) / height];
    const { camera } = this.workbench.drawing;
    if (fingers.size > 2) return camera.pan(x, y);
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (!other) return;
    camera.orbit(4 * x, 4 * y);
    const apart = (one: Place): number => Math.hypot(one.x - other.x, one.y - other.y) || 1;
    camera.zoomBy(apart(place) / apart(before));
  }

  private move(): void {
    const event = this.waiting;
    this.waiting = null;
    if (!event || !this.isReady) return;
    const place = placeOf(this.canvas, event);
    const [dx, dy] = [place.x - this.last.x, place.y - this.last.y];
    if (this.started) {
      if (Math.hypot(dx, dy) < TAP) return;
      this.beginTap();
    }
    const height = this.canvas.clientHeight;
    this.last = place;
    this.moveCircle(place);
    const { camera } = this.workbench.drawing;
    const speed = (camera.isWide ? 1.2 : 4) / height;
    if (this.drag === "orbit") camera.orbit(speed * dx, speed * dy);
    else if (this.drag === "pan") camera.pan(dx / height, dy / height);
    else if (this.drag === "zoom") camera.zoomBy(Math.exp((-4 * dy) / height));
    else if (this.drag === "tool") this.tool.move(place);
    else this.workbench.hover(this.workbench.picker.cellAt(place));
  }

  /** Start the stroke of a single finger at the position where the touch began. */
  private beginTap(): void {
    if (this.started) this.tool.begin(this.started, false);
    this.started = null;
  }

  private moveCircle({ x, y }: Place): void {
    const circle = element<SVGCircleElement>("brush-circle");
    circle.setAttribute("cx", String(x));
    circle.setAttribute("cy", String(y));
  }

  private up(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    if (this.fingers.size && this.drag === "fingers") return;
    this.beginTap(); // a tap without movement
    if (this.waiting) this.move();
    if (this.drag === "tool") this.tool.end();
    this.drag = null;
  }

  /** Look up the cell under a resting mouse pointer after a jump of the view, unless keys act on a region they have chosen. */
  private hoverAgain(): void {
    const { workbench, last } = this;
    if (!this.isOver || this.drag || this.waiting || !this.isReady || workbench.cursor >= 0) return;
    workbench.hover(workbench.picker.cellAt(last));
  }

  private left(): void {
    this.isOver = false;
    this.waiting = null;
    if (!this.drag && this.isReady) this.workbench.hover(-1);
  }

  private wheel(event: WheelEvent): void {
    if (this.isReady) zoomByWheel(this.canvas, this.workbench.drawing.camera, event);
  }

  private showTip(cell: number): void {
    this.tip.hidden = cell < 0 || this.drag === "orbit";
    if (cell < 0) return;
    const { regions, paints, mesh, suggested, theirs } = this.workbench.session;
    const region = this.workbench.regionOf(cell);
    const paint = paints.of[cell];
    const lines = [region < 0 ? text.tip.noRegion : text.region(region)];
    if (region >= 0) {
      lines.push(text.tip.share(regions.areas[region] / paints.totalArea, mesh.measure));
      lines.push(mesh.counted(regions.cellsOf(region).length));
    }
    const name = this.workbench.paintName(paint);
    const kind = this.workbench.className(classOf(paint));
    const mine = !paint ? text.tip.noClass : objectOf(paint) && !name.startsWith(kind) ? text.tip.object(name, kind) : name;
    const other = theirs?.paints.of[cell];
    if (theirs) lines.push(text.tip.mine(mine), text.tip.theirs(other ? this.workbench.theirName(other) : text.tip.noClass));
    else lines.push(mine);
    const harm = theirs || this.drag || this.modes.current === "split" ? "" : this.workbench.harmAt(cell);
    if (harm) lines.push(harm);
    const suggestion = paint ? undefined : suggested.entries[suggested.owners[cell] - 1];
    if (suggestion) lines.push(text.tip.suggested(suggestion.class ? this.workbench.className(suggestion.class) : text.suggestions.noClass));
    this.tip.textContent = lines.join("\n");
    putTip(this.tip, this.canvas, this.last);
  }
}
