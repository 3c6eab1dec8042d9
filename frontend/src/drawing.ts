// What is on the canvas. Two passes, see shaders.ts.

import {
  BufferAttribute, BufferGeometry, Color, DataTexture, DepthTexture, GLSL3, IntType, Mesh as Drawn,
  NearestFilter, NoBlending, OrthographicCamera, Points, RawShaderMaterial, Scene, UnsignedIntType, Vector2,
  WebGLRenderer, WebGLRenderTarget,
} from "three";
import { Camera } from "./camera";
import type { Rgb } from "./colors";
import type { Mesh } from "./mesh";
import { CELLS_FRAGMENT, CELLS_VERTEX, IMAGE_FRAGMENT, IMAGE_VERTEX } from "./shaders";
import {
  CellTexture, classTexture, numberTexture, RegionTexture, setNormals, vertexTexture,
} from "./textures";

const NONE = 0xffffffff;
const REFINE_MS = 160; // at rest so long, the picture gets smooth
const MAX_FINE_PIXELS = 9_000_000;
// Views that take longer are not drawn smooth, which takes four times as long: without a graphics
// card one would wait for it.
const SLOW_MS = 80;

export class Drawing {
  readonly camera = new Camera(() => this.changeView());
  cells!: CellTexture;
  regions: RegionTexture | null = null;
  private mesh: Mesh | null = null;
  private readonly renderer: WebGLRenderer;
  private readonly targets = new Map<number, WebGLRenderTarget>();
  private target: WebGLRenderTarget | null = null; // of the latest first pass
  private stride = 1;
  private readonly cellScene = new Scene();
  private readonly cellMaterial: RawShaderMaterial;
  private readonly imageScene = new Scene();
  private readonly imageMaterial: RawShaderMaterial;
  private readonly imageLens = new OrthographicCamera();
  private owned: { dispose(): void }[] = []; // by the mesh that is shown
  private vertices: DataTexture | null = null;
  private isStale = false; // the first pass is out of date
  private scheduled = 0;
  private refining = 0;
  afterDraw: () => void = () => undefined;
  private viewMs = 0; // that a view of this mesh takes; 0: not measured yet

  constructor(
    readonly canvas: HTMLCanvasElement,
    private readonly failed: (line: string) => void,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: false });
    this.renderer.autoClear = false;
    this.preferFirstVertex();
    canvas.addEventListener("webglcontextlost", () => this.failed("The graphics card was lost."));
    canvas.addEventListener("webglcontextrestored", () => {
      this.preferFirstVertex();
      this.changeView();
    });
    this.cellMaterial = cellMaterial();
    this.imageMaterial = imageMaterial();
    const whole = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    whole.setAttribute("position", new BufferAttribute(corners, 3));
    const picture = new Drawn(whole, this.imageMaterial);
    picture.frustumCulled = false;
    this.imageScene.add(picture);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.readTheme();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.readTheme());
  }

  /** All corners of a triangle name the same cell; most graphics cards like to ask the first. */
  private preferFirstVertex(): void {
    const extension = this.renderer.getContext().getExtension("WEBGL_provoking_vertex");
    extension?.provokingVertexWEBGL(extension.FIRST_VERTEX_CONVENTION_WEBGL);
  }

  private readTheme(): void {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["high", "low", "accent"]) {
      const color = new Color().setStyle(style.getPropertyValue(`--view-${name}`).trim(), "");
      this.imageMaterial.uniforms[name].value = color;
    }
    this.redraw();
  }

  get hasSize(): boolean {
    return this.canvas.width > 1 && this.canvas.height > 1;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas.parentElement!;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    for (const target of this.targets.values()) target.dispose();
    this.targets.clear();
    this.target = null;
    this.camera.resize(clientWidth, clientHeight);
  }

  /** Show another mesh, without regions yet. */
  setMesh(mesh: Mesh): void {
    for (const thing of this.owned) thing.dispose();
    this.regions?.texture.dispose();
    this.regions = null;
    this.mesh = mesh;
    this.viewMs = 0;
    const uniforms = this.cellMaterial.uniforms;
    this.vertices = vertexTexture(mesh.positions);
    this.cells = new CellTexture(mesh.nCells);
    const sources = numberTexture(mesh.triangleCells ?? new Uint32Array(1));
    uniforms.vertices.value = this.vertices;
    uniforms.cells.value = this.imageMaterial.uniforms.cells.value = this.cells.texture;
    uniforms.sources.value = sources;
    uniforms.has_sources.value = mesh.triangleCells !== null;
    uniforms.is_cloud.value = this.imageMaterial.uniforms.is_cloud.value = mesh.isCloud;
    const geometry = geometryOf(mesh);
    const drawn = mesh.isCloud
      ? new Points(geometry, this.cellMaterial)
      : new Drawn(geometry, this.cellMaterial);
    drawn.frustumCulled = false;
    this.cellScene.clear();
    this.cellScene.add(drawn);
    this.owned = [this.vertices, this.cells.texture, sources, geometry];
    this.setLabels(new Int32Array(mesh.nCells).fill(-1), []);
    this.mark({ hovered: -1, cursor: -1 });
    this.camera.show(mesh.positions, mesh.axes);
  }

  setNormals(packed: Uint32Array): void {
    if (this.vertices) setNormals(this.vertices, packed);
    this.changeView();
  }

  setLabels(labels: Int32Array, colors: Rgb[]): void {
    const uniforms = this.imageMaterial.uniforms;
    (uniforms.regions.value as DataTexture | null)?.dispose();
    this.regions?.texture.dispose();
    uniforms.regions.value = numberTexture(labels);
    this.regions = new RegionTexture(colors);
    uniforms.region_colors.value = this.regions.texture;
    this.redraw();
  }

  setClassColors(colors: ReadonlyMap<number, Rgb>): void {
    const uniforms = this.imageMaterial.uniforms;
    (uniforms.class_colors.value as DataTexture | null)?.dispose();
    uniforms.class_colors.value = classTexture(colors);
    this.redraw();
  }

  /** Regions under the pointer and under the keyboard's cursor; -1 for none. */
  mark({ hovered, cursor }: { hovered?: number; cursor?: number }): void {
    const uniforms = this.imageMaterial.uniforms;
    const before = [uniforms.hovered.value, uniforms.cursor.value];
    if (hovered !== undefined) uniforms.hovered.value = hovered < 0 ? NONE : hovered;
    if (cursor !== undefined) uniforms.cursor.value = cursor < 0 ? NONE : cursor;
    if (before[0] !== uniforms.hovered.value || before[1] !== uniforms.cursor.value) this.redraw();
  }

  setBorders(on: boolean): void {
    this.imageMaterial.uniforms.has_borders.value = on;
    this.redraw();
  }

  /** The mesh is seen in another way: draw it anew, fast at first and smooth after a while. */
  changeView(): void {
    this.isStale = true;
    this.stride = 1;
    this.schedule();
    this.refineSoon();
  }

  /** Only colors changed. */
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
    this.refining = window.setTimeout(() => this.refine(), REFINE_MS);
  }

  /** Draw smooth lines; `always`: even where that takes long. */
  refine(always = false): void {
    const { width, height } = this.canvas;
    if (!this.hasSize || !this.mesh || !this.target) return;
    this.viewMs ||= this.timeView();
    if ((this.viewMs > SLOW_MS && !always) || 4 * width * height > MAX_FINE_PIXELS) return;
    if (this.stride !== 2) this.isStale = true;
    this.stride = 2;
    this.draw(2);
  }

  /** Milliseconds that the first pass takes; textures have been sent before. */
  private timeView(): number {
    this.stride = 1;
    const wait = (): void => {
      this.renderer.readRenderTargetPixels(this.target!, 0, 0, 1, 1, new Uint8Array(4));
    };
    wait();
    const start = performance.now();
    this.drawCells();
    wait();
    return performance.now() - start;
  }

  /** Draw now. `samples` along each side are looked at for a pixel, at most the stride. */
  draw(samples: number): void {
    if (!this.hasSize || !this.mesh || this.imageMaterial.uniforms.class_colors.value === null) return;
    if (this.isStale || !this.target) this.drawCells();
    const uniforms = this.imageMaterial.uniforms;
    uniforms.stride.value = this.stride;
    uniforms.samples.value = Math.min(samples, this.stride);
    uniforms.line.value = Math.max(1, Math.round(1.1 * this.stride * window.devicePixelRatio));
    uniforms.height.value = this.canvas.height;
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.imageScene, this.imageLens);
    this.cells.sent();
    this.afterDraw();
  }

  private drawCells(): void {
    const target = this.targetOf(this.stride);
    const { lens } = this.camera;
    const uniforms = this.cellMaterial.uniforms;
    const pixels = target.height / (2 * Math.tan((lens.fov * Math.PI) / 360));
    uniforms.has_hidden.value = this.cells.hasHidden;
    uniforms.point_size.value = pixels * this.mesh!.pointSize;
    this.renderer.setRenderTarget(target);
    this.renderer.setClearColor(0, 0);
    this.renderer.clear();
    this.renderer.render(this.cellScene, lens);
    const image = this.imageMaterial.uniforms;
    image.ids.value = target.textures[0];
    image.lights.value = target.textures[1];
    image.depths.value = target.depthTexture;
    (image.near_far.value as Vector2).set(lens.near, lens.far);
    this.target = target;
    this.isStale = false;
  }

  private targetOf(stride: number): WebGLRenderTarget {
    const known = this.targets.get(stride);
    if (known) return known;
    const { width, height } = this.canvas;
    const target = new WebGLRenderTarget(stride * width, stride * height, {
      count: 2, minFilter: NearestFilter, magFilter: NearestFilter, generateMipmaps: false,
      depthTexture: new DepthTexture(stride * width, stride * height, UnsignedIntType),
    });
    this.targets.set(stride, target);
    return target;
  }

  /** Cells seen in a rectangle of the page's pixels, rows from below; `NONE` where there is none. */
  cellsSeen(left: number, top: number, width: number, height: number): Seen {
    if (this.isStale || !this.target) this.draw(1);
    const scale = (this.stride * this.canvas.width) / this.canvas.clientWidth;
    const [w, h] = [Math.max(1, Math.ceil(width * scale)), Math.max(1, Math.ceil(height * scale))];
    const x = Math.floor(left * scale);
    const y = this.target!.height - Math.floor(top * scale) - h;
    const bytes = new Uint8Array(4 * w * h);
    this.renderer.readRenderTargetPixels(this.target!, x, y, w, h, bytes);
    const cells = new Uint32Array(bytes.buffer);
    for (let i = 0; i < cells.length; i++) cells[i] -= 1; // 0 wraps around to NONE
    return { cells, width: w, height: h, scale, left, top };
  }

  /** How many new views a second can be drawn. */
  framesPerSecond(count = 10): number {
    const start = performance.now();
    for (let i = 0; i < count; i++) {
      this.camera.orbit(0.02, 0);
      this.stride = 1;
      this.draw(1);
      this.pixel(0, 0); // waits for it
    }
    return (1000 * count) / (performance.now() - start);
  }

  /** Red, green and blue on the canvas, at a place in the page's pixels. */
  pixel(x: number, y: number): [number, number, number] {
    const gl = this.renderer.getContext();
    const scale = this.canvas.width / this.canvas.clientWidth;
    const bytes = new Uint8Array(4);
    gl.bindFramebuffer((gl as WebGL2RenderingContext).READ_FRAMEBUFFER, null);
    const row = this.canvas.height - 1 - Math.floor(y * scale);
    gl.readPixels(Math.floor(x * scale), row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    this.renderer.resetState();
    return [bytes[0], bytes[1], bytes[2]];
  }
}

export interface Seen {
  cells: Uint32Array;
  width: number;
  height: number;
  scale: number; // of these pixels to one of the page
  left: number;
  top: number;
}

export const NOT_SEEN = NONE;

function geometryOf(mesh: Mesh): BufferGeometry {
  const count = mesh.positions.length / 3;
  const numbers = mesh.triangles ?? Uint32Array.from({ length: count }, (_, i) => i);
  const attribute = new BufferAttribute(numbers, 1);
  attribute.gpuType = IntType; // whole numbers stay whole
  const geometry = new BufferGeometry();
  geometry.setAttribute("vertex", attribute);
  geometry.setDrawRange(0, numbers.length);
  return geometry;
}

function cellMaterial(): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: CELLS_VERTEX, fragmentShader: CELLS_FRAGMENT,
    blending: NoBlending, side: 2,
    uniforms: {
      vertices: { value: null }, sources: { value: null }, cells: { value: null },
      has_sources: { value: false }, has_hidden: { value: false }, is_cloud: { value: false }, point_size: { value: 1 },
    },
  });
}

function imageMaterial(): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: IMAGE_VERTEX, fragmentShader: IMAGE_FRAGMENT,
    blending: NoBlending, depthTest: false, depthWrite: false,
    uniforms: {
      ids: { value: null }, lights: { value: null }, depths: { value: null },
      regions: { value: null }, cells: { value: null },
      region_colors: { value: null }, class_colors: { value: null },
      stride: { value: 1 }, samples: { value: 1 }, line: { value: 1 },
      hovered: { value: NONE }, cursor: { value: NONE },
      has_borders: { value: true }, is_cloud: { value: false },
      near_far: { value: new Vector2(1, 2) }, height: { value: 1 },
      high: { value: new Color() }, low: { value: new Color() }, accent: { value: new Color() },
    },
  });
}
