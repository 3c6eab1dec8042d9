// The classes: which one is painted, their names, colors and shares of the area.

import { nextClassColor } from "../colors";
import type { ClassEntry } from "../contract";
import type { Desk } from "../desk";
import { make, part, percent } from "../../shared/dom";

const KEYS = ["1", "2", "3", "4", "5", "6", "7", "8", "9"];

export class ClassesPanel {
  private readonly box = part("classes");
  private readonly shares = new Map<number, HTMLOutputElement>();
  private readonly removers = new Map<number, HTMLButtonElement>();

  constructor(private readonly desk: Desk) {
    const { session } = desk;
    session.events.on("classes", (classes) => this.fill(classes));
    session.events.on("state", () => this.showShares());
    session.events.on("cells", () => this.showShares());
    desk.events.on("class", (id) => this.check(id));
    part("add-class").addEventListener("click", () => this.add());
    part("undo").addEventListener("click", () => void session.undo());
    part("redo").addEventListener("click", () => void session.redo());
    part("next-bare").addEventListener("click", () => desk.showLargestBare());
  }

  private get classes(): ClassEntry[] {
    return this.desk.session.state.classes;
  }

  private fill(classes: ClassEntry[]): void {
    this.shares.clear();
    this.removers.clear();
    const none: ClassEntry = { id: 0, name: "No class (erases)", color: "", key: "0" };
    this.box.replaceChildren(...[...classes, none].map((entry) => this.row(entry)));
    this.check(this.desk.currentClass);
    this.showShares();
  }

  private row(entry: ClassEntry): HTMLElement {
    const { id, name, key } = entry;
    const radio = make("input", {
      type: "radio", name: "class", value: String(id), "aria-label": `Paint ${name}`,
    });
    radio.addEventListener("change", () => this.desk.choose(id));
    const share = make("output");
    this.shares.set(id, share);
    const row = make("div", { class: "class" }, radio, make("kbd", {}, key || " "));
    if (id === 0) row.append(make("span", { class: "none" }, name), share);
    else row.append(this.colorField(entry), this.nameField(entry), share, this.remover(entry));
    row.addEventListener("click", (event) => {
      if (event.target === row || (event.target as Element).matches("kbd, .none, output")) this.desk.choose(id);
    });
    return row;
  }

  private colorField({ id, name, color }: ClassEntry): HTMLElement {
    const field = make("input", { type: "color", value: color, "aria-label": `Color of ${name}` });
    field.addEventListener("change", () => this.change(id, { color: field.value }));
    return field;
  }

  private nameField({ id, name }: ClassEntry): HTMLElement {
    const field = make("input", { type: "text", value: name, "aria-label": `Name of ${name}` });
    field.addEventListener("change", () => {
      if (field.value.trim()) this.change(id, { name: field.value.trim() });
      else field.value = name;
    });
    field.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === "Escape") field.blur();
    });
    return field;
  }

  private remover({ id, name }: ClassEntry): HTMLElement {
    const button = make("button", { type: "button", "aria-label": `Delete ${name}` }, "×");
    button.addEventListener("click", () => {
      void this.desk.session.setClasses(this.classes.filter((entry) => entry.id !== id));
    });
    this.removers.set(id, button);
    return button;
  }

  private change(id: number, news: Partial<ClassEntry>): void {
    const classes = this.classes.map((entry) => (entry.id === id ? { ...entry, ...news } : entry));
    void this.desk.session.setClasses(classes);
  }

  private add(): void {
    const id = Math.max(0, ...this.classes.map((entry) => entry.id)) + 1;
    const color = nextClassColor(this.classes.map((entry) => entry.color));
    const key = KEYS.find((one) => !this.classes.some((entry) => entry.key === one)) ?? "";
    const entry = { id, name: `Class ${id}`, color, key };
    void this.desk.session.setClasses([...this.classes, entry]).then(() => this.desk.choose(id));
  }

  private check(id: number): void {
    const radio = this.box.querySelector<HTMLInputElement>(`input[type="radio"][value="${id}"]`);
    if (radio) radio.checked = true;
  }

  private showShares(): void {
    const { classes, state, nWaiting } = this.desk.session;
    if (!classes) return;
    const total = classes.totalArea || 1;
    for (const [id, output] of this.shares) {
      const share = Math.max(0, classes.areaOf.get(id) ?? 0) / total;
      output.textContent = percent(share);
      const remover = this.removers.get(id);
      if (!remover) continue;
      remover.disabled = share > 1e-9;
      remover.title = remover.disabled ? "Remove its paint first" : "";
    }
    part("progress-text").textContent = percent(classes.progress);
    part<HTMLProgressElement>("progress").value = classes.progress;
    part<HTMLButtonElement>("undo").disabled = !state.can_undo && !nWaiting;
    part<HTMLButtonElement>("redo").disabled = !state.can_redo;
  }
}
