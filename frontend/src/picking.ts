// Which cells are at a place of the picture: rays through the tree, or what the last picture shows.

import { DoubleSide, Ray, Sphere, Vector2, Vector3 } from "three";
import type { MeshBVH } from "three-mesh-bvh";
import { type Drawing, NOT_SEEN } from "./drawing";
import type { Mesh } from "./mesh";
import { MARK_HIDDEN } from "./textures";

export interface Place {
  x: number;
  y: number; // in the page's pixels, from the canvas's upper left corner
}

const CONTINUES = false; // what a visit of the tree returns to go on

export class Picker {
  tree: MeshBVH | null = null;
  private readonly ray = new Ray();

  constructor(
    private readonly drawing: Drawing,
    private readonly mesh: Mesh,
  ) {}

  /** The cell that is seen at a place; -1 for none. */
  cellAt(place: Place): number {
    if (this.tree) return this.cellOnRay(place);
    const { cells } = this.drawing.cellsSeen(place.x, place.y, 1, 1);
    return cells[0] === NOT_SEEN ? -1 : cells[0];
  }

  private cellOnRay(place: Place): number {
    this.aim(place);
    const first = this.tree!.raycastFirst(this.ray, DoubleSide);
    if (!first) return -1;
    const cell = this.mesh.cellOf(first.faceIndex!);
    if (!this.isHidden(cell)) return cell;
    const hits = this.tree!.raycast(this.ray, DoubleSide).sort((a, b) => a.distance - b.distance);
    const shown = hits.map((hit) => this.mesh.cellOf(hit.faceIndex!)).find((c) => !this.isHidden(c));
    return shown ?? -1;
  }

  private isHidden(cell: number): boolean {
    return (this.drawing.cells.marksOf(cell) & MARK_HIDDEN) !== 0;
  }

  private aim({ x, y }: Place): void {
    const { clientWidth, clientHeight } = this.drawing.canvas;
    const at = new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight);
    const { lens } = this.drawing.camera;
    this.ray.origin.setFromMatrixPosition(lens.matrixWorld);
    this.ray.direction.set(at.x, at.y, 0.5).unproject(lens).sub(this.ray.origin).normalize();
  }

  /** Cells around the one at a place, on the same side of the body, within so many pixels. */
  cellsAround(place: Place, pixels: number): number[] {
    const cell = this.cellAt(place);
    const middle = new Vector3();
    if (cell < 0 || !this.mesh.middleOf(cell, middle)) return [];
    const sphere = new Sphere(middle, pixels * this.sizeOfPixel(middle));
    const found = this.mesh.isCloud ? this.pointsIn(sphere) : this.trianglesIn(sphere, cell);
    return [...found.add(cell)].filter((other) => !this.isHidden(other));
  }

  /** How long a pixel is at a place, in the mesh's units. */
  sizeOfPixel(at: Vector3): number {
    const { lens } = this.drawing.camera;
    const height = 2 * Math.tan((lens.fov * Math.PI) / 360) * at.distanceTo(lens.position);
    return height / this.drawing.canvas.clientHeight;
  }

  private pointsIn(sphere: Sphere): Set<number> {
    const found = new Set<number>();
    const { x, y, z } = sphere.center;
    const p = this.mesh.positions;
    for (let i = 0; i < this.mesh.nCells; i++) {
      const [dx, dy, dz] = [p[3 * i] - x, p[3 * i + 1] - y, p[3 * i + 2] - z];
      if (dx * dx + dy * dy + dz * dz <= sphere.radius ** 2) found.add(i);
    }
    return found;
  }

  private trianglesIn(sphere: Sphere, cell: number): Set<number> {
    const found = new Set<number>();
    const facing = this.mesh.normalOf(cell, new Vector3());
    const normal = new Vector3();
    const closest = new Vector3();
    this.tree?.shapecast({
      intersectsBounds: (box) => sphere.intersectsBox(box),
      intersectsTriangle: (triangle, index) => {
        triangle.closestPointToPoint(sphere.center, closest);
        if (!sphere.containsPoint(closest)) return CONTINUES;
        const other = this.mesh.cellOf(index);
        if (this.mesh.normalOf(other, normal).dot(facing) >= 0) found.add(other);
        return CONTINUES;
      },
    });
    return found;
  }

  /** Where a cell is in the picture; null where it is not. */
  placeOf(cell: number): Place | null {
    const at = new Vector3();
    if (!this.mesh.middleOf(cell, at)) return null;
    at.project(this.drawing.camera.lens);
    const { clientWidth, clientHeight } = this.drawing.canvas;
    if (Math.abs(at.x) > 1 || Math.abs(at.y) > 1 || Math.abs(at.z) > 1) return null;
    return { x: ((at.x + 1) / 2) * clientWidth, y: ((1 - at.y) / 2) * clientHeight };
  }
}

/** Places from one to another, at most so many pixels apart; the first is left out. */
export function placesBetween(from: Place, to: Place, step: number): Place[] {
  const count = Math.max(1, Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / step));
  return Array.from({ length: count }, (_, i) => ({
    x: from.x + ((to.x - from.x) * (i + 1)) / count,
    y: from.y + ((to.y - from.y) * (i + 1)) / count,
  }));
}
