// Panel with the classes and their objects: names, colors, percentage of the area, and the choice of what to paint.

import { withKey } from "../data/classkeys";
import type { ClassEntry } from "../data/contract";
import type { Workbench } from "../workbench";
import { classOf, objectOf, paintOf } from "../data/labeling";
import type { ClassDraft } from "../session/session";
import { allow, button, element, make, onClick } from "../../shared/dom";
import { text } from "../text/index";

const words = text.classes;

export class ClassesPanel {
  private readonly box = element("classes");
  private readonly shares = new Map<number, HTMLOutputElement>(); // elements that show the area percentage of each class or object; the key is class and object as one number
  private readonly removers = new Map<number, HTMLButtonElement>(); // delete buttons by class id
  private readonly keyBoxes = new Map<number, HTMLButtonElement>(); // buttons that assign a key, by class id
  private readonly lists = new Map<number, HTMLElement>(); // lists of objects by class id
  private shown = ""; // JSON of the objects that are listed
  private inView = -1; // the chosen class and object when the list was last scrolled to them
  private isOld = false; // whether the classes have changed since the list was built
  private nPending = 0; // number of edits that the server has not answered yet

  constructor(private readonly workbench: Workbench) {
    const { session } = workbench;
    session.events.on("classes", () => {
      this.isOld = true;
      this.renew();
    });
    this.box.addEventListener("focusout", () => setTimeout(() => this.renew())); // runs after the focus has moved to another element
    session.events.on("state", () => this.show());
    session.events.on("painted", () => this.show());
    workbench.events.on("current-paint", () => this.show());
    onClick("add-class", () => void this.add(false));
    onClick("add-stuff", () => void this.add(true));
    onClick("new-object", () => workbench.newObject());
    onClick("undo", () => void session.undo());
    onClick("redo", () => void session.redo());
    onClick("next-bare", () => workbench.showNextBare());
    const lock = element<HTMLInputElement>("lock");
    lock.addEventListener("change", () => workbench.lock(lock.checked));
  }

  private get classes(): ClassEntry[] {
    return this.workbench.session.state.classes;
  }

  /** Whether the user is editing a name. Rebuilding the list would then lose the typed text. */
  private get isNaming(): boolean {
    return this.box.contains(document.activeElement) && document.activeElement!.matches("[type=text]");
  }

  /** Show the current classes and objects, unless the user is editing a name or the server has not answered an edit. */
  private renew(): void {
    if (this.isNaming || this.nPending) return;
    if (!this.isOld) return this.show();
    this.isOld = false;
    const controls = (): HTMLElement[] => [...this.box.querySelectorAll<HTMLElement>("input, button, select")];
    const at = controls().indexOf(document.activeElement as HTMLElement);
    this.fill(this.classes);
    if (at < 0) return;
    const control = controls()[at];
    control?.closest(".class")?.querySelector("input")?.focus(); // a row shows its buttons only while it has the focus
    control?.focus();
  }

  private async during(edit: Promise<unknown>): Promise<void> {
    this.nPending++;
    await edit;
    this.nPending--;
    this.renew();
  }

  private fill(classes: ClassEntry[]): void {
    for (const map of [this.shares, this.removers, this.keyBoxes, this.lists]) map.clear();
    this.shown = "";
    const none: ClassEntry = { id: 0, name: text.erases, color: "", key: "0" };
    this.box.replaceChildren(...[...classes, none].flatMap((entry) => this.rows(entry)));
    this.show();
  }

  private rows(entry: ClassEntry): HTMLElement[] {
    const { id, name } = entry;
    const radio = this.radio(id, id ? words.choose(name) : words.chooseNone, () => this.workbench.choose(id));
    const share = this.share(id);
    const row = make("div", { class: "class" }, radio);
    if (id === 0) row.append(make("kbd", { title: words.key("0") }, "0"), make("span", { class: "none" }, name), share, this.hider(entry));
    else {
      row.append(this.keyBox(entry), this.colorField(entry), this.nameField(name, words.name(name), (typed) => this.change(id, { name: typed }), words.name(words.numbered(name, id))));
      row.append(share, this.stuffButton(entry), this.hider(entry), this.remover(entry));
    }
    row.addEventListener("click", (event) => {
      if (event.target === row || (event.target as Element).matches("kbd, .none, output")) this.workbench.choose(id);
    });
    const list = make("div", { class: "objects", role: "group", "aria-label": words.objects(name) });
    this.lists.set(id, list);
    return [row, list];
  }

  private radio(value: number, label: string, choose: () => void): HTMLInputElement {
    const radio = make("input", { type: "radio", name: "class", value: String(value), "aria-label": label, title: label });
    radio.addEventListener("change", choose);
    return radio;
  }

  private share(paint: number): HTMLOutputElement {
    const share = make("output", { title: words.share });
    this.shares.set(paint, share);
    return share;
  }

  /** Button that shows the key of a class; after a click, it waits for another key. */
  private keyBox({ id, name }: ClassEntry): HTMLElement {
    const box = this.button("", "", () => {
      box.classList.add("asking");
      box.textContent = "…";
      this.workbench.say(words.askKey(name));
    });
    box.className = "key";
    const end = (): void => {
      box.classList.remove("asking");
      this.showKeys();
    };
    box.addEventListener("blur", end);
    box.addEventListener("keydown", (event) => {
      if (!box.classList.contains("asking") || event.key === "Tab") return;
      event.stopPropagation(); // the key would choose a class
      event.preventDefault();
      const isNone = event.key === "Delete" || event.key === "Backspace";
      if (isNone || /^[1-9]$/.test(event.key)) void this.edit((classes) => withKey(classes, id, isNone ? "" : event.key));
      else if (event.key !== "Escape") return;
      end();
      this.workbench.say("");
      this.workbench.drawing.canvas.focus();
    });
    this.keyBoxes.set(id, box);
    return box;
  }

  private showKeys(): void {
    const { classKeys } = this.workbench;
    for (const [id, box] of this.keyBoxes) {
      if (box.classList.contains("asking")) continue;
      const [name, key] = [words.numbered(this.workbench.className(id), id), classKeys.keyOf(id)];
      const isAssigned = classKeys.isAssigned(key);
      box.textContent = key || "\u00a0";
      box.classList.toggle("assigned", isAssigned);
      box.title = !key ? words.noKey(name) : isAssigned ? words.assignedKey(key, name) : words.lentKey(key, name);
      box.ariaLabel = box.title;
    }
  }

  private colorField({ id, name, color }: ClassEntry): HTMLElement {
    const field = make("input", { type: "color", value: color, "aria-label": words.color(name), title: words.color(name) });
    field.addEventListener("change", () => this.change(id, { color: field.value }));
    return field;
  }

  private nameField(name: string, label: string, rename: (name: string) => void, tip = label): HTMLElement {
    const field = make("input", { type: "text", value: name, "aria-label": label, title: words.rename(tip) });
    let kept = name;
    field.addEventListener("focus", () => field.select());
    field.addEventListener("mousedown", (event) => {
      if (document.activeElement === field) return;
      event.preventDefault(); // the default action would clear the selection
      field.focus();
    });
    field.addEventListener("change", () => {
      field.value = field.value.trim() || kept;
      if (field.value !== kept) rename((kept = field.value));
    });
    field.addEventListener("keydown", (event) => {
      if (event.isComposing) return;
      if (event.key === "Escape") field.value = kept;
      if (event.key === "Enter" || event.key === "Escape") field.blur();
    });
    return field;
  }

  private button(name: string, label: string, run: () => void): HTMLButtonElement {
    const made = button(name, label, run);
    made.ariaLabel = label.toLowerCase().includes(name.toLowerCase()) ? label : `${name}: ${label}`; // speech control finds a button by its text
    return made;
  }

  private stuffButton({ id, name, stuff = false }: ClassEntry): HTMLElement {
    const label = stuff ? words.makeThings(name) : words.makeStuff(name);
    const made = this.button(words.stuff, label, () => this.change(id, { stuff: !stuff }));
    made.ariaPressed = String(stuff);
    made.classList.add("word");
    return made;
  }

  private hider({ id, name }: ClassEntry): HTMLElement {
    const made = this.button(words.hide, words.hideTip(id ? name : words.unlabeled), () => this.workbench.hideClass(id));
    made.classList.add("word");
    return made;
  }

  private remover({ id, name }: ClassEntry): HTMLElement {
    const made = this.button("×", words.remove(name), () => {
      void this.edit((classes) => classes.filter((entry) => entry.id !== id));
    });
    this.removers.set(id, made);
    return made;
  }

  private change(id: number, news: Partial<ClassEntry>): void {
    void this.edit((classes) => classes.map((entry) => (entry.id === id ? { ...entry, ...news } : entry)));
  }

  private edit(edit: (classes: ClassEntry[]) => ClassDraft[]): Promise<void> {
    return this.during(this.workbench.session.setClasses(edit));
  }

  /** Add a class and choose it. If no name is given, start editing the name. */
  async add(isStuff: boolean, name?: string): Promise<void> {
    const adder = element<HTMLButtonElement>(isStuff ? "add-stuff" : "add-class");
    adder.disabled = true; // pressing Enter again would add another class
    const { currentPaint } = this.workbench;
    let id = 0;
    await this.edit((classes) => {
      id = Math.max(0, ...classes.map((entry) => entry.id)) + 1;
      return [...classes, { id, name: name ?? words.usualName(id), key: "", stuff: isStuff }];
    });
    adder.disabled = false;
    const radio = this.box.querySelector(`input[name="class"][value="${id}"]`);
    if (!id || !radio) return; // the server rejected the new class
    if (this.workbench.currentPaint !== currentPaint) return; // the user has chosen another class in the meantime
    this.workbench.choose(id);
    if (name !== undefined) return this.workbench.say(words.isNew(name));
    radio.closest(".class")!.querySelector<HTMLInputElement>("[type=text]")!.focus();
  }

  /** Objects of a class that are listed: all objects with cells, and the chosen object. */
  private listed({ id }: ClassEntry): number[] {
    if (this.workbench.isStuff(id)) return [];
    const { currentPaint, session } = this.workbench;
    const found = new Set(session.paints.objectsOf(id));
    if (classOf(currentPaint) === id && objectOf(currentPaint)) found.add(objectOf(currentPaint));
    return found.size === 1 && found.has(0) ? [] : [...found].sort((a, b) => a - b);
  }

  private show(): void {
    const { session, currentPaint } = this.workbench;
    if (!session.paints || !this.lists.size) return;
    const wanted = this.classes.map((entry) => [entry.id, this.listed(entry)] as const);
    const shown = JSON.stringify([wanted, session.state.object_names, currentPaint]);
    if (shown !== this.shown && !this.isNaming) {
      this.fillObjects(wanted);
      this.shown = shown;
    }
    this.check();
    this.showKeys();
    this.showShares();
  }

  private fillObjects(wanted: (readonly [number, number[]])[]): void {
    const hadFocus = document.activeElement?.matches("input[name=object]");
    for (const paint of this.shares.keys()) if (objectOf(paint)) this.shares.delete(paint);
    for (const [id, objects] of wanted) {
      const rows = objects.flatMap((object) => this.objectRows(id, object, objects));
      this.lists.get(id)?.replaceChildren(...rows);
    }
    if (hadFocus) this.box.querySelector<HTMLInputElement>("input[name=object]:checked")?.focus();
  }

  private objectRows(id: number, object: number, all: number[]): HTMLDivElement[] {
    const { workbench } = this;
    const paint = paintOf(id, object);
    const name = object ? workbench.paintName(paint) : words.noObject;
    const swatch = make("i");
    swatch.style.background = workbench.paintColor(paint);
    const isChosen = paint === workbench.currentPaint;
    const radio = make("input", { type: "radio", name: "object", value: String(paint), "aria-label": words.choose(name), title: words.choose(name) });
    radio.checked = isChosen;
    radio.addEventListener("change", () => workbench.choose(id, object));
    const rename = (typed: string): void => void this.during(workbench.session.change("name-object", { class: id, object, name: typed }));
    const title = object ? this.nameField(name, words.name(name), rename) : make("span", { class: "none" }, name);
    const share = object ? this.share(paint) : make("output");
    const rows = [make("div", { class: "object" }, radio, swatch, title, share)];
    if (isChosen && workbench.session.paints.countOf.get(paint)) rows.push(this.actions(id, object, all));
    return rows;
  }

  /** Buttons for the chosen object. */
  private actions(id: number, object: number, all: number[]): HTMLDivElement {
    const { workbench } = this;
    const paint = paintOf(id, object);
    const name = workbench.paintName(paint);
    const merge = make("select", { "aria-label": words.mergeLabel(name), title: words.mergeTip });
    merge.append(make("option", { value: "" }, words.merge));
    for (const other of all) {
      if (other && other !== object) merge.append(make("option", { value: String(other) }, workbench.paintName(paintOf(id, other))));
    }
    merge.disabled = merge.options.length < 2;
    if (merge.disabled) merge.title = words.cannotMerge;
    merge.addEventListener("change", () => workbench.mergeObject(paintOf(id, Number(merge.value))));
    const split = this.button(words.split, words.splitTip(name), () => {
      void workbench.splitObject(paint);
    });
    const alone = this.button(words.alone, words.aloneTip(name), () => workbench.isolatePaint(paint));
    const remove = this.button(words.deleteObject, words.deleteObjectTip(name), () => workbench.deleteObject(paint));
    remove.classList.add("apart");
    return make("div", { class: "actions" }, merge, split, alone, remove);
  }

  private check(): void {
    const { currentPaint } = this.workbench;
    const radio = this.box.querySelector<HTMLInputElement>(`input[name="class"][value="${classOf(currentPaint)}"]`);
    if (!radio) return;
    radio.checked = true;
    if (currentPaint === this.inView) return; // the user may have scrolled the list
    this.inView = currentPaint;
    const object = this.box.querySelector("[name=object]:checked");
    for (const one of [radio, object]) one?.closest(".class, .object")?.scrollIntoView({ block: "nearest" });
  }

  private showShares(): void {
    const { paints, state, nWaiting } = this.workbench.session;
    const total = paints.totalArea || 1;
    const areas = paints.areaOfClass;
    for (const [paint, output] of this.shares) {
      const isObject = objectOf(paint) > 0;
      const share = Math.max(0, (isObject ? paints.areaOf.get(paint) : areas.get(paint)) ?? 0) / total;
      const count = paints.countOf.get(paint) ?? 0;
      output.textContent = !isObject ? text.percent(share) : count ? words.objectShare(count, share) : words.fresh;
      if (isObject) output.title = count ? words.objectShareTip : words.freshTip;
      const remover = isObject ? undefined : this.removers.get(paint);
      if (remover) allow(remover, share <= 1e-9, words.remove(this.workbench.className(paint)), words.cannotRemove);
    }
    element("progress-text").textContent = text.percent(paints.progress);
    element<HTMLProgressElement>("progress").value = paints.progress;
    element("effort").textContent = state.statistics ? text.files.effort(state.statistics.seconds, state.statistics.strokes) : "";
    const id = classOf(this.workbench.currentPaint);
    allow(element("new-object"), !this.workbench.isStuff(id), words.newObject, id ? words.hasNoObjects(this.workbench.className(id)) : words.chooseFirst);
    allow(element("undo"), state.can_undo || nWaiting > 0, words.undo, words.cannotUndo);
    allow(element("redo"), state.can_redo, words.redo, words.cannotRedo);
  }
}
