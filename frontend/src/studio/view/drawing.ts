// Draws the canvas in two passes, which shaders.ts describes.

import { Camera, type Eye, type Pose } from "../../shared/camera";
import type { Arrays } from "../../shared/arrays";
import { Frame, Gpu, Program, Table } from "../../shared/gl";
import { element } from "../../shared/dom";
import { Blend, hasOwnColors, OwnColors } from "../../shared/owncolors";
import { cellsIn } from "../../shared/picking";
import { SURFACE } from "../../shared/shaders";
import { type Box, emptyBox, NONE } from "../../shared/shape";
import { Surface } from "../../shared/surface";
import type { Sphere, Vector } from "../../shared/vectors";
import { CellTable } from "./celltable";
import { N_SHADES, parseColor, type Rgb } from "../data/colors";
import type { Mesh } from "../data/mesh";
import { Parts } from "./parts";
import { CELLS, image, PARTS, type Switches, WHOLE } from "./shaders";
import { text } from "../text/index";

const REFINE_MS = 160; // time in milliseconds after the last change until the canvas is drawn antialiased
const MAX_FINE_PIXELS = 9_000_000; // largest size of an antialiased framebuffer in pixels
// If the first pass of a view takes longer than this many milliseconds, the view is not antialiased,
// because an antialiased first pass takes four times as long.
const SLOW_MS = 80;
const MAX_CLASSES = 65536;
// Diameter of the points that cover the gaps of surfaces, in diameters of drawn points. If points are spread at random,
// a drawn point is as wide as twice their mean distance, and gaps can be twice as wide.
export const COVER = 4;
const COVER_PIXEL = 4; // canvas pixels per pixel of `coversSeen`, in each direction: 1 takes seconds without a graphics card
const LOOK = 320; // width of the pictures in which `countSeen` counts pixels
const BLINK_MS = 350; // duration of each phase of `blink` in milliseconds
const N_BLINKS = 8; // number of phases
const BANDS = 16; // number of horizontal bands in which the framebuffer is searched for cells

type Part = [left: number, bottom: number, width: number, height: number]; // of the canvas, in pixels

export class Drawing {
  readonly camera = new Camera(() => this.changeView());
  readonly cells: CellTable;
  readonly afterDraw: (() => void)[] = []; // callbacks that run after each draw
  readonly onView: (() => void)[] = []; // callbacks that run when the view changes
  readonly afterView: (() => void)[] = []; // callbacks that run after the view has stopped changing
  clip: Box | null = null; // box outside of which nothing is drawn; null for no clipping
  hasClasses = false; // whether any cell has a class; unlabeled cells are then gray
  hidesBacks = false; // whether triangles and points seen from behind are hidden
  readonly blend = new Blend(element("texture-row"), element<HTMLInputElement>("texture"), () => this.redraw());
  private readonly gpu: Gpu;
  private readonly ownColors: OwnColors;
  private readonly surface: Surface;
  private readonly parts: Parts;
  private isExact = false; // whether whole faces are drawn, without `parts`
  private readonly cellsProgram: Program;
  private readonly partsProgram: Program;
  private readonly imagePrograms = new Map<string, Program>(); // programs of the second pass, by fragment shader
  private readonly regions: Table; // region of each cell
  private readonly regionColors: Table; // color of each region; alpha is 255 if the region is selected
  private readonly classColors: Table;
  private readonly suggestions: Table; // 1-based index of the suggestion of each cell; 0 if the cell has none
  private readonly suggestionColors: Table; // color of each suggestion; alpha is 255 for the chosen suggestion
  private hasSuggestions = false;
  private readonly focused: Table; // 1 for each cell that must not be hidden by others
  private focus: Sphere | null = null; // middle and radius of these cells; null if there are none
  private nBlinks = 0; // number of phases left of `blink`
  private blinking = 0; // timer of the next phase
  private readonly frames: [Frame, Frame]; // framebuffers of the first pass for stride 1 and 2
  private readonly coverFrame: Frame; // framebuffer of `coversSeen`
  private readonly partsFrame: Frame; // cell as which each pixel of the latest first pass is drawn, if `isSmooth`
  private covers: Seen | null = null; // result of `coversSeen` for this view; null if not computed yet
  private frame: Frame | null = null; // framebuffer of the latest first pass; null before the first one
  private stride = 1; // number of first-pass pixels per canvas pixel, in each direction
  private mesh: Mesh | null = null;
  private theme: Record<string, number[]> = {};
  private hovered = NONE;
  private cursor = NONE;
  hasBorders = true;
  private cellsOf: (region: number) => Iterable<number> = () => [];
  private changed: Box | null = null; // contains all cells with other colors than in the latest frame; null if anything has changed
  private drawn: unknown[] = []; // program, framebuffer and sizes of the latest second pass; others draw the whole canvas
  private isStale = false; // whether the first pass must be drawn again
  private isViewNew = false; // whether the `afterView` callbacks must still run
  private scheduled = 0;
  private refining = 0;
  private viewMs = 0; // duration of a first pass for this mesh in milliseconds; 0 if not measured yet

  constructor(readonly canvas: HTMLCanvasElement, failed: (line: string) => void) {
    const gpu = (this.gpu = new Gpu(canvas, true, text.graphics));
    this.surface = new Surface(gpu);
    this.parts = new Parts(gpu);
    this.ownColors = new OwnColors(gpu);
    this.cells = new CellTable(gpu, (cells) => this.redraw(cells), () => this.changeView());
    [this.regions, this.regionColors, this.classColors, this.suggestions, this.suggestionColors, this.focused] =
      Array.from({ length: 6 }, () => new Table(gpu));
    this.frames = [new Frame(gpu, 2), new Frame(gpu, 2)];
    [this.coverFrame, this.partsFrame] = [new Frame(gpu, 1), new Frame(gpu, 1)];
    this.cellsProgram = new Program(gpu, SURFACE, CELLS);
    this.partsProgram = new Program(gpu, SURFACE, PARTS);
    this.imageProgram(this.switches); // fails early if it cannot be built
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // without this call, the browser would never restore the context
      failed(text.session.noGraphics);
    });
    canvas.addEventListener("webglcontextrestored", () => {
      gpu.restore();
      this.changeView();
    });
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.readTheme();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.readTheme());
  }

  private readTheme(): void {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["high", "low", "accent"]) {
      const color = parseColor(style.getPropertyValue(`--view-${name}`).trim());
      this.theme[name] = color.map((value) => value / 255);
    }
    this.redraw();
  }

  get hasSize(): boolean {
    return this.canvas.width > 1 && this.canvas.height > 1;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas.parentElement!;
    if (!clientWidth || !clientHeight) return;
    const ratio = window.devicePixelRatio;
    this.canvas.width = Math.floor(clientWidth * ratio);
    this.canvas.height = Math.floor(clientHeight * ratio);
    this.frame = null;
    this.camera.resize(clientWidth, clientHeight);
    this.changeView();
  }

  /** Show the colors of a mesh, or its texture when the image has been decoded. */
  private async showOwnColors(mesh: Mesh): Promise<void> {
    const { shape, arrays } = mesh;
    this.ownColors.clear();
    this.blend.begin(hasOwnColors(shape.facts, arrays), 0.5);
    await this.ownColors.show(shape, arrays);
    if (this.mesh === mesh) this.changeView();
  }

  /** Show another mesh. Its cells have no regions until `setLabels` is called. */
  setMesh(mesh: Mesh): void {
    this.mesh = mesh;
    this.viewMs = 0;
    this.focus = null;
    this.surface.show(mesh.shape);
    this.parts.take(mesh, {});
    void this.showOwnColors(mesh);
    this.cells.reset(mesh.nCells);
    this.setLabels(new Int32Array(mesh.nCells).fill(-1), [], () => []);
    this.mark({ hovered: -1, cursor: -1 });
    this.camera.show(mesh.shape.facts, mesh.shape.positions);
  }

  setLabels(labels: Int32Array, colors: Rgb[], cellsOf: (region: number) => Iterable<number>): void {
    this.cellsOf = cellsOf;
    this.regions.fill("r32", labels);
    this.regionColors.fill("rgba8", colors.flatMap((color) => [...color, 0]));
    this.isViewNew = true;
    this.redraw();
  }

  /** Draw other `parts` of the same mesh. */
  setParts(arrays: Arrays): void {
    this.parts.take(this.mesh!, arrays);
    this.isStale = true;
    this.redraw();
  }

  private get isSmooth(): boolean {
    return !this.parts.isEmpty && !this.isExact;
  }

  /** Draw whole faces, also at smooth borders. */
  setExact(isExact: boolean): void {
    this.isStale ||= isExact !== this.isExact;
    this.isExact = isExact;
    this.redraw();
  }

  /** Highlight these regions as selected, or remove the highlight. */
  select(regions: Iterable<number>, on: boolean): void {
    const alpha = on ? 255 : 0;
    for (const region of regions) {
      if (this.regionColors.texels[4 * region + 3] === alpha) continue; // painted regions are selected without a highlight
      this.regionColors.texels[4 * region + 3] = alpha;
      this.regionColors.touch(region);
      this.redraw(this.cellsOf(region));
    }
  }

  /** Set the shades of each class id. Classes that are not in the map are gray. */
  setShades(shades: ReadonlyMap<number, Rgb[]>): void {
    const highest = Math.min(MAX_CLASSES - 1, Math.max(0, ...shades.keys()));
    const texels = new Uint8Array(4 * N_SHADES * (highest + 1)).fill(128);
    for (const [id, colors] of shades) colors.forEach((color, k) => texels.set(color, 4 * (N_SHADES * id + k)));
    this.classColors.fill("rgba8", texels);
    this.redraw();
  }

  /**
   * Set the suggestion of each cell, as a 1-based index or 0 for none. Suggested objects are hatched where no
   * class is painted. An empty array removes all suggestions.
   */
  setSuggestions(owners: Uint32Array): void {
    this.hasSuggestions = owners.length > 0;
    this.suggestions.fill("r32", owners);
    this.redraw();
  }

  setSuggestionColors(colors: Rgb[], chosen: number): void {
    const texels = colors.flatMap((color, i) => [...color, i + 1 === chosen ? 255 : 0]);
    this.suggestionColors.fill("rgba8", [0, 0, 0, 0, ...texels]);
    this.redraw();
  }

  /** Highlight the region under the pointer and the region selected by keyboard; -1 means none. */
  mark({ hovered = this.hovered, cursor = this.cursor }: { hovered?: number; cursor?: number }): void {
    const pairs = [[this.hovered, hovered >>> 0], [this.cursor, cursor >>> 0]]; // -1 becomes NONE
    [this.hovered, this.cursor] = pairs.map(([, after]) => after);
    const changed = pairs.filter(([before, after]) => before !== after).flat();
    for (const region of changed) this.redraw(region === NONE ? [] : this.cellsOf(region));
  }

  /** Whether a point is outside the clip box. */
  isCut(place: Vector): boolean {
    const { clip } = this;
    return clip !== null && place.some((value, k) => value < clip.low[k] || value > clip.high[k]);
  }

  /** Draw a changed view: immediately without antialiasing, and antialiased when the view stops changing. */
  changeView(): void {
    this.isStale = true;
    this.changed = null;
    this.covers = null;
    this.isViewNew = true;
    this.stride = 1;
    for (const run of this.onView) run();
    this.schedule();
    this.refineSoon();
  }

  /** Draw the same view with other colors of some cells; null: with any other colors. */
  redraw(cells: Iterable<number> | null = null): void {
    if (!cells) this.changed = null;
    else if (this.changed) for (const some of [cells, this.parts.partly(cells)]) this.mesh!.extend(this.changed, some);
    this.schedule();
    if (this.stride > 1) this.refineSoon();
  }

  private schedule(): void {
    this.scheduled ||= requestAnimationFrame(() => {
      this.scheduled = 0;
      this.draw(1);
      if (this.isViewNew) this.refineSoon(); // this frame first
    });
  }

  private refineSoon(): void {
    clearTimeout(this.refining);
    this.refining = window.setTimeout(() => this.settle(), REFINE_MS);
  }

  private settle(): void {
    if (this.scheduled) return this.refineSoon(); // a frame that is late, for example because shaders are compiled
    if (this.isViewNew) for (const run of this.afterView) run();
    this.isViewNew = false;
    this.refine();
    if (this.mesh && !this.gpu.gl.isContextLost()) this.imageProgram({ ...this.switches, has_labels: true }); // the first click needs it
  }

  /** Whether no cell is in view. Searches bands of the framebuffer from the middle until one contains a cell. */
  get isEmpty(): boolean {
    if (this.isStale || !this.frame) this.draw(1);
    const { frame, gpu } = this;
    if (this.isStale || !frame) return false; // nothing has been drawn yet
    const rows = Math.ceil(frame.height / BANDS);
    const isBare = (band: number): boolean => {
      const height = Math.min(rows, frame.height - band * rows);
      return height <= 0 || cellsIn(gpu, frame, 0, band * rows, frame.width, height).every((cell) => cell === NONE);
    };
    const bands = Array.from({ length: BANDS }, (_, band) => band);
    return bands.sort((a, b) => Math.abs(a - BANDS / 2) - Math.abs(b - BANDS / 2)).every(isBare);
  }

  /**
   * Draw the current view antialiased. Very large canvases are never antialiased. Views that are slow to draw are
   * antialiased only if `always` is set.
   */
  refine(always = false): void {
    const { width, height } = this.canvas;
    if (!this.hasSize || !this.mesh || !this.frame) return;
    this.viewMs ||= this.timeView();
    if ((this.viewMs > SLOW_MS && !always) || 4 * width * height > MAX_FINE_PIXELS) return;
    if (this.stride !== 2) this.isStale = true;
    this.stride = 2;
    this.draw(2);
  }

  /** Measure the duration of the first pass in milliseconds. All tables must have been uploaded before. */
  private timeView(): number {
    this.stride = 1;
    this.gpu.read(0, 0, 1, 1); // waits until the GPU has finished drawing
    const start = performance.now();
    this.drawCells();
    this.gpu.read(0, 0, 1, 1);
    return performance.now() - start;
  }

  /** Draw immediately, with `samples` x `samples` samples per pixel, but at most `stride` x `stride`. */
  draw(samples: number): void {
    if (!this.hasSize || !this.mesh || !this.classColors.bytes || this.gpu.gl.isContextLost()) return;
    const { gl } = this.gpu;
    for (const table of [this.cells.table, this.regionColors]) table.send();
    const frame = this.isStale || !this.frame ? this.drawCells() : this.frame;
    const { regions, cells, regionColors, classColors, stride, hovered, cursor, canvas: { width, height } } = this;
    const line = Math.max(1, Math.round(1.1 * stride * window.devicePixelRatio));
    const program = this.imageProgram(this.switches);
    const drawn = [program, frame, line, Math.min(samples, stride)];
    const isSame = drawn.every((one, k) => one === this.drawn[k]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.scissor(...(isSame && this.changed ? this.partOf(this.changed, Math.ceil((3 * line) / stride) + 2) : [0, 0, width, height] as Part));
    [this.drawn, this.changed] = [drawn, emptyBox()];
    program.use({
      ...this.theme, regions, cells: cells.table, region_colors: regionColors, class_colors: classColors,
      suggestions: this.suggestions, suggestion_colors: this.suggestionColors,
      ids: (this.isSmooth ? this.partsFrame : frame).colors[0], lights: frame.colors[1], depths: frame.depth, near_far: this.camera.eye.near_far, focal: this.camera.pixelsOf(frame.height),
      stride, samples: Math.min(samples, stride), hovered, cursor, line, blend: this.opacity, height,
    });
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    this.gpu.drawNumbers(3);
    gl.disable(gl.SCISSOR_TEST);
    gl.enable(gl.DEPTH_TEST);
    for (const run of this.afterDraw) run();
  }

  /** The part of the canvas around a box, and a margin in pixels, from which the second pass looks at the cells in the box. */
  private partOf({ low, high }: Box, margin: number): Part {
    const { camera, canvas: { width, height } } = this;
    if (low[0] > high[0]) return [0, 0, 0, 0];
    const corners = Array.from({ length: 8 }, (_, i) => camera.projected(low.map((value, k) => (i & (1 << k) ? high[k] : value)) as Vector));
    if (corners.some(([, , depth]) => depth < camera.eye.near_far[0])) return [0, 0, width, height];
    const [[left, right], [top, bottom]] = [width, height].map((size, k) => {
      const places = corners.map((corner) => size * corner[k]);
      return [Math.max(0, Math.floor(Math.min(...places)) - margin), Math.min(size, Math.ceil(Math.max(...places)) + margin)];
    });
    return [left, height - bottom, Math.max(0, right - left), Math.max(0, bottom - top)];
  }

  private get opacity(): number {
    return this.ownColors.isShown ? this.blend.opacity : 0;
  }

  private get switches(): Switches {
    return {
      is_cloud: this.mesh?.isCloud ?? false, has_borders: this.hasBorders, has_labels: this.hasClasses, hides_backs: this.hidesBacks,
      blends: this.opacity > 0, has_suggestions: this.hasSuggestions, blinks: this.nBlinks % 2 === 1,
    };
  }

  /** Returns the program of the second pass for these switches, which is built on first use. */
  private imageProgram(switches: Switches): Program {
    const fragment = image(switches);
    const program = this.imagePrograms.get(fragment) ?? new Program(this.gpu, WHOLE, fragment);
    this.imagePrograms.set(fragment, program);
    return program;
  }

  private drawCells(): Frame {
    this.frame = this.frames[this.stride - 1];
    this.drawInto(this.frame, this.stride * this.canvas.width, this.stride * this.canvas.height, 1);
    if (this.isSmooth) this.drawParts(this.frame);
    this.isStale = false;
    return this.frame;
  }

  /** Copy the cells of a framebuffer to `partsFrame`, and draw the parts there. */
  private drawParts(frame: Frame): void {
    const { parts, parts: { shown }, partsProgram, partsFrame, camera, ownColors } = this;
    partsFrame.copy(frame);
    parts.draw(partsProgram, camera.eye, 0, { ...ownColors.values, seen_cells: frame.colors[0], depths: frame.depth, shown });
  }

  /** Draw the cells to a framebuffer with this size. The size of points is multiplied by `factor`. */
  private drawInto(frame: Frame, width: number, height: number, factor: number, eye: Eye = this.camera.eye): void {
    const { camera, cells, focus } = this;
    frame.begin(width, height);
    this.surface.draw(this.cellsProgram, eye, factor * camera.pixelsOf(height), {
      ...this.ownColors.values, cells: cells.table, has_hidden: cells.hasHidden, hides_backs: this.hidesBacks, is_clipped: this.clip !== null,
      has_focus: focus !== null, focused: this.focused, focus: focus?.middle ?? [0, 0, 0], focus_radius: focus?.radius ?? 1,
      clip_low: this.clip?.low ?? [0, 0, 0], clip_high: this.clip?.high ?? [0, 0, 0],
    });
  }

  /** Returns what `cellsSeen` returns for the whole canvas, if points had `COVER` times their diameter. */
  coversSeen(): Seen {
    if (this.covers) return this.covers;
    const [columns, rows] = [this.canvas.width, this.canvas.height].map((size) => Math.ceil(size / COVER_PIXEL));
    this.drawInto(this.coverFrame, columns, rows, COVER);
    const { width, height } = this.coverFrame;
    const cells = cellsIn(this.gpu, this.coverFrame, 0, 0, width, height);
    return (this.covers = { cells, width, height, scale: width / this.canvas.clientWidth });
  }

  /**
   * Returns the cell drawn at each pixel of a rectangle of the canvas, or NONE where no cell is drawn.
   * The rectangle is in CSS pixels and is the whole canvas by default. Rows run from bottom to top.
   */
  cellsSeen(left = 0, top = 0, width = this.canvas.clientWidth, height = this.canvas.clientHeight): Seen {
    if (this.isStale || !this.frame) this.draw(1);
    const scale = (this.stride * this.canvas.width) / this.canvas.clientWidth;
    const [w, h] = [Math.max(1, Math.ceil(width * scale)), Math.max(1, Math.ceil(height * scale))];
    const bottom = this.frame!.height - Math.floor(top * scale) - h;
    const cells = cellsIn(this.gpu, this.frame!, Math.floor(left * scale), bottom, w, h);
    return { cells, width: w, height: h, scale };
  }

  /** Returns, for each pose of the camera, in how many pixels of a small picture one of the given cells would be visible. */
  countSeen(poses: readonly Pose[], cells: Uint32Array): number[] {
    if (!this.hasSize || !this.mesh) return poses.map(() => 0);
    this.cells.table.send();
    this.covers = null; // it was drawn to the same framebuffer
    const isWanted = new Uint8Array(this.mesh.nCells);
    for (const cell of cells) isWanted[cell] = 1;
    const height = Math.ceil((LOOK * this.canvas.height) / this.canvas.width);
    return poses.map((pose) => {
      this.drawInto(this.coverFrame, LOOK, height, 1, this.camera.eyeOf(pose));
      return cellsIn(this.gpu, this.coverFrame, 0, 0, LOOK, height).reduce((sum, cell) => sum + (isWanted[cell] ?? 0), 0);
    });
  }

  /** Leave out what hides these cells, which are inside a sphere; null leaves out nothing. */
  setFocus(cells: Uint32Array, sphere: Sphere | null): void {
    if (!sphere && !this.focus) return;
    this.focus = sphere;
    const focused = new Uint32Array(sphere ? this.mesh!.nCells : 1);
    for (const cell of cells) focused[cell] = 1;
    this.focused.fill("r32", focused);
    this.changeView();
  }

  get hasFocus(): boolean {
    return this.focus !== null;
  }

  /** Let unlabeled cells blink for some seconds. If the user prefers no motion, highlight them constantly instead. */
  blink(nLeft = N_BLINKS): void {
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.nBlinks = isCalm && nLeft ? 1 : nLeft - 1;
    clearTimeout(this.blinking);
    if (nLeft > 0) this.blinking = window.setTimeout(() => this.blink(isCalm ? 0 : nLeft - 1), isCalm ? N_BLINKS * BLINK_MS : BLINK_MS);
    this.redraw();
  }

  /** Color of the canvas at a position in CSS pixels: red, green and blue from 0 to 255. */
  pixel(x: number, y: number): Rgb {
    const { gl } = this.gpu;
    const scale = this.canvas.width / this.canvas.clientWidth;
    const row = this.canvas.height - 1 - Math.floor(y * scale);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const [red, green, blue] = this.gpu.read(Math.floor(x * scale), row, 1, 1);
    return [red, green, blue];
  }
}

export interface Seen {
  cells: Uint32Array;
  width: number;
  height: number;
  scale: number; // framebuffer pixels per CSS pixel
}
