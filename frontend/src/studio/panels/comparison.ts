// Comparison with another work file: agreement of the labels, and buttons that resolve differences.

import { fromBase64, toBase64 } from "../../shared/arrays";
import { button, element, make } from "../../shared/dom";
import { MARK_DIFFERS } from "../view/celltable";
import type { Agreement, CompareReply } from "../data/contract";
import { addTo } from "../data/labeling";
import type { Workbench } from "../workbench";
import { text } from "../text/index";

const words = text.comparison;
const PAUSE_MS = 400; // time after the last change of labels until the files are compared again

export class Comparison {
  private differing = new Uint32Array(0); // cells labeled differently in the two files
  private bare = new Uint32Array(0); // cells labeled only in the other file
  private readonly box = element("comparison");
  private readonly shown = new Set<number>(); // regions that `next` has shown in the current round
  private seq = -1; // number of steps of this file when the files were compared
  private waiting = 0; // timer of the next comparison

  constructor(private readonly workbench: Workbench) {
    const files = element<HTMLInputElement>("compare");
    files.addEventListener("change", () => void this.read(files));
    workbench.session.events.on("file", () => {
      this.differing = this.bare = new Uint32Array(0); // cells of the file that was open before
      this.box.hidden = true;
      void this.refresh();
    });
    workbench.session.events.on("regions", () => this.shown.clear());
    workbench.session.events.on("state", () => this.check());
    workbench.session.events.on("online", () => this.check());
    const reviewed = element<HTMLInputElement>("reviewed");
    reviewed.addEventListener("change", () => void workbench.session.change("review", { reviewed: reviewed.checked }));
    workbench.session.events.on("state", ({ is_reviewed, is_changed }) => {
      const isChanged = is_reviewed && (is_changed || workbench.session.nWaiting > 0);
      reviewed.checked = is_reviewed && !isChanged;
      element("reviewed-text").textContent = isChanged ? text.files.changed : text.files.reviewed;
    });
  }

  get isOpen(): boolean {
    return !this.box.hidden;
  }

  /** Whether the labels have changed since the files were compared. */
  private get isOutdated(): boolean {
    const { nWaiting, state } = this.workbench.session;
    return this.isOpen && (nWaiting > 0 || state.seq > this.seq);
  }

  /** If the table is outdated, dim the table and, after a pause, compare the files again. */
  private check(): void {
    this.box.ariaBusy = String(this.isOutdated);
    clearTimeout(this.waiting);
    if (this.isOutdated && this.workbench.session.online) this.waiting = window.setTimeout(() => void this.refresh(), PAUSE_MS);
  }

  /** Compare again with the file of the last comparison. */
  private async refresh(): Promise<void> {
    this.take(await this.workbench.session.compare());
  }

  private async read(field: HTMLInputElement): Promise<void> {
    const [file] = field.files ?? [];
    if (!file) return;
    field.value = ""; // so that the same file can be chosen again
    const { session } = this.workbench;
    try {
      const data = toBase64(new Uint8Array(await session.whileOpen(file.arrayBuffer())));
      this.shown.clear();
      const reply = await session.compare([{ name: file.name, data }]);
      this.take(reply);
      await (reply ? this.next() : this.refresh()); // if the file was refused, there is nothing to compare with
    } catch (error) {
      session.report(error);
    }
  }

  private take(reply: CompareReply | null): void {
    if (!reply) return;
    const cellsOf = (text: string): Uint32Array<ArrayBuffer> => new Uint32Array(fromBase64(text).buffer);
    [this.differing, this.bare] = [cellsOf(reply.differs), cellsOf(reply.bare)];
    const { cells } = this.workbench.drawing;
    cells.unmarkAll(MARK_DIFFERS);
    cells.mark(this.differing, MARK_DIFFERS, true);
    this.box.hidden = reply.agreement === null;
    if (reply.agreement) this.show(reply.agreement);
    this.seq = reply.seq;
    this.check();
  }

  private show({ name, labeled, share, classes }: Agreement): void {
    const row = (title: string, iou: number | null, kind: string): HTMLElement =>
      make("tr", { class: kind }, make("td", {}, title), make("td", {}, iou === null ? "-" : words.ratio(iou)));
    const rows = classes.flatMap((one) => [
      row(one.name, one.iou, "whole"),
      ...one.objects.map(({ object, mine, theirs, iou }) => {
        const name = words.object(one.name, object);
        return row(mine === null ? words.onlyTheirs(name) : theirs === null ? words.onlyMine(name) : name, iou, "part");
      }),
    ]);
    const head = make("tr", {}, make("th", {}, words.head), make("th", { title: words.iouTip }, words.iou));
    this.box.replaceChildren(
      make("p", {}, words.agreement(name, labeled, share)),
      make("table", {}, head, ...rows),
      make("div", { class: "row" },
        this.button(words.next, words.nextTip, this.differing, () => void this.next()),
        this.button(words.take, words.takeTip, this.differing, () => void this.settle("theirs")),
        this.button(words.keep, words.keepTip, this.differing, () => void this.settle("mine")),
      ),
      make("div", { class: "row" },
        this.button(words.add, words.addTip, this.bare, () => void this.accept(this.bare, "theirs")),
      ),
    );
  }

  private button(name: string, tip: string, cells: Uint32Array, run: () => void): HTMLButtonElement {
    const made = button(name, cells.length ? tip : words.noCells, run);
    made.disabled = !cells.length;
    return made;
  }

  /**
   * Among the regions not shown yet, go to the region with the largest area of differing labels. After the last
   * region, begin again with the largest area. Hidden cells are ignored.
   */
  async next(): Promise<void> {
    if (this.isOutdated) await this.refresh();
    const { workbench, shown } = this;
    const { areas } = workbench.session.mesh;
    const seen = this.differing.filter((cell) => !workbench.isHidden(cell));
    const sums = new Map<number, number>();
    for (const cell of seen) addTo(sums, workbench.regionOf(cell), areas[cell]);
    const regions = [...sums.keys()].sort((a, b) => sums.get(b)! - sums.get(a)! || a - b);
    if (!regions.length) return workbench.say(this.differing.length ? words.allHidden : words.none);
    const isAgain = regions.every((region) => shown.has(region));
    if (isAgain) shown.clear();
    const region = regions.find((one) => !shown.has(one))!;
    shown.add(region);
    workbench.setCursor(region);
    const [mine, theirs] = this.namesOf(seen.filter((cell) => workbench.regionOf(cell) === region));
    const line = words.shown(region, regions.indexOf(region) + 1, regions.length, mine, theirs);
    workbench.say(isAgain ? `${words.again} ${line}` : line);
  }

  /**
   * Names of two labels: the label of this file that has the largest area in `cells`, and the label of the other file
   * that has the largest area in the cells with the first label.
   */
  private namesOf(cells: Uint32Array): [mine: string, theirs: string] {
    const { workbench } = this;
    const { paints, theirs } = workbench.session;
    const mine = paints.mainPaint(cells);
    const other = theirs!.paints.mainPaint(cells.filter((cell) => paints.of[cell] === mine));
    return [workbench.paintName(mine), workbench.theirName(other)];
  }

  /** Resolve the differences in the active region: keep the labels of this file, or take the labels of the other file. */
  async settle(side: "mine" | "theirs"): Promise<void> {
    const { activeRegion, session: { regions, mesh } } = this.workbench;
    const inRegion = new Set(activeRegion < 0 ? [] : regions.cellsOf(activeRegion));
    if (this.isOutdated) await this.refresh();
    const cells = this.differing.filter((cell) => mesh === this.workbench.session.mesh && inRegion.has(cell));
    if (!cells.length) return this.workbench.say(words.noneHere);
    await this.accept(cells, side);
  }

  private async accept(cells: Uint32Array, side: "mine" | "theirs"): Promise<void> {
    const reply = await this.workbench.session.accept(cells, side);
    if (!reply) return; // an error message is shown
    this.take(reply);
    this.workbench.say(side === "mine" ? words.kept : words.taken);
  }
}
