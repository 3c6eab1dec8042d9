// Which cells are at a place of the picture, and where cells are in it.

import type { Place } from "../shared/picking";
import { NONE } from "../shared/shape";
import { dot } from "../shared/vectors";
import type { Drawing } from "./drawing";
import type { Mesh } from "./mesh";
import { Surroundings } from "./surroundings";

export class Picker {
  private known: Surroundings | null = null;

  constructor(
    private readonly drawing: Drawing,
    private readonly mesh: Mesh,
  ) {}

  /** Built on first use: looking at a mesh does not need it. */
  get surroundings(): Surroundings {
    return (this.known ??= new Surroundings(this.mesh));
  }

  /** The cell that is seen at a place; -1 for none. */
  cellAt(place: Place): number {
    const [cell] = this.drawing.cellsSeen(place.x, place.y, 1, 1).cells;
    return cell === NONE ? -1 : cell;
  }

  /** Cells around the one at a place, on the same side of the body, within so many pixels. */
  cellsAround(place: Place, pixels: number): number[] {
    const { mesh, drawing } = this;
    const cell = this.cellAt(place);
    const middle = cell < 0 ? null : mesh.middleOf(cell);
    if (!middle) return [];
    const { camera, canvas } = drawing;
    const radius = (pixels * camera.distanceTo(middle)) / camera.pixelsOf(canvas.clientHeight);
    const facing = mesh.normalOf(cell);
    const found = [...this.surroundings.within(middle, radius).add(cell)];
    return found.filter((other) => !drawing.cells.isHidden(other) && dot(mesh.normalOf(other), facing) >= 0);
  }

  /** Position of a cell in the picture; null if it is outside. */
  placeOf(cell: number): Place | null {
    const { camera, canvas } = this.drawing;
    const middle = this.mesh.middleOf(cell);
    const shares = middle && camera.placeOf(middle);
    return shares && { x: shares[0] * canvas.clientWidth, y: shares[1] * canvas.clientHeight };
  }
}

/** Places from one to another, at most `step` pixels apart, without the first. */
export function placesBetween(from: Place, to: Place, step: number): Place[] {
  const count = Math.max(1, Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / step));
  return Array.from({ length: count }, (_, i) => ({
    x: from.x + ((to.x - from.x) * (i + 1)) / count,
    y: from.y + ((to.y - from.y) * (i + 1)) / count,
  }));
}
