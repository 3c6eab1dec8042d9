import { beforeEach, expect, test, vi } from "vitest";
import { Camera } from "../src/shared/camera";
import { lengthOf, minus, plus, type Vector } from "../src/shared/vectors";
import { Walk } from "../src/studio/input/walk";
import type { Workbench } from "../src/studio/workbench";

let camera: Camera;

const eye = (): Vector => plus(camera.target, camera.directions()[2], camera.distance);

beforeEach(() => {
  camera = new Camera(() => undefined);
  const values = Float32Array.of(-1, -1, -1, 1, 1, 1);
  const facts = { low: [0, 0, 0], step: [1, 1, 1], axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], view: { azimuth: 0, elevation: 0, zoom: 1 }, point_size: 1 };
  camera.show(facts as never, { values, low: [0, 0, 0], step: [1, 1, 1] });
  expect(camera.distance).toBeGreaterThan(1);
});

test("a wide view shows the target as large as before, and turning keeps the eye in place", () => {
  const place: Vector = [0.3, 0.2, 0];
  const before = camera.placeOf(place)!;
  camera.widen(true);
  expect(camera.placeOf(place)!.map((value) => value.toFixed(3))).toEqual(before.map((value) => value.toFixed(3)));
  const from = eye();
  camera.orbit(0.5, 0.2);
  expect(lengthOf(minus(eye(), from))).toBeLessThan(1e-9);
  camera.widen(false);
  const { target } = camera;
  camera.orbit(0.5, 0.2);
  expect(camera.target).toBe(target);
});

test("going back returns to the view before each jump, also before one that interrupted an animation", () => {
  let time = 0;
  const frames: ((now: number) => void)[] = [];
  const show = (now: number): void => frames.splice(0).forEach((run) => run((time = now)));
  vi.stubGlobal("matchMedia", () => ({ matches: false }));
  vi.stubGlobal("requestAnimationFrame", (run: () => void) => frames.push(run));
  vi.stubGlobal("performance", { now: () => time });
  camera.orbit(0.3, 0.1);
  const poses = [1, 2].map((azimuth) => ({ azimuth, elevation: 0.2, distance: 2, target: [0.1, 0, 0] as Vector }));
  const places = [camera.place, ...poses.map(({ azimuth }) => [azimuth, 0.2, 2, 0.1, 0, 0])];
  camera.flyTo(poses[0]);
  show(100);
  camera.flyTo(poses[1]);
  show(900);
  for (const _ of [1, 2]) {
    camera.turnTo(0, 0); // the second one is no step back
    show(time + 900);
  }
  for (const place of places.reverse()) {
    expect(camera.back()).toBe(true);
    show(time + 900);
    camera.place.forEach((value, k) => expect(value).toBeCloseTo(place[k]));
  }
  expect(camera.back()).toBe(false);
  vi.unstubAllGlobals();
});

test("going back skips views that differ only by rounding or by full turns, and no others", () => {
  vi.stubGlobal("matchMedia", () => ({ matches: true }));
  const pose = { azimuth: 1, elevation: 0.7, distance: 2.1, target: [0.1, 0.3, 0.7] as Vector };
  camera.flyTo(pose);
  camera.flyTo({ ...pose, azimuth: 1 + 2 * Math.PI });
  camera.turnTo(camera.azimuth - 4 * Math.PI + 1e-12, 0.7);
  expect(camera.back()).toBe(true);
  expect(camera.isAt(0, 0)).toBe(true);
  expect(camera.back()).toBe(false);
  const near = { ...pose, distance: 0.02 };
  camera.flyTo(near);
  camera.flyTo({ ...near, target: [0.101, 0.3, 0.7] }); // a small part of the mesh, but a large part of the view
  expect(camera.back()).toBe(true);
  expect(camera.target[0]).toBeCloseTo(0.1, 9);
  vi.unstubAllGlobals();
});

test("a view that was reached by going back is equal to its angles", () => {
  vi.stubGlobal("matchMedia", () => ({ matches: true }));
  camera.turnTo(0.1, 0.2);
  camera.turnTo(0.7 * Math.PI, 0.3);
  camera.back();
  expect(camera.isAt(0.1, 0.2)).toBe(true);
  expect(camera.isAt(0.1 + 2 * Math.PI, 0.2)).toBe(true);
  expect([camera.isAt(0.11, 0.2), camera.isAt(0.1, 0.21), camera.isAt(0.1 + Math.PI, 0.2)]).toEqual([false, false, false]);
  vi.unstubAllGlobals();
});

test("the side that faces the viewer points up from now on, also after a reload", () => {
  const axes = (): number[][] => camera.directions({ azimuth: 0, elevation: 0 }).map((axis) => axis.map((value) => value + 0));
  const { place } = camera;
  expect(place.length).toBe(6); // the server knows the axes
  camera.turnUp();
  expect(axes()).toEqual([[1, 0, 0], [0, 0, 1], [0, -1, 0]]);
  expect(camera.back()).toBe(false); // earlier views have other axes
  camera.turnTo(0.3, 1.4);
  camera.turnUp();
  expect(axes()[1]).toEqual([0, 0, 1]); // it was seen from above
  camera.turnTo(1.5, -0.2);
  camera.turnUp();
  expect(axes()).toEqual([[0, 1, 0], [1, 0, 0], [0, 0, -1]]);
  camera.turnTo(0, -1.4);
  camera.turnUp();
  expect(axes()).toEqual([[0, -1, 0], [-1, 0, 0], [0, 0, -1]]);
  const stored = JSON.parse(JSON.stringify(camera.place)) as number[];
  camera.place = place;
  camera.place = stored;
  expect([axes()[1], camera.place]).toEqual([[-1, 0, 0], stored]);
});

test("eight poses look at a place from eight sides, and the first faces it", () => {
  const poses = camera.posesAround([0, 0, 0], [1, 0, 0], 2);
  expect(new Set(poses.map(({ azimuth }) => (azimuth * 180) / Math.PI % 360)).size).toBe(8);
  expect(camera.directions(poses[0])[2].map(Math.round)).toEqual([1, 0, 0]);
});

test("held keys move the eye forward and sideways, but only while walking", () => {
  vi.stubGlobal("window", { addEventListener: vi.fn() });
  vi.stubGlobal("requestAnimationFrame", vi.fn());
  const button = { addEventListener: vi.fn(), ariaPressed: "" };
  vi.stubGlobal("document", { getElementById: () => button });
  const walk = new Walk({ drawing: { camera }, say: vi.fn() } as unknown as Workbench);
  const press = (key: string): boolean => walk.press({ key, ctrlKey: false } as KeyboardEvent);
  expect(press("w")).toBe(false);
  walk.toggle();
  const from = eye();
  expect([press("w"), press("x")]).toEqual([true, false]);
  const [x, y, z] = minus(eye(), from);
  expect([x, y]).toEqual([0, 0]);
  expect(z).toBeLessThan(0);
  vi.unstubAllGlobals();
});
