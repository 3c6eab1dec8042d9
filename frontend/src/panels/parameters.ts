// Sliders of the segmentation, its levels, and how far it has come.

import type { Parameters, Range, SegmentLine } from "../contract";
import { make, part } from "../page";
import type { Session } from "../session";

type Name = "n_segments" | "alpha" | "eta_convex";

const SLIDERS: [Name, string][] = [
  ["n_segments", "Number of regions"],
  ["alpha", "Weight of creases"],
  ["eta_convex", "Weight of ridges"],
];
const STEPS = 1000;

export class ParametersPanel {
  private readonly fields = new Map<Name, HTMLInputElement>();
  private readonly outputs = new Map<Name, HTMLOutputElement>();
  private readonly smooth = make("input", { type: "checkbox", id: "smooth" });
  private ranges: Record<string, Range> = {};
  private isDragged = false;

  constructor(private readonly session: Session) {
    for (const [name, text] of SLIDERS) this.addSlider(name, text);
    part("sliders").append(make("label", { class: "check" }, this.smooth, " Smooth borders"));
    this.smooth.addEventListener("change", () => this.send(false));
    part("coarser").addEventListener("click", () => this.step(1));
    part("finer").addEventListener("click", () => this.step(-1));
    part("cancel").addEventListener("click", () => session.cancelSegmentation());
    session.events.on("state", () => this.show());
    session.events.on("segmenting", (line) => this.showStage(line));
  }

  private addSlider(name: Name, text: string): void {
    const output = make("output", { for: name });
    const field = make("input", { type: "range", id: name, min: "0", max: String(STEPS), step: "1" });
    field.addEventListener("input", () => {
      this.isDragged = true;
      this.showValue(name, this.valueOf(name));
      this.send(true);
    });
    field.addEventListener("change", () => {
      this.isDragged = false;
      this.send(false);
    });
    this.fields.set(name, field);
    this.outputs.set(name, output);
    part("sliders").append(make("label", { class: "slider", for: name }, text, output), field);
  }

  private valueOf(name: Name): number {
    const { min, max, scale } = this.ranges[name];
    const share = Number(this.fields.get(name)!.value) / STEPS;
    const value = scale === "log" ? min * (max / min) ** share : min + (max - min) * share;
    return name === "n_segments" ? Math.round(value) : Number(value.toPrecision(3));
  }

  private setValue(name: Name, value: number): void {
    const { min, max, scale } = this.ranges[name];
    const share = scale === "log" ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
    this.fields.get(name)!.value = String(Math.round(STEPS * share));
    this.showValue(name, value);
  }

  private showValue(name: Name, value: number): void {
    const text = value.toLocaleString("en", { maximumSignificantDigits: 4 });
    this.outputs.get(name)!.textContent = text;
    this.fields.get(name)!.setAttribute("aria-valuetext", text);
  }

  private send(preview: boolean): void {
    const parameters: Partial<Parameters> = { smooth: this.smooth.checked, level: null };
    for (const [name] of SLIDERS) if (this.ranges[name]) parameters[name] = this.valueOf(name);
    this.session.segment(parameters, preview);
  }

  private show(): void {
    const { parameters, ranges, levels, n_regions } = this.session.state;
    this.ranges = ranges;
    for (const [name] of SLIDERS) {
      this.fields.get(name)!.disabled = !ranges[name];
      if (ranges[name] && !this.isDragged) this.setValue(name, parameters[name]);
    }
    this.smooth.checked = parameters.smooth;
    const count = this.session.regions?.count ?? n_regions;
    part("level").textContent = `${count.toLocaleString("en")} regions`;
    const at = this.levelIndex();
    part<HTMLButtonElement>("finer").disabled = at <= 0;
    part<HTMLButtonElement>("coarser").disabled = at >= levels.length - 1;
  }

  /** Index among the levels, which go from fine to coarse. */
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
    part("cancel").hidden = line === null;
    part("segmenting").textContent = stageText(line, this.session.regions?.count ?? 0);
  }
}

function stageText(line: SegmentLine | null, count: number): string {
  if (line === null) return `${count.toLocaleString("en")} regions`;
  if (line.iteration !== undefined) return `Step ${line.iteration} …`;
  if (line.stage !== undefined) return `${line.stage[0].toUpperCase()}${line.stage.slice(1)} …`;
  return `${line.n_regions ?? count} regions in ${line.seconds?.toFixed(2) ?? "?"} s`;
}
