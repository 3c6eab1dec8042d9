// Controls, legend and tooltip of the page.

import type { Arrays, Numbers } from "../shared/arrays";
import { counted, element, make, onClick, percent } from "../shared/dom";
import { Blend, hasOwnColors } from "../shared/owncolors";
import { type Place, putTip } from "../shared/picking";
import { NONE, shapeOf } from "../shared/shape";
import { type Coloring, Content, type Facts, type Labeling } from "./content";
import { Drawing, type Rgb } from "./drawing";
import { Places } from "./places";

const MAX_LISTED = 40; // largest number of regions in the legend
const SECTIONS = ["", "-x", "+x", "-y", "+y", "-z", "+z"];
const PLAIN: Rgb = [205, 197, 184];
const GRAY: Rgb = [150, 150, 150];
// Arrays that only the GPU needs, and that are deleted after upload to free memory.
const UPLOADED = ["triangles", "edges", "normals", "pairs", "tile_of", "atlas", "vertex_colors", "cell_colors"];

function shortNumber(value: number): string {
  const size = Math.abs(value);
  if (size && (size < 1e-4 || size >= 1e9)) return value.toExponential(3);
  return value.toLocaleString("en", { maximumSignificantDigits: 4 });
}

const cssColor = (colors: Numbers, i: number): string => `rgb(${colors.subarray(3 * i, 3 * i + 3).join()})`;

export class Panel {
  readonly content: Content;
  readonly drawing: Drawing;
  readonly colored: Promise<void>; // resolves when the texture or the colors have been uploaded
  private coloring: Coloring;
  level = 0;
  private readonly list = element<HTMLSelectElement>("coloring");
  private readonly slider = element<HTMLInputElement>("level");
  private readonly places: Places;
  private readonly section = element<HTMLSelectElement>("section");
  private readonly share = element<HTMLInputElement>("share");
  private readonly inside = element<HTMLInputElement>("inside");
  private readonly checkbox = element<HTMLInputElement>("borders");
  readonly blend = new Blend(element("texture-row"), element<HTMLInputElement>("texture"), () => this.drawing.request());
  private readonly tip = element("tip");

  constructor(private readonly facts: Facts, arrays: Arrays) {
    const canvas = element<HTMLCanvasElement>("canvas");
    this.content = new Content(facts, arrays);
    const shape = shapeOf(facts, arrays);
    this.drawing = new Drawing(canvas, shape, arrays.edges);
    this.colored = this.drawing.setOwnColors(shape, arrays);
    this.places = new Places(shape, facts.n_cells);
    const hasColors = hasOwnColors(facts, arrays);
    for (const name of UPLOADED) delete arrays[name];
    this.drawing.lineWidth = (pixels, height) => this.lineWidth(pixels, height);
    this.coloring = this.content.colorings[0];
    this.fillControls();
    this.blend.begin(hasColors, this.coloring.kind === "plain" ? 1 : 0.5);
    new ResizeObserver(() => this.drawing.request()).observe(canvas);
    this.show();
  }

  /** The labels that the borders and the tooltip show; null if there are no labels. */
  private get labeling(): Labeling | null {
    if (this.coloring.kind === "truth") return this.content.truth;
    return this.content.levels[this.level] ?? this.content.truth;
  }

  /** Width of borders in CSS pixels: 2 % of the diameter of an average region, clamped to a range. */
  private lineWidth(pixels: number, height: number): number {
    const area = this.labeling?.mean_area ?? 0;
    const diameter = Math.sqrt((4 * area) / Math.PI) * pixels;
    return Math.max(0.6, Math.min(Math.max(1, height / 450), 0.02 * diameter));
  }

  private fillControls(): void {
    const { content, list, slider, checkbox } = this;
    content.colorings.forEach(({ name }, i) => list.add(new Option(name, String(i))));
    list.addEventListener("change", () => this.setColoring(Number(list.value)));
    element("coloring-row").hidden = content.colorings.length < 2;
    slider.max = String(Math.max(0, content.levels.length - 1));
    slider.addEventListener("input", () => this.setLevel(Number(slider.value)));
    element("level-row").hidden = content.levels.length < 2;
    element("borders-row").hidden = !this.drawing.nEdges;
    checkbox.addEventListener("change", () => this.setBorders(checkbox.checked));
    for (const name of SECTIONS) this.section.add(new Option(name ? `${name[1]}, ${name[0] === "-" ? "low" : "high"} side` : "none", name));
    this.section.addEventListener("change", () => this.setSection(this.section.value));
    this.share.addEventListener("input", () => this.setSection(this.section.value));
    this.inside.addEventListener("change", () => this.seeInside(this.inside.checked));
    const find = element<HTMLInputElement>("find");
    find.addEventListener("change", () => find.value && this.find(Number(find.value)));
    this.drawing.opacity = () => this.blend.opacity;
    onClick("reset", () => this.drawing.camera.home());
    onClick("theme", () => {
      const { dataset } = document.documentElement;
      const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
      dataset.theme = (dataset.theme ?? (isDark ? "dark" : "light")) === "dark" ? "light" : "dark";
    });
  }

  setColoring(i: number): void {
    this.coloring = this.content.colorings[i];
    this.list.value = String(i);
    this.show();
  }

  nextColoring(): void {
    const { colorings } = this.content;
    this.setColoring((colorings.indexOf(this.coloring) + 1) % colorings.length);
  }

  setLevel(level: number): void {
    this.level = Math.max(0, Math.min(this.content.levels.length - 1, level));
    this.slider.value = String(this.level);
    this.show();
  }

  setBorders(shown: boolean): void {
    this.drawing.borders = this.checkbox.checked = shown;
    this.drawing.request();
  }

  /** Show only one side of a section; "" shows the whole mesh. */
  setSection(name: string): void {
    this.section.value = name;
    this.share.hidden = !name;
    this.drawing.clip = this.places.section(name, Number(this.share.value));
    this.drawing.request();
  }

  /** Show the low side of the section along an axis, then the high side, then the whole mesh. */
  nextSection(axis: string): void {
    const { value } = this.section;
    this.setSection(value === `-${axis}` ? `+${axis}` : value === `+${axis}` ? "" : `-${axis}`);
  }

  /** Hide or show surfaces that are seen from behind. */
  seeInside(on: boolean): void {
    this.drawing.hidesBacks = this.inside.checked = on;
    this.drawing.request();
  }

  /** Go to the region with this number in the input. */
  private find(number: number): void {
    const { labeling } = this;
    const region = labeling?.ids ? labeling.ids.indexOf(number) : number;
    if (labeling && labeling.counts[region]) this.goTo(region);
    else element("status").textContent = `there is no region ${number}`;
  }

  /** Move the camera to a region of the current level, and highlight it. */
  goTo(region: number): void {
    const { drawing, drawing: { camera } } = this;
    const labels = this.content.labelsOf(this.labeling!);
    const sphere = this.places.sphereOf(region, labels);
    const facts = this.factsOf(labels.indexOf(region)).join(", ");
    element("status").textContent = sphere ? facts : `${facts} (inside the body)`;
    if (!sphere) return;
    const distance = Math.min(camera.distance * camera.zoom, camera.distanceFor(sphere.radius));
    camera.flyTo(drawing.bestPose(camera.posesAround(sphere.middle, sphere.middle, distance), labels, region));
    drawing.marked = region;
  }

  /** List the largest regions in the legend, unless cells are colored by a feature. */
  private listRegions(labeling: Labeling | null): void {
    const sizes = [...(labeling?.sizes ?? [])];
    const total = sizes.reduce((sum, size) => sum + size, 0);
    const largest = [...sizes.keys()].sort((a, b) => sizes[b] - sizes[a]).slice(0, MAX_LISTED);
    const rows = largest.map((region) => {
      const swatch = make("i");
      swatch.style.background = cssColor(labeling!.colors, region);
      const name = `${labeling!.name === "truth" ? "part" : "region"} ${labeling!.ids?.[region] ?? region}`;
      const row = make("button", { type: "button" }, swatch, make("span", {}, name), percent(sizes[region] / total));
      row.addEventListener("click", () => this.goTo(region));
      return make("li", {}, row);
    });
    element("list").replaceChildren(...rows);
    element("list-row").hidden = element("find-row").hidden = !rows.length;
  }

  /** Draw the selected coloring and level, and update the legend. */
  private show(): void {
    const { content, coloring, labeling, drawing } = this;
    const none = new Uint32Array(labeling ? 0 : this.facts.n_cells).fill(NONE);
    const labels = labeling ? content.labelsOf(labeling) : none;
    drawing.marked = NONE;
    drawing.setRegions(labels);
    if (coloring.kind === "feature") {
      const groups = content.groupsOf(coloring.feature, coloring.values);
      drawing.setGroups(groups, content.arrays.scale!, GRAY);
    } else if (labeling && coloring.kind !== "plain") {
      drawing.setGroups(labels, labeling.colors, GRAY);
    } else {
      drawing.setGroups(labels, new Uint8Array(3), PLAIN);
    }
    this.describe();
    this.tell(NONE);
  }

  private describe(): void {
    const { coloring, labeling, content, facts, slider } = this;
    const feature = coloring.kind === "feature" ? coloring.feature : null;
    const { levels } = content;
    const level = levels.length > 1 ? counted(levels[this.level].counts.length, "region") : "";
    element("level-text").textContent = level;
    slider.setAttribute("aria-valuetext", level);
    slider.disabled = coloring.kind === "truth";
    element("scale").hidden = !feature;
    if (feature) {
      const stops = Array.from({ length: 18 }, (_, i) => cssColor(content.arrays.scale!, 15 * i));
      element("scale-name").textContent = feature.name;
      element("scale-low").textContent = shortNumber(feature.low);
      element("scale-high").textContent = shortNumber(feature.high);
      element("scale-bar").style.background = `linear-gradient(to right, ${stops.join()})`;
    }
    const nGray = (feature ? feature.n_missing : labeling?.n_left_out) ?? 0;
    element("gray").hidden = !nGray;
    element("gray-text").textContent = feature
      ? `${counted(nGray, feature.of === "cell" ? facts.noun : "region")} without a value`
      : `${counted(nGray, facts.noun)} in no region`;
    this.listRegions(feature ? null : labeling);
    element("regions").hidden = !!feature || !labeling;
    const noun = coloring.kind === "truth" ? "part" : "region";
    element("regions").querySelectorAll("i").forEach((swatch, i) => {
      swatch.hidden = i >= (labeling?.counts.length ?? 0);
      if (labeling && !swatch.hidden) swatch.style.background = cssColor(labeling.colors, i);
    });
    element("regions-text").textContent = `${counted(labeling?.counts.length ?? 0, noun)}, neighbors in different colors`;
  }

  /** Lines of the tooltip for a cell. */
  private factsOf(cell: number): string[] {
    const { labeling, content, coloring, facts } = this;
    const lines: string[] = [];
    const region = labeling ? content.labelsOf(labeling)[cell] : NONE;
    if (!labeling) {
      lines.push(`${facts.noun} ${cell}`);
    } else if (region === NONE) {
      lines.push("no region");
    } else {
      lines.push(`${labeling.name === "truth" ? "part" : "region"} ${labeling.ids ? labeling.ids[region] : region}`);
      lines.push(counted(labeling.counts[region], facts.noun));
      lines.push(`${facts.measure} ${shortNumber(labeling.sizes[region])}`);
    }
    if (coloring.kind === "feature") {
      const value = content.valueOf(coloring.feature, coloring.values, cell);
      lines.push(`${coloring.name} ${value === null ? "none" : shortNumber(value)}`);
    }
    return lines;
  }

  /** Show the tooltip for a cell and highlight its region; NONE removes the tooltip and the highlight. */
  tell(cell: number, place: Place = { x: 0, y: 0 }): string[] {
    const { tip, labeling, drawing } = this;
    const lines = cell === NONE ? [] : this.factsOf(cell);
    const marked = cell !== NONE && labeling ? this.content.labelsOf(labeling)[cell] : NONE;
    if (marked !== drawing.marked) {
      drawing.marked = marked;
      drawing.request();
    }
    tip.hidden = cell === NONE;
    tip.textContent = lines.join("\n");
    if (!tip.hidden) putTip(tip, drawing.canvas, place);
    return lines;
  }

  tellAt(place: Place): string[] {
    return this.tell(this.drawing.cellAt(place), place);
  }

  /** Announce the cell in the middle of the canvas to keyboard users and screen readers. */
  tellMiddle(): void {
    const { clientWidth, clientHeight } = this.drawing.canvas;
    const lines = this.tellAt({ x: clientWidth / 2, y: clientHeight / 2 });
    element("status").textContent = lines.join(", ") || `no ${this.facts.noun} in the middle`;
  }
}
