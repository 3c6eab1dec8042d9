// Draws the canvas in two passes; see shaders.ts.

import { Camera } from "../shared/camera";
import { Frame, Gpu, Program, Table } from "../shared/gl";
import { part } from "../shared/dom";
import { cellsIn } from "../shared/picking";
import { SURFACE } from "../shared/shaders";
import { NONE } from "../shared/shape";
import { Surface } from "../shared/surface";
import { Blend, TexturePaint } from "../shared/texture";
import type { Vector } from "../shared/vectors";
import { CellTable } from "./celltable";
import { parseColor, type Rgb } from "./colors";
import type { Mesh } from "./mesh";
import { CELLS, IMAGE, WHOLE } from "./shaders";

/** A box along the axes of the mesh. */
export interface Box {
  low: Vector;
  high: Vector;
}

const REFINE_MS = 160; // pause after which the picture is drawn antialiased
const MAX_FINE_PIXELS = 9_000_000;
// Views that take longer than this are not antialiased: antialiasing takes four times as long.
const SLOW_MS = 80;
const MAX_CLASSES = 65536;
const BANDS = 16; // number of bands of the picture in which cells are searched

export class Drawing {
  readonly camera = new Camera(() => this.changeView());
  readonly cells: CellTable;
  readonly afterDraw: (() => void)[] = [];
  readonly onView: (() => void)[] = []; // run when the view changes
  readonly afterView: (() => void)[] = []; // run when a changed view has stayed the same for a while
  clip: Box | null = null; // nothing outside this box is drawn
  hidesBacks = false; // triangles seen from behind are not drawn
  readonly blend = new Blend(part("texture-row"), part<HTMLInputElement>("texture"), () => this.redraw());
  private readonly gpu: Gpu;
  private readonly texture: TexturePaint;
  private readonly surface: Surface;
  private readonly cellsProgram: Program;
  private readonly imageProgram: Program;
  private readonly regions: Table; // the region of each cell
  private readonly regionColors: Table; // color of each region; alpha is 255 if it is selected
  private readonly classColors: Table;
  private readonly suggestions: Table; // place in the list of the suggestion of each cell, from 1; 0: none
  private readonly suggestionColors: Table; // color of each suggestion; alpha is 255 if it is chosen
  private hasSuggestions = false;
  private readonly frames: [Frame, Frame]; // framebuffers of the first pass, by stride
  private frame: Frame | null = null; // frame of the latest first pass
  private stride = 1; // pixels of the first pass per pixel of the canvas, along each side
  private mesh: Mesh | null = null;
  private theme: Record<string, number[]> = {};
  private hovered = NONE;
  private cursor = NONE;
  private hasBorders = true;
  private isStale = false; // the first pass is out of date
  private isViewNew = false; // `afterView` must still run
  private scheduled = 0;
  private refining = 0;
  private viewMs = 0; // milliseconds of a first pass for this mesh; 0: not measured

  constructor(readonly canvas: HTMLCanvasElement, failed: (line: string) => void) {
    const gpu = (this.gpu = new Gpu(canvas, true));
    this.surface = new Surface(gpu);
    this.texture = new TexturePaint(gpu);
    this.cells = new CellTable(gpu);
    [this.regions, this.regionColors, this.classColors, this.suggestions, this.suggestionColors] =
      Array.from({ length: 5 }, () => new Table(gpu));
    this.frames = [new Frame(gpu, 2), new Frame(gpu, 2)];
    this.cellsProgram = new Program(gpu, SURFACE, CELLS);
    this.imageProgram = new Program(gpu, WHOLE, IMAGE);
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // otherwise the browser never restores the context
      failed("The graphics card does not answer.");
    });
    canvas.addEventListener("webglcontextrestored", () => this.restore());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.readTheme();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.readTheme());
  }

  private restore(): void {
    this.gpu.restore();
    if (this.mesh) this.surface.show(this.mesh.shape);
    this.changeView();
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

  /** Show the texture of a mesh, once its image is decoded. */
  private async showTexture(mesh: Mesh): Promise<void> {
    const { texture, shape, textureArrays } = mesh;
    this.texture.clear();
    this.blend.begin(texture !== null, 0.5);
    if (texture) await this.texture.show(shape, texture, textureArrays);
    if (this.mesh === mesh) this.changeView();
  }

  /** Show another mesh, without regions yet. */
  setMesh(mesh: Mesh): void {
    this.mesh = mesh;
    this.viewMs = 0;
    this.surface.show(mesh.shape);
    void this.showTexture(mesh);
    this.cells.reset(mesh.nCells);
    this.setLabels(new Int32Array(mesh.nCells).fill(-1), []);
    this.mark({ hovered: -1, cursor: -1 });
    this.camera.show(mesh.shape.facts, mesh.shape.positions);
  }

  setLabels(labels: Int32Array, colors: Rgb[]): void {
    this.regions.fill("r32", labels);
    this.regionColors.fill("rgba8", colors.flatMap((color) => [...color, 0]));
    this.redraw();
  }

  /** Highlight these regions as selected, or remove the highlight. */
  select(regions: Iterable<number>, on: boolean): void {
    for (const region of regions) {
      this.regionColors.texels[4 * region + 3] = on ? 255 : 0;
      this.regionColors.touch(region);
    }
    this.redraw();
  }

  /** Classes without a color are gray. */
  setClassColors(colors: ReadonlyMap<number, Rgb>): void {
    const highest = Math.min(MAX_CLASSES - 1, Math.max(0, ...colors.keys()));
    const texels = new Uint8Array(4 * (highest + 1)).fill(128);
    for (const [id, color] of colors) texels.set(color, 4 * id);
    this.classColors.fill("rgba8", texels);
    this.redraw();
  }

  /** Set the suggested objects, which are hatched where nothing is painted; empty for none. */
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

  /** Mark the regions under the pointer and under the keyboard's cursor; -1 for none. */
  mark({ hovered, cursor }: { hovered?: number; cursor?: number }): void {
    const before = [this.hovered, this.cursor];
    if (hovered !== undefined) this.hovered = hovered >>> 0; // -1 becomes NONE
    if (cursor !== undefined) this.cursor = cursor >>> 0;
    if (before[0] !== this.hovered || before[1] !== this.cursor) this.redraw();
  }

  /** Whether the clip box cuts off a place. */
  isCut(place: Vector): boolean {
    const { clip } = this;
    return clip !== null && place.some((value, k) => value < clip.low[k] || value > clip.high[k]);
  }

  setBorders(on: boolean): void {
    this.hasBorders = on;
    this.redraw();
  }

  /** Draw another view: fast at first, smooth after a while. */
  changeView(): void {
    this.isStale = true;
    this.isViewNew = true;
    this.stride = 1;
    for (const run of this.onView) run();
    this.schedule();
    this.refineSoon();
  }

  /** Draw other colors in the same view. */
  redraw(): void {
    this.schedule();
    if (this.stride > 1) this.refineSoon();
  }

  private schedule(): void {
    this.scheduled ||= requestAnimationFrame(() => {
      this.scheduled = 0;
      this.draw(1);
    });
  }

  private refineSoon(): void {
    clearTimeout(this.refining);
    this.refining = window.setTimeout(() => this.settle(), REFINE_MS);
  }

  private settle(): void {
    if (this.isViewNew) for (const run of this.afterView) run();
    this.isViewNew = false;
    this.refine();
  }

  /** Whether no cell is in view. Reads bands of the picture, from the middle, until one has a cell. */
  get isEmpty(): boolean {
    if (this.isStale || !this.frame) this.draw(1);
    const { frame, gpu } = this;
    if (this.isStale || !frame) return false; // there is no picture yet
    const rows = Math.ceil(frame.height / BANDS);
    const isBare = (band: number): boolean => {
      const height = Math.min(rows, frame.height - band * rows);
      return height <= 0 || cellsIn(gpu, frame, 0, band * rows, frame.width, height).every((cell) => cell === NONE);
    };
    const bands = Array.from({ length: BANDS }, (_, band) => band);
    return bands.sort((a, b) => Math.abs(a - BANDS / 2) - Math.abs(b - BANDS / 2)).every(isBare);
  }

  /** Draw antialiased, unless the canvas is very large, or the view is slow and not `always`. */
  refine(always = false): void {
    const { width, height } = this.canvas;
    if (!this.hasSize || !this.mesh || !this.frame) return;
    this.viewMs ||= this.timeView();
    if ((this.viewMs > SLOW_MS && !always) || 4 * width * height > MAX_FINE_PIXELS) return;
    if (this.stride !== 2) this.isStale = true;
    this.stride = 2;
    this.draw(2);
  }

  /** Milliseconds that the first pass takes. Its tables must have been uploaded. */
  private timeView(): number {
    this.stride = 1;
    this.gpu.read(0, 0, 1, 1); // waits until drawing has finished
    const start = performance.now();
    this.drawCells();
    this.gpu.read(0, 0, 1, 1);
    return performance.now() - start;
  }

  /** Draw now, with `samples` x `samples` samples per pixel, but at most `stride` x `stride`. */
  draw(samples: number): void {
    if (!this.hasSize || !this.mesh || !this.classColors.bytes) return;
    const { gl } = this.gpu;
    for (const table of [this.cells.table, this.regionColors]) table.send();
    const frame = this.isStale || !this.frame ? this.drawCells() : this.frame;
    const { regions, cells, regionColors, classColors, stride, hovered, cursor } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    this.imageProgram.use({
      ...this.theme, regions, cells: cells.table, region_colors: regionColors, class_colors: classColors,
      suggestions: this.suggestions, suggestion_colors: this.suggestionColors, has_suggestions: this.hasSuggestions,
      ids: frame.colors[0], lights: frame.colors[1], depths: frame.depth, near_far: this.camera.eye.near_far,
      stride, samples: Math.min(samples, stride), hovered, cursor, has_borders: this.hasBorders,
      line: Math.max(1, Math.round(1.1 * stride * window.devicePixelRatio)),
      blend: this.texture.isShown ? this.blend.share : 0,
      is_cloud: this.mesh.isCloud, height: this.canvas.height,
    });
    gl.disable(gl.DEPTH_TEST);
    this.gpu.drawNumbers(3);
    gl.enable(gl.DEPTH_TEST);
    for (const run of this.afterDraw) run();
  }

  private drawCells(): Frame {
    const { width, height } = this.canvas;
    const { stride, camera, cells } = this;
    const frame = (this.frame = this.frames[stride - 1]);
    frame.begin(stride * width, stride * height);
    this.surface.draw(this.cellsProgram, camera.eye, camera.pixelsOf(frame.height), {
      ...this.texture.values, cells: cells.table, has_hidden: cells.hasHidden, hides_backs: this.hidesBacks, is_clipped: this.clip !== null,
      clip_low: this.clip?.low ?? [0, 0, 0], clip_high: this.clip?.high ?? [0, 0, 0],
    });
    this.isStale = false;
    return frame;
  }

  /** Cells seen in a rectangle (in CSS pixels; by default the canvas), rows from below, or NONE. */
  cellsSeen(
    left = 0, top = 0, width = this.canvas.clientWidth, height = this.canvas.clientHeight,
  ): Seen {
    if (this.isStale || !this.frame) this.draw(1);
    const scale = (this.stride * this.canvas.width) / this.canvas.clientWidth;
    const [w, h] = [Math.max(1, Math.ceil(width * scale)), Math.max(1, Math.ceil(height * scale))];
    const bottom = this.frame!.height - Math.floor(top * scale) - h;
    const cells = cellsIn(this.gpu, this.frame!, Math.floor(left * scale), bottom, w, h);
    return { cells, width: w, height: h, scale };
  }

  /** Red, green and blue on the canvas, at a place in the page's pixels. */
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
  scale: number; // pixels of this picture per pixel of the page
}
