// Orbit camera, given by a target point, a distance from the target, and an azimuth and elevation
// relative to the axes of the mesh.

import type { Positions, ShapeFacts } from "./shape";
import { cross, dot, lengthOf, minus, normalized, plus, scaled, type Vector } from "./vectors";

const SLOPE = Math.tan((10 * Math.PI) / 180); // half the visible height at distance 1 (vertical field of view: 20 degrees)
const WIDE = Math.tan((30 * Math.PI) / 180); // the same with a wide view (vertical field of view: 60 degrees)
const MARGIN = 0.94; // fraction of the canvas that the mesh fills at zoom 1
const NEAREST = 1e-3; // smallest distance from the eye to the target, relative to the size of the mesh
const FARTHEST = 50; // largest distance from the eye to the target, relative to the size of the mesh
const MIN_NEAR = 0.02; // smallest distance of the near plane, relative to the distance of the target
const STEEP = 1.2; // largest elevation to which an animation turns the camera, in radians
const LOOKS = [0.35, 0.8]; // elevations from which `posesAround` looks at a place from other sides, in radians
const FLIGHT_MS = 300; // duration of a camera animation in milliseconds
const ALIKE = 1e-3; // largest difference between views that count as equal: angles in radians, lengths as fractions

/** Camera angles in degrees, and a zoom factor; zoom 1 shows the whole mesh. */
export interface View {
  azimuth: number;
  elevation: number;
  zoom: number;
}

/** Position of the camera: angles in radians, target, and distance from the eye to the target. */
export interface Pose {
  azimuth: number;
  elevation: number;
  distance: number;
  target: Vector;
}

/** Camera uniforms; each field has the name of its uniform in the shaders. */
export interface Eye {
  rotation: number[]; // 3 x 3 rotation matrix from mesh to eye coordinates, column-major
  target: Vector;
  distance_: number;
  projection: number[];
  near_far: [number, number];
}

/** Whether two angles are equal, apart from rounding and full turns. */
const areAlike = (one: number, other: number): boolean => Math.abs(Math.sin((one - other) / 2)) < ALIKE / 2;

export class Camera {
  target: Vector = [0, 0, 0];
  size = 1; // largest distance of a vertex from the origin
  zoom = 1;
  private slope = SLOPE;
  private aspect = 1;
  azimuth = 0;
  elevation = 0;
  private facts: ShapeFacts | null = null;
  private axes: ShapeFacts["axes"] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]; // of the facts, until the user turns them
  private positions: Positions | null = null;
  private fitted = 0; // distance from the eye to the target at zoom 1; 0 until `fit` has computed it
  private flight: Pose | null = null; // goal of the running animation; null if there is none
  private readonly earlier: Pose[] = []; // view before each jump, the oldest first; distances are multiplied by the slope

  constructor(private readonly changed: () => void) {}

  /** Set the mesh, which must be centered at the origin, and show its initial view. */
  show(facts: ShapeFacts, positions: Positions): void {
    this.facts = facts;
    this.axes = facts.axes;
    this.positions = positions;
    this.earlier.length = 0;
    this.flight = null;
    this.begin();
  }

  resize(width: number, height: number): void {
    this.aspect = width / height;
  }

  /** The view, or the goal of a running animation. */
  private get pose(): Pose {
    const { azimuth, elevation, distance, target } = this.flight ?? this;
    return { azimuth, elevation, distance: distance * this.slope, target };
  }

  /** Note the view before a jump, so that `back` can return to it. */
  private jump(): void {
    this.earlier.push(this.pose);
    this.flight = null;
  }

  /**
   * Animate the camera to the last view before a jump that differs from this one. Repeated calls go back several jumps.
   * Returns false if there is none.
   */
  back(): boolean {
    const { pose: { azimuth, elevation, distance, target } } = this;
    const isHere = (one: Pose): boolean =>
      areAlike(one.azimuth, azimuth) && areAlike(one.elevation, elevation)
      && Math.abs(one.distance - distance) < ALIKE * distance && lengthOf(minus(one.target, target)) < ALIKE * distance;
    let pose = this.earlier.pop();
    while (pose && isHere(pose)) pose = this.earlier.pop();
    if (pose) this.animate({ ...pose, distance: pose.distance / this.slope });
    return pose !== undefined;
  }

  home(): void {
    if (!this.facts) return;
    this.jump();
    this.begin();
  }

  private begin(): void {
    const { azimuth, elevation, zoom } = this.facts!.view;
    this.azimuth = (azimuth * Math.PI) / 180;
    this.elevation = (elevation * Math.PI) / 180;
    this.zoom = zoom;
    this.target = [0, 0, 0];
    this.fitted = 0;
    this.changed();
  }

  /** Let the axis that points most toward the viewer point up from now on, and show the initial view. */
  turnUp(): void {
    const [, up, front] = this.axes;
    const toward = this.directions()[2];
    const ways = this.axes.flatMap((axis) => [axis, scaled(axis, -1)]);
    const best = ways.reduce((most, way) => (dot(way, toward) > dot(most, toward) ? way : most));
    this.setUp(best, Math.abs(dot(best, up)) > 0.5 ? front : scaled(up, -1));
    this.begin();
  }

  private setUp(up: Vector, front: Vector): void {
    this.axes = [cross(up, front), up, front];
    this.flight = null;
    this.earlier.length = 0; // angles of earlier views are relative to other axes
    this.fitted = 0;
  }

  /** Set azimuth and elevation in radians; at (0, 0) the camera looks at the front of the mesh. */
  turnTo(azimuth: number, elevation: number): void {
    this.jump();
    [this.azimuth, this.elevation] = [azimuth, elevation];
    this.changed();
  }

  /** Whether azimuth and elevation, in radians, are equal to the given angles, apart from rounding. */
  isAt(azimuth: number, elevation: number): boolean {
    return areAlike(this.azimuth, azimuth) && areAlike(this.elevation, elevation);
  }

  /** Angles in radians, distance from the eye to the target, target and, if `turnUp` changed them, the axes up and front. */
  get place(): number[] {
    const { axes: [, up, front], facts } = this;
    return [this.azimuth, this.elevation, this.distance, ...this.target, ...(up === facts?.axes[1] ? [] : [...up, ...front])];
  }

  set place(place: number[]) {
    const [[azimuth, elevation, distance], target, up, front] = [0, 3, 6, 9].map((start) => place.slice(start, start + 3));
    if (front.length === 3) this.setUp(up as Vector, front as Vector);
    const { distance: _ } = this; // computes `fitted` from the initial angles
    this.target = target as Vector;
    this.setDistance(distance);
    this.turnTo(azimuth, elevation);
    this.earlier.length = 0;
  }

  /** Distance from the eye to the target. */
  get distance(): number {
    if (!this.fitted && this.positions) this.fit(this.positions);
    return this.fitted / this.zoom;
  }

  /** Compute the smallest distance at which all vertices are in view. */
  private fit({ values, low, step }: Positions): void {
    const directions = this.directions();
    const [right, up, toward] = directions.map((row) => row.map((value, k) => value * step[k]));
    const offsets = directions.map((row) => dot(row, low));
    const reach = 1 / (this.slope * MARGIN);
    let farthest = 1e-6;
    let size = 1e-12;
    for (let i = 0; i < values.length; i += 3) {
      const [x, y, z] = [values[i], values[i + 1], values[i + 2]];
      const across = right[0] * x + right[1] * y + right[2] * z + offsets[0];
      const height = up[0] * x + up[1] * y + up[2] * z + offsets[1];
      const depth = toward[0] * x + toward[1] * y + toward[2] * z + offsets[2];
      const needed = depth + reach * Math.max(Math.abs(height), Math.abs(across) / this.aspect);
      if (needed > farthest) farthest = needed;
      size = Math.max(size, across * across + height * height + depth * depth);
    }
    this.fitted = farthest;
    this.size = Math.sqrt(size);
  }

  /** Unit vectors that point right, up, and toward the viewer, in mesh coordinates. */
  directions({ azimuth, elevation }: Pick<Pose, "azimuth" | "elevation"> = this): [Vector, Vector, Vector] {
    const [right, up, front] = this.axes;
    const [s, c] = [Math.sin(azimuth), Math.cos(azimuth)];
    const [t, d] = [Math.sin(elevation), Math.cos(elevation)];
    const mix = (x: number, y: number, z: number): Vector =>
      [0, 1, 2].map((k) => x * right[k] + y * up[k] + z * front[k]) as Vector;
    return [mix(c, 0, -s), mix(-s * t, d, -c * t), mix(s * d, t, c * d)];
  }

  get eye(): Eye {
    return this.eyeOf(this);
  }

  eyeOf(pose: Pose): Eye {
    const { distance, target } = pose;
    const { aspect } = this;
    const reach = 1.1 * this.size + lengthOf(target);
    const far = distance + reach;
    const near = Math.max(distance - reach, MIN_NEAR * distance);
    const depth = (far + near) / (near - far);
    const shift = (2 * far * near) / (near - far);
    const [right, up, toward] = this.directions(pose);
    return {
      rotation: [0, 1, 2].flatMap((k) => [right[k], up[k], toward[k]]),
      target,
      distance_: distance,
      projection: [1 / (this.slope * aspect), 0, 0, 0, 0, 1 / this.slope, 0, 0, 0, 0, depth, -1, 0, 0, shift, 0],
      near_far: [near, far],
    };
  }

  /** Whether the view is wide, as in a room: `orbit` then turns the camera around the eye instead of the target. */
  get isWide(): boolean {
    return this.slope === WIDE;
  }

  /** Ratio of distances at which the usual and the current view show the same height. */
  get closeness(): number {
    return SLOPE / this.slope;
  }

  /** Distance from which a place with this radius is seen with its surroundings. */
  distanceFor(radius: number): number {
    return this.closeness * Math.max(12 * radius, 0.3 * this.size);
  }

  /** Choose a wide or the usual view. Objects at the target keep their size on the screen. */
  widen(isWide: boolean): void {
    this.flight = null;
    const height = this.distance * this.slope;
    this.slope = isWide ? WIDE : SLOPE;
    this.fitted = 0;
    this.setDistance(height / this.slope);
    this.changed();
  }

  /** Move the camera to the right, up and forward, by distances relative to the size of the mesh. */
  walk(right: number, up: number, forward: number): void {
    this.flight = null;
    const steps = [right, up, -forward];
    this.target = this.directions().reduce((place, way, k) => plus(place, way, steps[k] * this.size), this.target);
    this.changed();
  }

  orbit(x: number, y: number): void {
    this.flight = null;
    const { distance } = this;
    const eye = plus(this.target, this.directions()[2], distance);
    this.azimuth -= x;
    this.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.elevation + y));
    if (this.isWide) this.target = plus(eye, this.directions()[2], -distance);
    this.changed();
  }

  /** Move the target parallel to the screen, by fractions of the visible height. */
  pan(x: number, y: number): void {
    this.flight = null;
    const [right, up] = this.directions();
    const height = 2 * this.slope * this.distance;
    this.target = plus(plus(this.target, right, -x * height), up, y * height);
    this.changed();
  }

  /**
   * Zoom in (factor > 1) or out. The screen position (x, y) stays fixed. The position is relative to the middle of the
   * canvas, in units of the canvas height.
   */
  zoomBy(factor: number, x = 0, y = 0): void {
    this.pan(-x, -y);
    this.setDistance(this.distance / factor);
    this.pan(x, y);
  }

  private setDistance(wanted: number): void {
    const { distance, zoom, size } = this;
    this.zoom = (zoom * distance) / Math.max(NEAREST * size, Math.min(FARTHEST * size, wanted));
  }

  /** Size in pixels of a segment of length 1 at distance 1, for a canvas of this height in pixels. */
  pixelsOf(height: number): number {
    return height / (2 * this.slope);
  }

  /** Distance from a point to the eye. */
  distanceTo(place: Vector): number {
    return lengthOf(minus(place, plus(this.target, this.directions()[2], this.distance)));
  }

  /** Function that returns the distance of a point from the eye along the viewing direction. */
  get depths(): (place: ArrayLike<number>) => number {
    const toward = this.directions()[2];
    const offset = this.distance + dot(this.target, toward);
    return (place) => offset - place[0] * toward[0] - place[1] * toward[1] - place[2] * toward[2];
  }

  /** Position of a point as `placeOf` returns it, but also outside the view, and depth of the point. */
  projected(place: Vector): [x: number, y: number, depth: number] {
    const [right, up, toward] = this.directions();
    const from = minus(place, this.target.map(Math.fround) as Vector); // rounded as in shaders
    const depth = this.distance - dot(from, toward);
    const height = 2 * this.slope * depth;
    return [0.5 + dot(from, right) / (height * this.aspect), 0.5 - dot(from, up) / height, depth];
  }

  /**
   * Position of a point on the canvas, as fractions of the canvas width (from the left) and height
   * (from the top); null if the point is outside the view.
   */
  placeOf(place: Vector): [number, number] | null {
    const [x, y, depth] = this.projected(place);
    return depth > 0 && x >= 0 && x <= 1 && y >= 0 && y <= 1 ? [x, y] : null;
  }

  /**
   * Animate the camera until it faces a surface point with this normal from the given distance. If the
   * normal is zero, azimuth and elevation do not change.
   */
  fly(target: Vector, normal: Vector, distance: number): void {
    const [azimuth, elevation] = this.anglesToward(normal);
    this.flyTo({ azimuth, elevation, distance, target });
  }

  /** Eight poses that look at a surface point from different sides. The first pose is that of `fly`. */
  posesAround(target: Vector, normal: Vector, distance: number): Pose[] {
    const [azimuth, elevation] = this.anglesToward(normal);
    return Array.from({ length: 8 }, (_, k) =>
      ({ azimuth: azimuth + (k * Math.PI) / 4, elevation: k ? LOOKS[k % 2] : elevation, distance, target }));
  }

  /** Animate the camera to a pose. */
  flyTo(pose: Pose): void {
    this.jump();
    this.animate(pose);
  }

  private animate({ azimuth, elevation, distance, target }: Pose): void {
    const from = [this.azimuth, this.elevation, this.distance, ...this.target];
    const turn = Math.atan2(Math.sin(azimuth - from[0]), Math.cos(azimuth - from[0]));
    const to = [from[0] + turn, elevation, distance, ...target];
    const goal = (this.flight = { azimuth: to[0], elevation, distance, target });
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const start = performance.now();
    const move = (now: number): void => {
      if (goal !== this.flight) return;
      const share = isCalm ? 1 : Math.min(1, Math.max(0, (now - start) / FLIGHT_MS));
      const eased = share * share * (3 - 2 * share);
      const [a, e, d, x, y, z] = from.map((value, i) => value + (to[i] - value) * eased);
      [this.azimuth, this.elevation, this.target] = [a, e, [x, y, z]];
      this.setDistance(d);
      this.changed();
      if (share < 1) requestAnimationFrame(move);
      else this.flight = null;
    };
    move(start);
  }

  /** Azimuth and elevation from which the camera faces a surface with this normal. */
  private anglesToward(normal: Vector): [number, number] {
    if (lengthOf(normal) === 0) return [this.azimuth, this.elevation];
    const [right, up, front] = this.axes;
    const n = normalized(normal);
    const elevation = Math.asin(Math.max(-1, Math.min(1, dot(n, up))));
    const isSteep = Math.abs(elevation) > 1.4;
    const azimuth = isSteep ? this.azimuth : Math.atan2(dot(n, right), dot(n, front));
    return [azimuth, Math.max(-STEEP, Math.min(STEEP, elevation))];
  }
}
