// The own colors of a mesh or cloud: its texture or, without a texture, the colors of its vertices, points or cells.

import type { Arrays } from "./arrays";
import { type Gpu, opaque, Table, type Values } from "./gl";
import type { Shape, ShapeFacts } from "./shape";
import { TEXTURE, TexturePaint } from "./texture";

/** Function `ownColor()`: own color of the current pixel. A shader must include LIGHT and EYE before OWN_COLORS. */
export const OWN_COLORS = `${TEXTURE}
uniform bool has_own_colors;
uniform sampler2D own_colors;  // color of each vertex or point, if are_of_vertices; otherwise of each cell
uniform bool are_of_vertices;
flat in uint triangle;
in vec3 tint;
vec3 ownColor() {
  if (has_texture) return textureColor(triangle, at);
  return are_of_vertices ? tint : texelFetch(own_colors, place(cell), 0).rgb;
}
`;

/**
 * Function `tinted()`: a color with the hue of `color` and with its chroma, limited to sRGB at the new lightness, which
 * is between both colors. With part 1, the result is the own color. Computed in OKLab (Ottosson, 2020) with gamma 2.2.
 */
export const TINTED = `
const mat3 LMS = mat3(0.4122, 0.2119, 0.0883, 0.5363, 0.6807, 0.2817, 0.0514, 0.1074, 0.6300);
const mat3 LAB = mat3(0.2105, 1.9780, 0.0259, 0.7936, -2.4286, 0.7828, -0.0041, 0.4506, -0.8087);
const mat3 FROM_LMS = inverse(LMS);
const mat3 FROM_LAB = inverse(LAB);
vec3 oklab(vec3 color) { return LAB * pow(LMS * pow(color, vec3(2.2)), vec3(1.0 / 3.0)); }
vec3 linearOf(vec3 lab) { return FROM_LMS * pow(max(FROM_LAB * lab, 0.0), vec3(3.0)); }
vec3 tinted(vec3 color, vec3 own, float part) {
  if (part >= 1.0) return own;
  vec3 lab = oklab(color);
  lab.x = mix(lab.x, oklab(own).x, part);
  float chroma = 1.0;  // fraction of the chroma; bisection finds the largest that sRGB has
  for (float width = 0.5; width > 0.01; width *= 0.5) {
    vec3 found = linearOf(vec3(lab.x, chroma * lab.yz));
    bool fits = all(greaterThan(found, vec3(-0.002))) && all(lessThan(found, vec3(1.002)));
    chroma = fits ? min(1.0, chroma + width) : chroma - width;
  }
  return pow(clamp(linearOf(vec3(lab.x, chroma * lab.yz)), 0.0, 1.0), vec3(1.0 / 2.2));
}
`;

export const hasOwnColors = ({ texture }: ShapeFacts, arrays: Arrays): boolean =>
  !!(texture || arrays.vertex_colors || arrays.cell_colors);

export class OwnColors {
  isShown = false;
  private areOfVertices = false;
  private wanted: Shape | null = null; // mesh or cloud whose colors are shown, or will be shown when its image is decoded
  private readonly texture: TexturePaint;
  private readonly colors: Table;

  constructor(gpu: Gpu) {
    this.texture = new TexturePaint(gpu);
    this.colors = new Table(gpu);
    this.clear();
  }

  get bytes(): number {
    return this.texture.bytes + this.colors.bytes;
  }

  /** Stop drawing the own colors of the previous mesh. */
  clear(): void {
    this.wanted = null;
    this.isShown = this.areOfVertices = this.texture.isShown = false;
    this.colors.fill("rgba8", [0]);
  }

  /** Upload the colors, or the texture once its image is decoded. */
  async show(shape: Shape, arrays: Arrays): Promise<void> {
    const { vertex_colors, cell_colors } = arrays;
    const { texture } = shape.facts;
    this.wanted = shape;
    if (texture) {
      const kept = { ...arrays }; // the caller removes arrays that are drawn
      const blob = new Blob([arrays.atlas as Uint8Array<ArrayBuffer>], { type: "image/jpeg" });
      const image = await createImageBitmap(blob, { colorSpaceConversion: "none" });
      if (this.wanted !== shape) return;
      this.texture.show(shape, texture, kept, image);
    } else if (vertex_colors || cell_colors) {
      this.areOfVertices = vertex_colors !== undefined;
      this.colors.fill("rgba8", opaque((vertex_colors ?? cell_colors)!));
    }
    this.isShown = hasOwnColors(shape.facts, arrays);
  }

  /** Values of the uniforms that OWN_COLORS declares. */
  get values(): Values {
    const { texture, colors, isShown, areOfVertices } = this;
    return { ...texture.values, has_own_colors: isShown, own_colors: colors, are_of_vertices: areOfVertices };
  }
}

/** Slider for the opacity of own colors. */
export class Blend {
  opacity = 0; // 0 hides own colors, 1 hides all other colors

  constructor(private readonly row: HTMLElement, private readonly slider: HTMLInputElement, private readonly changed: () => void) {
    slider.addEventListener("input", () => this.set(Number(slider.value)));
  }

  set(opacity: number): void {
    this.opacity = opacity;
    this.slider.value = String(opacity);
    this.changed();
  }

  /** Show the slider and set the opacity if there are own colors; otherwise hide the slider. */
  begin(hasColors: boolean, opacity: number): void {
    this.row.hidden = !hasColors;
    this.set(hasColors ? opacity : 0);
  }

  /** Make the mesh's own colors opaque, or hide opaque colors. Returns false if the mesh has no own colors. */
  toggle(): boolean {
    if (!this.row.hidden) this.set(this.opacity === 1 ? 0 : 1);
    return !this.row.hidden;
  }
}
