// WebGL 2 resources: shader programs, lookup tables stored in textures, images and framebuffers.

export const WIDTH = 2048; // width of lookup tables in texels; every WebGL 2 implementation supports it

/** A texture that is bound to a reserved texture unit. */
export interface Lookup {
  readonly unit: number;
}

export type Value = number | boolean | readonly number[] | Lookup;

export type Values = Record<string, Value>;

/** A GPU resource that must be created again after the WebGL context was lost. */
interface Held {
  make(): void;
}

/** Messages of errors. */
export const GRAPHICS = {
  none: "this browser has no WebGL 2",
  broken: (log: string): string => `a shader program cannot be built: ${log}`,
  tooLarge: "the mesh is too large for this graphics card",
};

export class Gpu {
  readonly gl: WebGL2RenderingContext;
  readonly isFirstProvoking: boolean; // whether flat varyings use the first vertex of a triangle instead of the last
  private nUnits = 0;
  private noBuffers: WebGLVertexArrayObject | null = null;
  private readonly held: Held[] = [];

  /** If `isKept`, the canvas keeps its pixels, and tables and images keep a copy in memory, which `restore` uploads again. */
  constructor(canvas: HTMLCanvasElement, readonly isKept: boolean, readonly messages = GRAPHICS) {
    const gl = canvas.getContext("webgl2", { antialias: false, powerPreference: "high-performance", preserveDrawingBuffer: isKept });
    if (!gl) throw new Error(messages.none);
    this.gl = gl;
    this.isFirstProvoking = this.begin();
  }

  private begin(): boolean {
    const { gl } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.DITHER); // colors encode cell numbers, which dithering would change
    gl.clearColor(0, 0, 0, 0);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.noBuffers = gl.createVertexArray();
    const extension = gl.getExtension("WEBGL_provoking_vertex");
    extension?.provokingVertexWEBGL(extension.FIRST_VERTEX_CONVENTION_WEBGL);
    return extension !== null;
  }

  hold(thing: Held): void {
    this.held.push(thing);
    thing.make();
  }

  /** Create all resources again after the WebGL context was lost. */
  restore(): void {
    this.begin();
    for (const thing of this.held) thing.make();
  }

  nextUnit(): number {
    return this.nUnits++;
  }

  /** Create a texture without filtering, and bind it to a texture unit. */
  texture(unit: number): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
    return texture;
  }

  /** Draw `count` vertices as triangles without attributes; the vertex shader uses only gl_VertexID. */
  drawNumbers(count: number): void {
    this.gl.bindVertexArray(this.noBuffers);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, count);
  }

  /** Read RGBA pixels of the bound framebuffer from a rectangle whose lower left corner is (x, y). */
  read(x: number, y: number, width: number, height: number): Uint8Array<ArrayBuffer> {
    const { gl } = this;
    const bytes = new Uint8Array(4 * width * height);
    gl.readPixels(x, y, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return bytes;
  }
}

export class Program implements Held {
  private program!: WebGLProgram;
  private readonly setters = new Map<string, (value: Value) => void>();

  constructor(private readonly gpu: Gpu, private readonly vertex: string, private readonly fragment: string) {
    gpu.hold(this);
  }

  make(): void {
    const { gl } = this.gpu;
    const program = (this.program = gl.createProgram());
    const shaders = [this.shader(gl.VERTEX_SHADER, this.vertex), this.shader(gl.FRAGMENT_SHADER, this.fragment)];
    gl.bindAttribLocation(program, 0, "vertex");
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = [...shaders.map((shader) => gl.getShaderInfoLog(shader)), gl.getProgramInfoLog(program)];
      throw new Error(this.gpu.messages.broken(logs.filter(Boolean).join(" ")));
    }
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) as number;
    for (let i = 0; i < count; i++) {
      const { name, type } = gl.getActiveUniform(program, i)!;
      this.setters.set(name, this.setter(type, gl.getUniformLocation(program, name)!));
    }
  }

  private shader(kind: GLenum, text: string): WebGLShader {
    const { gl } = this.gpu;
    const shader = gl.createShader(kind)!;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(this.program, shader);
    return shader;
  }

  private setter(type: GLenum, at: WebGLUniformLocation): (value: Value) => void {
    const { gl } = this.gpu;
    const setters: Record<GLenum, (value: never) => void> = {
      [gl.FLOAT]: (value: number) => gl.uniform1f(at, value),
      [gl.FLOAT_VEC2]: (value: number[]) => gl.uniform2fv(at, value),
      [gl.FLOAT_VEC3]: (value: number[]) => gl.uniform3fv(at, value),
      [gl.FLOAT_MAT3]: (value: number[]) => gl.uniformMatrix3fv(at, false, value),
      [gl.FLOAT_MAT4]: (value: number[]) => gl.uniformMatrix4fv(at, false, value),
      [gl.INT]: (value: number) => gl.uniform1i(at, value),
      [gl.BOOL]: (value: boolean) => gl.uniform1i(at, Number(value)),
      [gl.UNSIGNED_INT]: (value: number) => gl.uniform1ui(at, value),
    };
    const lookUp = ({ unit }: Lookup): void => gl.uniform1i(at, unit);
    return (setters[type] ?? lookUp) as (value: Value) => void;
  }

  /** Make this program current and set its uniforms. Names that the program does not use are ignored. */
  use(values: Values): void {
    this.gpu.gl.useProgram(this.program);
    for (const [name, value] of Object.entries(values)) this.setters.get(name)?.(value);
  }
}

type Texels = Uint8Array | Uint16Array | Uint32Array;

export type Format = "r32" | "rgba8" | "rgba8ui" | "rgba16" | "rgba32";

/** Lookup table for shaders: a texture with one or four numbers per index. */
export class Table implements Lookup, Held {
  readonly unit: number;
  bytes = 0;
  texels: Texels = new Uint8Array(0); // copy of the uploaded numbers; empty if the Gpu keeps no copies
  private format: Format = "r32";
  private first = Infinity; // first row changed since the last upload; Infinity if there is none
  private last = -1; // last row changed since the last upload; -1 if there is none

  constructor(private readonly gpu: Gpu) {
    this.unit = gpu.nextUnit();
    gpu.hold(this);
  }

  make(): void {
    this.gpu.texture(this.unit);
    if (this.texels.length) this.sendAll(this.texels);
  }

  private get layout(): [inner: GLenum, outer: GLenum, type: GLenum, channels: number, Type: new (n: number) => Texels] {
    const { gl } = this.gpu;
    const layouts: Record<Format, typeof this.layout> = {
      r32: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, 1, Uint32Array],
      rgba8: [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, 4, Uint8Array],
      rgba8ui: [gl.RGBA8UI, gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, 4, Uint8Array],
      rgba16: [gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, 4, Uint16Array],
      rgba32: [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4, Uint32Array],
    };
    return layouts[this.format];
  }

  /** Upload the numbers of all indices, as unsigned integers, and return the texture's size in bytes. */
  fill(format: Format, values: ArrayLike<number>): number {
    this.format = format;
    const [, , , channels, Type] = this.layout;
    const rows = Math.max(1, Math.ceil(values.length / channels / WIDTH));
    if (rows > this.gpu.gl.getParameter(this.gpu.gl.MAX_TEXTURE_SIZE)) {
      throw new Error(this.gpu.messages.tooLarge);
    }
    const texels = new Type(rows * WIDTH * channels);
    texels.set(values);
    if (this.gpu.isKept) this.texels = texels;
    this.sendAll(texels);
    return (this.bytes = texels.byteLength);
  }

  private sendAll(texels: Texels): void {
    const { gl } = this.gpu;
    const [inner, outer, type, channels] = this.layout;
    const rows = texels.length / channels / WIDTH;
    gl.activeTexture(gl.TEXTURE0 + this.unit);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, WIDTH, rows, 0, outer, type, texels);
    this.first = Infinity;
    this.last = -1;
  }

  /** Mark the row of an index as changed, so that `send` uploads it. */
  touch(index: number): void {
    const row = Math.floor(index / WIDTH);
    this.first = Math.min(this.first, row);
    this.last = Math.max(this.last, row);
  }

  /** Upload the range of rows that contains all changed rows. */
  send(): void {
    if (this.last < 0) return;
    const { gl } = this.gpu;
    const [, outer, type, channels] = this.layout;
    gl.activeTexture(gl.TEXTURE0 + this.unit);
    gl.texSubImage2D(
      gl.TEXTURE_2D, 0, 0, this.first, WIDTH, this.last - this.first + 1, outer, type,
      this.texels, this.first * WIDTH * channels,
    );
    this.first = Infinity;
    this.last = -1;
  }
}

/** Texels for the format "rgba8", from three bytes per color. */
export function opaque(colors: ArrayLike<number>): Uint8Array {
  const texels = new Uint8Array((4 * colors.length) / 3).fill(255);
  for (let i = 0; i < colors.length; i++) texels[i + ((i / 3) | 0)] = colors[i];
  return texels;
}

/** A texture with an image and its mipmaps; row 0 is the top row of the image. */
export class Picture implements Lookup, Held {
  readonly unit: number;
  bytes = 0;
  private image: ImageBitmap | null = null; // the image, kept for `restore`; null before `fill`, or if the Gpu keeps no copies

  constructor(private readonly gpu: Gpu) {
    this.unit = gpu.nextUnit();
    gpu.hold(this);
  }

  make(): void {
    const { gl } = this.gpu;
    this.gpu.texture(this.unit);
    if (this.image) this.fill(this.image);
    else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  }

  fill(image: ImageBitmap): void {
    const { gl } = this.gpu;
    this.image = this.gpu.isKept ? image : null;
    this.bytes = (16 * image.width * image.height) / 3;
    gl.activeTexture(gl.TEXTURE0 + this.unit);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST_MIPMAP_NEAREST);
  }
}

/** A framebuffer whose colors and depth are textures that shaders can read. */
export class Frame implements Held {
  readonly colors: Lookup[];
  readonly depth: Lookup;
  width = 0;
  height = 0;
  private target!: WebGLFramebuffer;

  constructor(private readonly gpu: Gpu, nColors: number) {
    this.colors = Array.from({ length: nColors }, () => ({ unit: gpu.nextUnit() }));
    this.depth = { unit: gpu.nextUnit() };
    gpu.hold(this);
  }

  make(): void {
    const { gl } = this.gpu;
    this.width = this.height = 0;
    this.target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    const attach = (place: GLenum, { unit }: Lookup): void =>
      gl.framebufferTexture2D(gl.FRAMEBUFFER, place, gl.TEXTURE_2D, this.gpu.texture(unit), 0);
    this.colors.forEach((color, i) => attach(gl.COLOR_ATTACHMENT0 + i, color));
    attach(gl.DEPTH_ATTACHMENT, this.depth);
    gl.drawBuffers(this.colors.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
  }

  private resize(width: number, height: number): void {
    const { gl } = this.gpu;
    const allot = ({ unit }: Lookup, inner: GLenum, outer: GLenum, type: GLenum): void => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, outer, type, null);
    };
    for (const color of this.colors) allot(color, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE);
    allot(this.depth, gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT);
    Object.assign(this, { width, height });
  }

  /** Resize the framebuffer if necessary, make it the target of draw calls, and clear it. */
  begin(width: number, height: number): void {
    const { gl } = this.gpu;
    if (this.width !== width || this.height !== height) this.resize(width, height);
    this.bind();
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  /** Copy the first color of another framebuffer, and make this framebuffer the target of draw calls. */
  copy(other: Frame): void {
    const { gl } = this.gpu;
    this.begin(other.width, other.height);
    other.bind();
    gl.activeTexture(gl.TEXTURE0 + this.colors[0].unit);
    gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 0, 0, other.width, other.height);
    this.bind();
  }

  /** Make the framebuffer the target of draw and read calls. */
  bind(): void {
    this.gpu.gl.bindFramebuffer(this.gpu.gl.FRAMEBUFFER, this.target);
  }
}
