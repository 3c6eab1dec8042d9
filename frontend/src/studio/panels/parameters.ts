// Panel with sliders for the parameters of the segmentation, buttons for its levels, and its progress.

import type { Parameters, Range, SegmentLine } from "../data/contract";
import { allow, element, make, onClick } from "../../shared/dom";
import type { Session } from "../session/session";
import { text } from "../text/index";

type Name = "n_segments" | "alpha" | "ridges";

interface Slider {
  name: Name;
  value: (position: number, range: Range) => number; // parameter value at a slider position from 0 to 1
  position: (value: number, range: Range) => number; // slider position of a parameter value
}

// The number of regions has a logarithmic scale. The weight of creases has a quadratic scale, which gives
// low values more space.
const SLIDERS: Slider[] = [
  {
    name: "n_segments",
    value: (position, [min, max]) => Math.round(min * (max / min) ** position),
    position: (value, [min, max]) => Math.log(value / min) / Math.log(max / min),
  },
  {
    name: "alpha",
    value: (position, [min, max]) => Number((min + (max - min) * position * position).toPrecision(3)),
    position: (value, [min, max]) => Math.sqrt((value - min) / (max - min)),
  },
  {
    name: "ridges",
    value: (position, [min, max]) => Number((min + (max - min) * position).toPrecision(3)),
    position: (value, [min, max]) => (value - min) / (max - min),
  },
];
const SWITCHES = ["smooth", "scans", "color"] as const;
type Switch = (typeof SWITCHES)[number];
const STEPS = 1000; // number of slider steps
const words = text.parameters;

export class ParametersPanel {
  private readonly fields = new Map<Name, HTMLInputElement>();
  private readonly outputs = new Map<Name, HTMLOutputElement>();
  private readonly switches = new Map<Switch, HTMLInputElement>();
  private readonly radius = make("input", { type: "number", id: "radius", min: "0", step: "any" });
  private ranges: Record<string, Range> = {};
  private readonly moved = new Set<Slider>(); // sliders moved since the last request that was not a preview

  constructor(private readonly session: Session) {
    for (const slider of SLIDERS) this.addSlider(slider);
    for (const one of SWITCHES) this.addSwitch(one);
    const label = make("label", { class: "slider", title: words.radiusTip }, `${words.radius} `, this.radius);
    this.radius.addEventListener("change", () => this.sendRadius());
    element("sliders").append(label);
    onClick("coarser", () => this.step(1));
    onClick("finer", () => this.step(-1));
    onClick("cancel", () => session.cancelSegmentation());
    session.events.on("state", () => this.show());
    session.events.on("segmenting", (line) => this.showStage(line));
  }

  private addSlider(slider: Slider): void {
    const { name } = slider;
    const output = make("output", { for: name });
    const field = make("input", { type: "range", id: name, min: "0", max: String(STEPS), step: "1" });
    const moved = (isPreview: boolean): void => {
      this.moved.add(slider);
      this.showValue(name, this.valueOf(slider));
      this.send(isPreview);
    };
    field.addEventListener("input", () => moved(true));
    field.addEventListener("change", () => moved(false));
    this.fields.set(name, field);
    this.outputs.set(name, output);
    element("sliders").append(make("label", { class: "slider", for: name }, words.names[name], output), field);
  }

  private addSwitch(name: Switch): void {
    const title = words.tips[name];
    const field = make("input", { type: "checkbox", id: name, title });
    field.addEventListener("change", () => this.send(false, name));
    this.switches.set(name, field);
    element("sliders").append(make("label", { class: "check", title }, field, ` ${words.names[name]}`));
  }

  /** Number of regions whose area is that of a disk with this radius (or volume of a ball), and the inverse function. */
  private get byRadius(): { count: (radius: number) => number; radius: (count: number) => number } {
    const { mesh: { measure }, paints: { totalArea } } = this.session;
    const [factor, power] = measure === "volume" ? [(4 / 3) * Math.PI, 3] : [Math.PI, 2];
    const unit = totalArea / factor;
    return { count: (radius) => unit / radius ** power, radius: (count) => (unit / count) ** (1 / power) };
  }

  private sendRadius(): void {
    const [min, max] = this.ranges.n_segments;
    const count = Math.round(this.byRadius.count(Number(this.radius.value)));
    this.session.segment({ n_segments: Math.max(min, Math.min(max, count || min)) }, false);
  }

  private valueOf({ name, value }: Slider): number {
    return value(Number(this.fields.get(name)!.value) / STEPS, this.ranges[name]);
  }

  private setValue(slider: Slider, value: number): void {
    const { name } = slider;
    this.showValue(name, value);
    if (this.valueOf(slider) === value) return; // several positions have this value, so the slider does not move
    const at = Math.round(STEPS * slider.position(value, this.ranges[name]));
    this.fields.get(name)!.value = String(Math.min(STEPS, Math.max(0, at || 0)));
  }

  private showValue(name: Name, value: number): void {
    const shown = text.measured(value);
    this.outputs.get(name)!.textContent = shown;
    this.fields.get(name)!.setAttribute("aria-valuetext", shown);
  }

  /** Send values only of moved sliders. The values of other sliders are rounded to slider positions. */
  private send(preview: boolean, changed?: Switch): void {
    const parameters: Partial<Parameters> = changed ? { [changed]: this.switches.get(changed)!.checked } : {};
    for (const slider of this.moved) parameters[slider.name] = this.valueOf(slider);
    if (!preview) this.moved.clear();
    this.session.segment(parameters, preview);
  }

  private show(): void {
    const { parameters, ranges, levels, n_regions, has_colors } = this.session.state;
    this.ranges = ranges;
    for (const slider of SLIDERS) {
      allow(this.fields.get(slider.name)!, !!ranges[slider.name], words.tips[slider.name], words.unavailable);
      const isFree = ranges[slider.name] && !this.moved.has(slider);
      if (isFree) this.setValue(slider, parameters[slider.name]);
    }
    for (const [name, field] of this.switches) field.checked = parameters[name];
    this.switches.get("color")!.disabled = !has_colors;
    this.switches.get("scans")!.disabled = this.session.mesh?.isCloud ?? false;
    if (this.session.paints) this.radius.value = this.byRadius.radius(parameters.n_segments).toPrecision(3);
    const count = this.session.regions?.count ?? n_regions;
    Object.assign(element("level"), { textContent: text.regions(count), title: words.countTip });
    const at = this.levelIndex();
    allow(element("finer"), at > 0, words.finer, words.finest);
    allow(element("coarser"), at < levels.length - 1, words.coarser, words.coarsest);
  }

  /** Index of the current level in `levels`, which runs from fine to coarse. */
  private levelIndex(): number {
    const { parameters, levels } = this.session.state;
    return parameters.level === null ? 0 : levels.indexOf(parameters.level);
  }

  private step(steps: number): void {
    const { levels } = this.session.state;
    const at = this.levelIndex() + steps;
    if (at < 0 || at >= levels.length) return;
    this.session.segment({ level: at === 0 ? null : levels[at] }, false);
  }

  private showStage(line: SegmentLine | null): void {
    element("cancel").hidden = line === null;
    const count = line?.n_regions ?? this.session.regions?.count ?? 0;
    const done = line ? words.done(count, line.seconds) : text.regions(count);
    const stage = line?.stage === undefined ? done : words.stage(line.stage);
    element("segmenting").textContent = line?.iteration === undefined ? stage : words.step(line.iteration);
  }
}
