// The clip box: only the part of the mesh inside the box is drawn. Handles and keys move its sides.

import { element, onClick } from "../../shared/dom";
import { placeOf } from "../../shared/picking";
import type { Vector } from "../../shared/vectors";
import type { Workbench } from "../workbench";
import { type Box, boundsOf } from "../../shared/shape";
import { putCircle } from "../view/picker";
import { text } from "../text/index";

const words = text.views;
const NAMES = ["x", "y", "z"];
const LEAST = 0.02; // smallest thickness of the box, relative to the size of the mesh
const STEP = 0.02; // distance by which a key moves a side of the box, relative to the size of the mesh

/** A side of the box: its axis, and whether it is the lower or the upper side on this axis. */
interface Face {
  axis: number;
  side: keyof Box;
}

const FACES: Face[] = [0, 1, 2].flatMap((axis): Face[] => [{ axis, side: "low" }, { axis, side: "high" }]);

export class ClipBox {
  private whole: Box = { low: [0, 0, 0], high: [0, 0, 0] };
  private last: Face = FACES[1];
  private hasHandles = false;
  private readonly handles: SVGCircleElement[] = [];

  constructor(private readonly workbench: Workbench) {
    const { drawing, session } = workbench;
    session.events.on("file", (mesh) => {
      this.whole = boundsOf(mesh.shape.positions);
      drawing.clip = null;
      this.hasHandles = false;
    });
    for (const face of FACES) this.addHandle(face);
    drawing.afterDraw.push(() => this.showHandles());
    onClick("clip", () => this.toggle());
  }

  private get box(): Box {
    const { clip } = this.workbench.drawing;
    return clip ?? { low: [...this.whole.low], high: [...this.whole.high] };
  }

  private addHandle(face: Face): void {
    const svg = element("overlay").namespaceURI;
    const handle = document.createElementNS(svg, "circle") as SVGCircleElement;
    handle.setAttribute("r", "9");
    handle.classList.add("handle", NAMES[face.axis]);
    handle.append(document.createElementNS(svg, "title"));
    handle.firstElementChild!.textContent = words.handle(NAMES[face.axis]);
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      this.last = face;
    });
    handle.addEventListener("pointermove", (event) => {
      if (handle.hasPointerCapture(event.pointerId)) this.drag(face, event);
    });
    this.handles.push(handle);
    element("overlay").append(handle);
  }

  /** Show or remove the clip box and its handles. */
  toggle(): void {
    this.hasHandles = !this.hasHandles;
    this.set(this.hasHandles ? this.box : null);
    this.workbench.say(this.hasHandles ? words.clipShown : words.clipRemoved);
  }

  /**
   * Cut the mesh in two halves along an axis, and show one half. The second call shows the other half,
   * and the third call removes the cut.
   */
  cycle(axis: number): void {
    const [low, high] = [this.whole.low[axis], this.whole.high[axis]];
    const middle = (low + high) / 2;
    const { box } = this;
    const isHigh = box.low[axis] > low;
    const isLow = box.high[axis] < high;
    box.low[axis] = isLow && !isHigh ? middle : low;
    box.high[axis] = isLow || isHigh ? high : middle;
    this.last = { axis, side: isLow && !isHigh ? "low" : "high" };
    const isCut = NAMES.some((_, k) => box.low[k] > this.whole.low[k] || box.high[k] < this.whole.high[k]);
    this.hasHandles = isCut;
    this.set(isCut ? box : null);
    const name = NAMES[axis];
    this.workbench.say(isHigh ? words.sectionRemoved(name) : words.section(name));
  }

  /** Move the side of the clip box that was moved most recently, by a number of steps along its axis. */
  nudge(steps: number): void {
    if (!this.workbench.drawing.clip) return this.workbench.say(words.noSection);
    const { axis, side } = this.last;
    this.move(this.last, this.box[side][axis] + steps * STEP * this.extent(axis));
  }

  private extent(axis: number): number {
    return this.whole.high[axis] - this.whole.low[axis];
  }

  private move({ axis, side }: Face, value: number): void {
    const { box, whole } = this;
    const least = LEAST * this.extent(axis);
    const [low, high] = side === "low"
      ? [whole.low[axis], box.high[axis] - least]
      : [box.low[axis] + least, whole.high[axis]];
    box[side][axis] = Math.max(low, Math.min(high, value));
    this.set(box);
  }

  private set(box: Box | null): void {
    const { drawing } = this.workbench;
    drawing.clip = box;
    element("clip").ariaPressed = String(this.hasHandles);
    drawing.changeView();
    this.showHandles();
  }

  private middleOf({ axis, side }: Face): Vector {
    const { low, high } = this.box;
    const middle = low.map((value, k) => (value + high[k]) / 2) as Vector;
    middle[axis] = this.box[side][axis];
    return middle;
  }

  private showHandles(): void {
    this.handles.forEach((handle, i) => {
      putCircle(handle, this.hasHandles ? this.workbench.picker.placeIn(this.middleOf(FACES[i])) : null);
    });
  }

  /** Move a side along its axis, so that its handle comes as close to the pointer as possible. */
  private drag(face: Face, event: PointerEvent): void {
    const { drawing, picker } = this.workbench;
    const from = this.middleOf(face);
    const to: Vector = [...from];
    const unit = 0.01 * this.extent(face.axis);
    to[face.axis] += unit;
    const [a, b] = [picker.placeIn(from), picker.placeIn(to)];
    if (!a || !b) return;
    const way = { x: b.x - a.x, y: b.y - a.y };
    const length = way.x * way.x + way.y * way.y;
    if (length < 1e-6) return; // the axis is parallel to the viewing direction
    const place = placeOf(drawing.canvas, event);
    const steps = ((place.x - a.x) * way.x + (place.y - a.y) * way.y) / length;
    this.move(face, from[face.axis] + steps * unit);
  }
}
