import { expect, test } from "vitest";
import { Places } from "../src/page/places";
import { NONE } from "../src/shared/shape";

// Vertices are stored as steps of 0.5 from (-1, 0, 0). Triangle 1 belongs to cell 0, and triangle 0 to cell 2.
const positions = { values: Uint16Array.of(0, 0, 0, 4, 0, 0, 0, 4, 0, 4, 4, 2), low: [-1, 0, 0] as [number, number, number], step: [0.5, 0.5, 0.5] as [number, number, number] };
const shape = { facts: {} as never, positions, normals: null, triangles: Uint32Array.of(1, 2, 3, 0, 1, 2), sources: Uint32Array.of(2, 0) };

test("the sphere of a region contains a vertex of each of its cells, except of cells inside the body", () => {
  const places = new Places(shape, 4);
  expect(places.sphereOf(7, Uint32Array.of(7, 7, 7, NONE))).toEqual({ middle: [0, 0, 0], radius: 1 });
  expect(places.sphereOf(7, Uint32Array.of(1, 7, 1, NONE))).toBeNull();
});

test("each point of a cloud is a cell", () => {
  const places = new Places({ ...shape, triangles: null, sources: null }, 4);
  expect(places.sphereOf(3, Uint32Array.of(0, 0, 3, 3))).toEqual({ middle: [0, 2, 0.5], radius: Math.hypot(1, 0.5) });
});

test("a section shows a part of the bounding box", () => {
  const places = new Places(shape, 4);
  expect(places.section("", 0.5)).toBeNull();
  expect(places.section("-x", 0.25)).toEqual({ low: [-1, 0, 0], high: [-0.5, 2, 1] });
  expect(places.section("+y", 0.25)).toEqual({ low: [-1, 1.5, 0], high: [1, 2, 1] });
});
