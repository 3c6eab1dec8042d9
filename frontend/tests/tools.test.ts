import { beforeEach, expect, test, vi } from "vitest";
import { Lasso } from "../src/studio/input/tools";
import type { Drawing } from "../src/studio/view/drawing";
import { Picker } from "../src/studio/view/picker";
import type { Workbench } from "../src/studio/workbench";
import { Mesh } from "../src/studio/data/mesh";
import { Neighbors, paintOf } from "../src/studio/data/labeling";
import { packet } from "./fake";

const SIZE = 8; // width and height of the picture in pixels
const painted = vi.fn();
const said = vi.fn();
const saidPainted = vi.fn();
const paintedRegions = vi.fn();

/** A workbench whose picture shows cell 8 * row + column at each pixel; `depthOf` gives their depths. */
function fakeWorkbench(depthOf: (column: number) => number = () => 5): Workbench {
  const cells = Uint32Array.from({ length: SIZE * SIZE }, (_, i) => i);
  const middleOf = (cell: number): number[] => [cell % SIZE, Math.floor(cell / SIZE), -depthOf(cell % SIZE)];
  const camera = { distance: 5, pixelsOf: () => 5, depths: ([, , z]: number[]) => -z };
  const workbench = {
    currentPaint: 7, sayPainted: saidPainted, say: said, paintActive: vi.fn(),
    harmAt: (cell: number) => (cell === 9 ? "it would replace" : ""),
    picker: { cellsSeen: () => ({ cells, width: SIZE, height: SIZE, scale: 1 }), cellAt: ({ x, y }: { x: number; y: number }) => Math.floor(x) + SIZE * Math.floor(y) },
    drawing: { onView: [] as (() => void)[], camera, canvas: { clientHeight: SIZE } },
    session: { mesh: { middleOf, areas: new Float32Array(SIZE * SIZE).fill(0.01), isCloud: false }, paint: painted },
  };
  return workbench as unknown as Workbench;
}

const makeLasso = (workbench = fakeWorkbench()): Lasso => new Lasso(workbench, { setAttribute: vi.fn() } as unknown as SVGPolygonElement, true);

/** Columns and rows of the painted cells, where row 0 is the top row. */
function extent(): { columns: number[]; rows: number[] } {
  const [cells] = painted.mock.lastCall as [Uint32Array];
  const unique = (values: number[]): number[] => [...new Set(values)].sort();
  return { columns: unique([...cells].map((cell) => cell % SIZE)), rows: unique([...cells].map((cell) => SIZE - 1 - Math.floor(cell / SIZE))) };
}

beforeEach(() => vi.clearAllMocks());

test("a rectangle is the box between the first and the last place", () => {
  const lasso = makeLasso();
  lasso.outline = "rectangle";
  lasso.begin({ x: 1, y: 2 }, false);
  lasso.move({ x: 8, y: 8 });
  lasso.move({ x: 4, y: 4 });
  lasso.end();
  expect(extent()).toEqual({ columns: [1, 2, 3], rows: [2, 3] });
});

test("a polygon has its corners at clicks, and Enter or another click on a corner closes it", () => {
  for (const close of [(lasso: Lasso): void => lasso.confirm(), (lasso: Lasso): void => lasso.begin({ x: 0, y: 600 }, false)]) {
    const lasso = makeLasso();
    lasso.outline = "polygon";
    for (const [x, y] of [[0, 0], [600, 0], [600, 600], [0, 600]]) {
      lasso.begin({ x, y }, false);
      lasso.move({ x: x + 300, y: y + 1 }); // dragging adds no corner
      lasso.end();
    }
    expect(painted).not.toHaveBeenCalled();
    close(lasso);
    expect(extent().columns).toHaveLength(SIZE);
    vi.clearAllMocks();
  }
});

test("a polygon that is not closed ends when the view changes", () => {
  const workbench = fakeWorkbench();
  const lasso = makeLasso(workbench);
  lasso.outline = "polygon";
  for (const place of [{ x: 0, y: 0 }, { x: 600, y: 0 }, { x: 600, y: 600 }]) {
    lasso.begin(place, false);
    if (place.y === 0) lasso.confirm(); // too few corners: paints nothing, and keeps them
  }
  expect(said).toHaveBeenLastCalledWith("An outline needs at least three corners.");
  for (const run of workbench.drawing.onView) run();
  expect(said).toHaveBeenLastCalledWith(expect.stringContaining("the unfinished outline is removed"));
  lasso.confirm();
  expect(painted).not.toHaveBeenCalled();
});

test("with Alt, a lasso paints only the piece in front", () => {
  const lasso = makeLasso(fakeWorkbench((column) => (column < 3 ? 50 : column < 6 ? 2 : 20)));
  lasso.outline = "rectangle";
  for (const isFront of [false, true]) {
    lasso.begin({ x: 0, y: 0 }, false, isFront);
    lasso.move({ x: 8, y: 8 });
    lasso.end();
    expect(extent().columns).toEqual(isFront ? [3, 4, 5] : [0, 1, 2, 3, 4, 5, 6, 7]);
  }
});

test("an outline that touches labels warns before it replaces them", () => {
  const lasso = makeLasso();
  lasso.begin({ x: 0, y: 0 }, false);
  lasso.move({ x: 1, y: 1 });
  expect(said).toHaveBeenCalledWith("The outline: it would replace");
  expect(painted).not.toHaveBeenCalled();
});

/** Draw a rectangle with a lasso for regions, whose columns are regions; columns 3 and 4 are not adjacent. */
function outlineRegions(paint: number, right: number, bottom: number): void {
  const workbench = fakeWorkbench();
  const columnOf = (cell: number): number => cell % SIZE;
  const cellsOf = (region: number): Uint32Array => Uint32Array.from({ length: SIZE }, (_, row) => SIZE * row + region);
  const neighbors = new Neighbors(packet({}, { arcs: Uint32Array.of(0, 1, 1, 2, 2, 3, 4, 5, 5, 6, 6, 7) }), SIZE);
  Object.assign(workbench, { currentPaint: paint, regionOf: columnOf, countReplaced: vi.fn(), paintRegions: paintedRegions, isHidden: () => false });
  Object.assign(workbench.session, { regions: { cellsOf, neighbors, areas: new Float32Array(SIZE) }, paints: { mainPaint: () => paint } });
  Object.assign(workbench.picker, { placeIn: ([x, y]: number[]) => ({ x: x + 0.5, y: SIZE - 0.5 - y }) });
  const lasso = new Lasso(workbench, { setAttribute: vi.fn() } as unknown as SVGPolygonElement, false);
  lasso.outline = "rectangle";
  lasso.begin({ x: 0, y: 0 }, false);
  lasso.move({ x: right, y: bottom });
  lasso.end();
}

test("an outline that takes separate pieces of one object says so", () => {
  const moreOf = (paint: number, right: number): string => {
    outlineRegions(paint, right, 8);
    return saidPainted.mock.lastCall![3] as string;
  };
  expect(moreOf(paintOf(1, 1), 8)).toContain("They are 2 pieces that are not connected (Ctrl+Z undoes; with Alt");
  expect(moreOf(paintOf(1, 1), 4)).toBe(""); // all are connected
  expect(moreOf(paintOf(1, 0), 8)).toBe(""); // stuff
});

test("an outline with nothing inside says so, and paints nothing", () => {
  outlineRegions(paintOf(1, 1), 8, 2);
  expect(said).toHaveBeenLastCalledWith(expect.stringContaining("Nothing was painted: no visible region is mostly inside"));
  expect(paintedRegions).not.toHaveBeenCalled();
});

test("a ball takes both sides of a thin wall, and the brush on the surface only one", () => {
  const positions = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, -0.1, 1, 0, -0.1, 0, 1, -0.1);
  const header = { kind: "triangles", n_cells: 2, measure: "area", palette: [], low: [0, 0, 0], step: [1, 1, 1] };
  const mesh = new Mesh(packet(header, { positions, triangles: Uint32Array.of(0, 1, 2, 3, 5, 4), areas: Float32Array.of(1, 1) }));
  const camera = { distanceTo: () => 1, pixelsOf: () => 1, placeOf: () => null };
  const drawing = { cellsSeen: () => ({ cells: [0] }), camera, canvas: {}, cells: { isHidden: () => false }, isCut: () => false };
  const picker = new Picker(drawing as unknown as Drawing, mesh);
  expect(picker.cellsAround({ x: 0, y: 0 }, 2)).toEqual([0]);
  expect(picker.cellsAround({ x: 0, y: 0 }, 2, true).sort()).toEqual([0, 1]);
});
