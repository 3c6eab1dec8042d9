// The eye: it looks at a target from a distance, turned about the axes of the mesh.

import { Matrix4, PerspectiveCamera, Vector3 } from "three";

const FIELD = 24; // degrees that the height of the picture shows
const FIT_POINTS = 50_000; // at most so many positions decide what is seen at first
const FLIGHT_MS = 300;

export class Camera {
  readonly lens = new PerspectiveCamera(FIELD, 1, 0.001, 100);
  readonly target = new Vector3();
  distance = 3;
  private azimuth = 0;
  private elevation = 0;
  private axes: Vector3[] = [];
  size = 1; // of the mesh: its reach from the middle
  private flight = 0; // number of the latest one
  private bounds: { positions: Float32Array } | null = null;

  constructor(private readonly changed: () => void) {}

  /** Look at a whole mesh. */
  show(positions: Float32Array, axes: number[][]): void {
    this.axes = axes.map((axis) => new Vector3(...axis));
    this.bounds = { positions };
    this.home();
  }

  resize(width: number, height: number): void {
    this.lens.aspect = width / height;
    this.update();
  }

  home(): void {
    this.flight++;
    this.azimuth = 0.5;
    this.elevation = 0.3;
    this.target.set(0, 0, 0);
    if (this.bounds) this.fit(this.bounds.positions);
    this.update();
  }

  /** Go so far away that all positions are in the picture. */
  private fit(positions: Float32Array): void {
    const [right, up, toward] = this.directions();
    const step = 3 * Math.max(1, Math.floor(positions.length / 3 / FIT_POINTS));
    const reach = 1 / (Math.tan((FIELD * Math.PI) / 360) * 0.88);
    const at = new Vector3();
    let farthest = 1e-6;
    let size = 1e-6;
    for (let i = 0; i < positions.length; i += step) {
      at.fromArray(positions, i);
      const across = Math.abs(at.dot(right)) / this.lens.aspect;
      const needed = at.dot(toward) + reach * Math.max(across, Math.abs(at.dot(up)));
      if (needed > farthest) farthest = needed;
      if (at.lengthSq() > size * size) size = at.length();
    }
    this.distance = farthest;
    this.size = size;
  }

  /** Right, up and toward the viewer. */
  directions(): [Vector3, Vector3, Vector3] {
    const [right, up, front] = this.axes;
    const [s, c] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    const [t, d] = [Math.sin(this.elevation), Math.cos(this.elevation)];
    const mix = (x: number, y: number, z: number): Vector3 =>
      new Vector3().addScaledVector(right, x).addScaledVector(up, y).addScaledVector(front, z);
    return [mix(c, 0, -s), mix(-s * t, d, -c * t), mix(s * d, t, c * d)];
  }

  private update(): void {
    if (!this.axes.length) return;
    const [right, up, toward] = this.directions();
    this.lens.position.copy(this.target).addScaledVector(toward, this.distance);
    this.lens.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(right, up, toward));
    const reach = this.size + this.target.length();
    this.lens.near = Math.max(this.distance - reach, this.distance * 0.02, 1e-5 * this.size);
    this.lens.far = this.distance + reach;
    this.lens.updateProjectionMatrix();
    this.lens.updateMatrixWorld();
    this.changed();
  }

  orbit(x: number, y: number): void {
    this.flight++;
    this.azimuth -= x;
    this.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.elevation + y));
    this.update();
  }

  /** Move what is seen by a share of the picture's height. */
  pan(x: number, y: number): void {
    this.flight++;
    const [right, up] = this.directions();
    const height = 2 * Math.tan((FIELD * Math.PI) / 360) * this.distance;
    this.target.addScaledVector(right, -x * height).addScaledVector(up, y * height);
    this.update();
  }

  /** Come nearer (factor < 1); what is at (x, y), shares of the height off the middle, stays. */
  zoom(factor: number, x = 0, y = 0): void {
    this.pan(-x, -y);
    this.distance = Math.max(this.size * 1e-3, Math.min(this.size * 50, this.distance * factor));
    this.pan(x, y);
  }

  /** Fly in front of a place with a normal, to a distance at most if that is not nearer already. */
  fly(place: Vector3, normal: Vector3, distance: number): void {
    const from = [this.azimuth, this.elevation, this.distance, ...this.target.toArray()];
    const to = [...this.anglesToward(normal), this.distance, ...place.toArray()];
    to[2] = Math.min(this.distance, Math.max(distance, 1e-3 * this.size));
    to[0] = from[0] + Math.atan2(Math.sin(to[0] - from[0]), Math.cos(to[0] - from[0]));
    const number = ++this.flight;
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const start = performance.now();
    const move = (now: number): void => {
      if (number !== this.flight) return;
      const share = isCalm ? 1 : Math.min(1, Math.max(0, (now - start) / FLIGHT_MS));
      const eased = share * share * (3 - 2 * share);
      const [a, e, d, x, y, z] = from.map((value, i) => value + (to[i] - value) * eased);
      [this.azimuth, this.elevation, this.distance] = [a, e, d];
      this.target.set(x, y, z);
      this.update();
      if (share < 1) requestAnimationFrame(move);
    };
    move(isCalm ? start + FLIGHT_MS : start);
  }

  /** Azimuth and elevation from which a surface with this normal is seen, not too steeply. */
  private anglesToward(normal: Vector3): [number, number] {
    if (normal.lengthSq() === 0) return [this.azimuth, this.elevation];
    const [right, up, front] = this.axes;
    const n = normal.clone().normalize();
    const elevation = Math.asin(Math.max(-1, Math.min(1, n.dot(up))));
    const isSteep = Math.abs(elevation) > 1.4;
    const azimuth = isSteep ? this.azimuth : Math.atan2(n.dot(right), n.dot(front));
    return [azimuth, Math.max(-1.2, Math.min(1.2, elevation))];
  }
}
