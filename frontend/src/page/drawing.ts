// Draws the page with one draw call for the surface and one for the borders. Each frame uploads only a few uniforms.
// For picking, the cell number of each pixel is drawn to a framebuffer. The cell numbers are drawn only once per view,
// when the first cell is picked.

import type { Arrays, Numbers } from "../shared/arrays";
import { Camera, type Pose } from "../shared/camera";
import { Frame, Gpu, opaque, Program, Table, type Values } from "../shared/gl";
import { OwnColors } from "../shared/owncolors";
import { cellsIn, type Place } from "../shared/picking";
import { SURFACE } from "../shared/shaders";
import { type Box, NONE, type Shape } from "../shared/shape";
import { Surface } from "../shared/surface";
import { BORDER, CELLS, INK, SHADE } from "./shaders";

const SAMPLES = 4; // samples per pixel, for antialiasing
const SLOW_MS = 40; // frame time in milliseconds above which a moving view is drawn at low resolution
const COARSE = 0.5; // low resolution as a fraction of the screen resolution
const LOOK = 240; // width of the pictures in which `bestPose` counts pixels
const REST_MS = 150; // time in milliseconds after the last movement until the view is drawn at full resolution

export type Rgb = readonly [number, number, number];

interface Size {
  width: number;
  height: number;
  ratio: number; // canvas pixels per CSS pixel
}

export class Drawing {
  readonly gpu: Gpu;
  readonly camera = new Camera(() => this.move());
  readonly stats = { frames: 0, picks: 0, calls: 0, sentBytes: 0, scriptMs: 0 };
  marked = NONE;
  borders = true;
  hidesBacks = false; // whether surfaces seen from behind are left out
  clip: Box | null = null; // box outside of which nothing is drawn; null for no clipping
  opacity: () => number = () => 0; // of the mesh's own colors or texture
  readonly ownColors: OwnColors;
  readonly nEdges: number;
  /**
   * Returns the width of borders in CSS pixels. `pixels` is the number of CSS pixels per unit of length,
   * `height` the height of the canvas in CSS pixels.
   */
  lineWidth: (pixels: number, height: number) => number = () => 1;
  isCoarse = false;
  frameMs: number | undefined;
  private readonly surface: Surface;
  private readonly shade: Program;
  private readonly cellsProgram: Program;
  private readonly border: Program;
  private readonly groups: Table;
  private readonly regions: Table;
  private readonly colors: Table;
  private readonly edges: Table;
  private readonly samples: Samples;
  private readonly cellsFrame: Frame;
  private cellsView = "";
  private missing: Rgb = [0, 0, 0];
  private waiting = 0;
  private resting = 0;

  constructor(readonly canvas: HTMLCanvasElement, shape: Shape, edges: Numbers | undefined) {
    const gpu = (this.gpu = new Gpu(canvas, false));
    this.surface = new Surface(gpu);
    this.shade = new Program(gpu, SURFACE, SHADE);
    this.cellsProgram = new Program(gpu, SURFACE, CELLS);
    this.border = new Program(gpu, BORDER, INK);
    [this.groups, this.regions, this.colors, this.edges] = Array.from({ length: 4 }, () => new Table(gpu));
    this.samples = new Samples(gpu.gl);
    this.cellsFrame = new Frame(gpu, 1);
    this.ownColors = new OwnColors(gpu);
    this.surface.show(shape);
    this.nEdges = (edges?.length ?? 0) / 4;
    this.edges.fill("rgba32", edges ?? []);
    this.camera.show(shape.facts, shape.positions);
  }

  /** Size of all buffers and textures in bytes; framebuffers are not included. */
  get gpuBytes(): number {
    const tables = [this.surface, this.ownColors, this.groups, this.regions, this.colors, this.edges];
    return tables.reduce((sum, { bytes }) => sum + bytes, 0);
  }

  get nCorners(): number {
    return this.surface.nCorners;
  }

  /** Upload the texture or the colors of a mesh or cloud, and draw them. */
  async setOwnColors(shape: Shape, arrays: Arrays): Promise<void> {
    await this.ownColors.show(shape, arrays);
    this.request();
  }

  /** Set the region of each cell. Borders are drawn between cells of different regions. */
  setRegions(labels: Numbers): void {
    this.stats.sentBytes += this.regions.fill("r32", labels);
    this.request();
  }

  /** Set the color group of each cell, the color of each group (three bytes), and the color of cells without a group. */
  setGroups(groups: Numbers, colors: Numbers, missing: Rgb): void {
    this.stats.sentBytes += this.groups.fill("r32", groups) + this.colors.fill("rgba8", opaque(colors));
    this.missing = missing;
    this.request();
  }

  private resize(): Size {
    const { canvas } = this;
    const ratio = (window.devicePixelRatio || 1) * (this.isCoarse ? COARSE : 1);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.camera.resize(width, height);
    return { width, height, ratio };
  }

  request(): void {
    this.waiting ||= requestAnimationFrame((start) => {
      this.waiting = 0;
      this.draw();
      requestAnimationFrame((next) => this.noteFrame(next - start));
    });
  }

  /**
   * Update the moving average of the time of full-resolution frames. The average starts at 0, because
   * the first frame also compiles the shaders.
   */
  private noteFrame(ms: number): void {
    if (this.isCoarse) return;
    this.frameMs = this.frameMs === undefined ? 0 : (this.frameMs + ms) / 2;
  }

  /** Request a new picture after the view has changed. While the view moves, slow frames are drawn at low resolution. */
  move(): void {
    this.isCoarse ||= (this.frameMs ?? 0) > SLOW_MS;
    clearTimeout(this.resting);
    this.resting = window.setTimeout(() => this.rest(), REST_MS);
    this.request();
  }

  rest(): void {
    if (!this.isCoarse) return;
    this.isCoarse = false;
    this.request();
  }

  draw(): void {
    const { gl } = this.gpu;
    const start = performance.now();
    const size = this.resize();
    if (this.isCoarse) gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    else this.samples.begin(size.width, size.height);
    gl.viewport(0, 0, size.width, size.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawSurface(this.shade, size.height);
    if (this.borders && this.nEdges) this.drawBorders(size);
    if (!this.isCoarse) this.samples.show();
    this.stats.frames++;
    this.stats.scriptMs += performance.now() - start;
  }

  /** Uniforms that leave out a part of the mesh. */
  private get leftOut(): Values {
    const { clip, hidesBacks } = this;
    return { hides_backs: hidesBacks, is_clipped: clip !== null, clip_low: clip?.low ?? [0, 0, 0], clip_high: clip?.high ?? [0, 0, 0] };
  }

  private drawSurface(program: Program, height: number, eye = this.camera.eye): void {
    const { camera, groups, regions, colors, marked } = this;
    this.stats.calls++;
    this.surface.draw(program, eye, camera.pixelsOf(height), {
      ...this.ownColors.values, ...this.leftOut, blend: this.opacity(),
      groups, regions, colors, marked, missing: this.missing.map((value) => value / 255),
    });
  }

  private drawBorders({ width, height, ratio }: Size): void {
    const { camera, edges, regions } = this;
    const pixels = camera.pixelsOf(height) / camera.distance;
    const line = this.lineWidth(pixels / ratio, height / ratio) * ratio;
    this.stats.calls++;
    this.border.use({
      ...this.surface.placing(camera.eye), ...this.leftOut, edges, regions, frame: [width, height], line_width: line,
    });
    this.gpu.drawNumbers(6 * this.nEdges);
  }

  /** Draw the cell number of each pixel to `cellsFrame`, unless `cellsFrame` already shows this view. */
  private drawCells(size: Size): void {
    const view = [size.width, size.height, ...Object.values({ ...this.camera.eye, ...this.leftOut })].join();
    if (view === this.cellsView) return;
    this.cellsFrame.begin(size.width, size.height);
    this.drawSurface(this.cellsProgram, size.height);
    this.stats.picks++;
    this.cellsView = view;
  }

  /** The pose of the camera from which most of a region is visible. */
  bestPose(poses: readonly Pose[], labels: Numbers, region: number): Pose {
    const height = Math.ceil((LOOK * this.canvas.height) / this.canvas.width);
    this.cellsView = "";
    const counts = poses.map((pose) => {
      this.cellsFrame.begin(LOOK, height);
      this.drawSurface(this.cellsProgram, height, this.camera.eyeOf(pose));
      return cellsIn(this.gpu, this.cellsFrame, 0, 0, LOOK, height).reduce((sum, cell) => sum + Number(labels[cell] === region), 0);
    });
    return poses[counts.indexOf(Math.max(...counts))];
  }

  /** The cell drawn at a position of the canvas, or NONE. */
  cellAt({ x, y }: Place): number {
    if (this.isCoarse) {
      this.isCoarse = false;
      this.draw();
    }
    const size = this.resize();
    this.drawCells(size);
    const [left, top] = [Math.floor(x * size.ratio), Math.floor(y * size.ratio)];
    return cellsIn(this.gpu, this.cellsFrame, left, size.height - 1 - top, 1, 1)[0];
  }
}

/** A multisampled framebuffer, for antialiasing. */
class Samples {
  private readonly target: WebGLFramebuffer;
  private readonly buffers: WebGLRenderbuffer[];
  private width = 0;
  private height = 0;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.target = gl.createFramebuffer();
    this.buffers = [gl.createRenderbuffer(), gl.createRenderbuffer()];
  }

  /** Make this framebuffer the target of draw calls, with the given size in pixels. */
  begin(width: number, height: number): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    if (this.width === width && this.height === height) return;
    Object.assign(this, { width, height });
    const samples = Math.min(SAMPLES, gl.getParameter(gl.MAX_SAMPLES) as number);
    const places = [gl.COLOR_ATTACHMENT0, gl.DEPTH_ATTACHMENT];
    [gl.RGBA8, gl.DEPTH_COMPONENT24].forEach((format, i) => {
      gl.bindRenderbuffer(gl.RENDERBUFFER, this.buffers[i]);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, places[i], gl.RENDERBUFFER, this.buffers[i]);
    });
  }

  /** Average the samples of each pixel, and copy the result to the canvas. */
  show(): void {
    const { gl, width, height } = this;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.target);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }
}
