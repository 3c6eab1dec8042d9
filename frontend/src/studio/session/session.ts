// The open file: a copy of its state on the server, and the operations that the user can apply to it.

import { Api, ServerError, ServerGone } from "./api";
import { type Arrays, fromBase64, toBase64 } from "../../shared/arrays";
import type {
  ClassEntry, CompareReply, Effect, FileEntry, Parameters, Progress, SegmentLine, SplitReply, State,
} from "../data/contract";
import { Events } from "./events";
import { Paints, Regions } from "../data/labeling";
import { readPacket } from "../data/packet";
import { Mesh } from "../data/mesh";
import { type Side, stepName } from "../data/names";
import { remember, remembered } from "./remembered";
import { newStrokeId, Saver } from "./saver";
import { NOTHING_SUGGESTED, type Suggested, suggestedFrom } from "../data/suggested";
import { text } from "../text/index";

const words = text.session;

interface Kinds {
  file: Mesh;
  regions: Regions;
  painted: Uint32Array | null; // cells whose class or object has changed; null if all cells may have changed
  classes: ClassEntry[];
  state: State;
  segmenting: SegmentLine | null; // progress of the running segmentation; null if none is running
  online: boolean;
  message: string;
  error: string;
  files: FileEntry[];
  suggestions: Suggested;
}

/** A requested segmentation of a file. */
interface Wanted {
  fileId: number;
  parameters: Partial<Parameters>;
  preview: boolean;
}

/** A class to be saved. The server chooses a color if none is given. */
export type ClassDraft = Omit<ClassEntry, "color"> & { color?: string };

/** Another file was opened before a step of the old file could be done. */
class Dropped extends Error {}

/** Text of an error message. Status 403 means that the server was restarted with another token. */
function strangerLine(error: unknown): string {
  if (error instanceof ServerError && error.status === 403) {
    return words.restarted;
  }
  return error instanceof Error ? error.message : String(error);
}

const cellsIn = ({ cells }: Effect): Uint32Array => new Uint32Array(fromBase64(cells).buffer);

const RETRY_MS = 1000; // pause between attempts to reach a server that does not respond
const BEAT_MS = 5000; // interval between checks for changes made by other pages
// If the last segmentation took longer than this number of seconds, a new request aborts the running one;
// otherwise, the new request waits.
const SHORT_SECONDS = 0.4;

export class Session {
  readonly events = new Events<Kinds>();
  files: FileEntry[] = [];
  fileId = -1;
  mesh!: Mesh; // like the next members, undefined until the first file is open
  regions!: Regions;
  paints!: Paints;
  state!: State;
  suggested = NOTHING_SUGGESTED;
  theirs: { classes: ClassEntry[]; paints: Paints } | null = null; // labels of the other file in a comparison; null if no file is compared
  online = true;
  outage = new Error(); // why strokes cannot be saved, if `online` is false
  // Time at which the server saved the latest step; null if nothing was saved since the file was opened.
  savedAt: Date | null = null;
  isLocked = false; // whether strokes that paint a class skip cells that already have one
  private saver!: Saver;
  private segmentation: AbortController | null = null;
  private segmenting: Promise<void> = Promise.resolve();
  private wanted: Wanted | null = null;
  private lastSeconds = 0;
  private steps: Promise<unknown> = Promise.resolve(); // resolves when all steps queued by `alone` have finished
  private nSteps = 0; // number of running and queued steps
  private nLoads = 0; // number of times that regions were requested; only the last response is used

  constructor(private readonly api: Api) {
    setInterval(() => void this.beat(), BEAT_MS);
    // Another tab may have changed the labels while this page was in the background.
    window.addEventListener("focus", () => void this.beat());
  }

  get path(): string {
    return `/api/files/${this.fileId}`;
  }

  get nWaiting(): number {
    return this.saver?.count ?? 0;
  }

  /** Whether unsaved strokes are kept if the page is closed. */
  get isKept(): boolean {
    return this.saver?.isKept ?? true;
  }

  /** Whether no request is pending, so that the page shows the current state of the server. */
  get isIdle(): boolean {
    return !this.nSteps && !this.nWaiting && !this.wanted && !this.segmentation;
  }

  private check(fileId: number): void {
    if (fileId !== this.fileId) throw new Dropped(words.dropped);
  }

  /** The result of a promise. Throws an error if another file was opened meanwhile. */
  async whileOpen<T>(promise: Promise<T>): Promise<T> {
    const { fileId } = this;
    const value = await promise;
    this.check(fileId);
    return value;
  }

  /** Run a step of the open file, as `queued` does. The step is dropped if another file is opened before its turn. */
  private alone<T>(work: () => Promise<T>): Promise<T> {
    const { fileId } = this;
    return this.queued(() => {
      this.check(fileId);
      return work();
    });
  }

  /**
   * Run a step that reads or changes the whole state, after all earlier steps. Strokes are sent before
   * or after the step, never during it, because the page would then show wrong classes.
   */
  private queued<T>(work: () => Promise<T>): Promise<T> {
    this.nSteps++;
    const done = this.steps.then(async () => {
      const { saver } = this; // `work` may replace `this.saver`
      await saver?.flush();
      saver?.hold();
      try {
        return await work();
      } finally {
        this.nSteps--;
        saver?.release();
      }
    });
    this.steps = done.catch(() => undefined);
    return done;
  }

  /** Show a message about a file. If another file is open meanwhile, the message says which file it is about. */
  tell(line: string, fileId: number, kind: "message" | "error" = "message"): void {
    const name = this.files.find(({ id }) => id === fileId)?.name ?? "";
    this.events.emit(kind, fileId === this.fileId || line.includes(name) ? line : words.ofFile(name, line));
  }

  /** Like `alone`, but shows errors to the user. Returns false if an error occurred. */
  private async attempt(work: () => Promise<void>): Promise<boolean> {
    const { fileId } = this;
    try {
      if (!this.online) throw this.outage; // waiting for the server could take long
      await this.alone(work);
      return true;
    } catch (error) {
      this.report(error, fileId);
      return false;
    }
  }

  async loadFiles(): Promise<void> {
    this.files = await this.api.get<FileEntry[]>("/api/files");
    this.events.emit("files", this.files);
  }

  open(fileId: number): Promise<void> {
    this.cancelSegmentation();
    return this.segmenting.then(() => this.queued(() => this.openNow(fileId))).then(() => this.sendKept());
  }

  /** Send strokes that an earlier page could not send, and load the labels, which may have changed since. */
  private async sendKept(): Promise<void> {
    const { nWaiting: count, fileId } = this;
    if (!count) return;
    const isDone = await this.attempt(() => this.reload(true));
    if (isDone) this.tell(words.resent(count), fileId);
  }

  private async openNow(fileId: number): Promise<void> {
    if (this.nWaiting) throw new ServerGone();
    const path = `/api/files/${fileId}`;
    const state = await this.api.get<State>(`${path}/state`);
    const wanted = this.api.buffer(`${path}/mesh`).then((buffer) => new Mesh(buffer));
    const [mesh, paint, regions] = await Promise.all([
      wanted, this.api.buffer(`${path}/paint`), this.fetchRegions(path, state.revision, wanted),
    ]);
    this.fileId = fileId;
    this.nLoads++;
    this.savedAt = null;
    this.suggested = NOTHING_SUGGESTED;
    this.theirs = null;
    this.mesh = mesh;
    this.state = state;
    // The saver of the file that was open before may still send strokes.
    const ifOpen = <T>(run: (value: T) => void) => (value: T): void => {
      if (this.saver === saver) run(value);
    };
    const saver = (this.saver = new Saver(this.api, path, `superfacets ${state.work} ${state.input.sha256 ?? ""}`, {
      saved: ifOpen((reply) => this.mergeState(reply)),
      refused: ifOpen((error) => void this.refused(error)),
      gone: ifOpen((error) => this.lose(error)),
    }));
    this.takePaint(paint);
    this.regions = regions;
    this.events.emit("file", mesh);
    this.events.emit("suggestions", this.suggested); // none until `loadSuggestions`
    this.events.emit("classes", state.classes);
    this.events.emit("painted", null);
    this.events.emit("regions", this.regions);
    this.events.emit("state", this.state);
    await this.loadSuggestions();
  }

  private takePaint(paint: ArrayBuffer): void {
    this.paints = new Paints(new Uint32Array(paint), this.mesh.areas);
    for (const stroke of this.saver.strokes) this.setPaint(stroke.cells, stroke.paint);
  }

  private async loadPaint(): Promise<void> {
    this.takePaint(await this.api.buffer(`${this.path}/paint`));
    this.events.emit("painted", null);
  }

  private async fetchRegions(path: string, revision: number, mesh: Mesh | Promise<Mesh>): Promise<Regions> {
    const [labels, graph, { areas }] = await Promise.all([
      this.api.buffer(`${path}/labels?revision=${revision}`),
      this.api.buffer(`${path}/regions?revision=${revision}`), mesh,
    ]);
    return new Regions(new Int32Array(labels), areas, graph, revision);
  }

  private async loadRegions(revision: number): Promise<void> {
    const load = ++this.nLoads;
    const regions = await this.fetchRegions(this.path, revision, this.mesh);
    if (load !== this.nLoads) return;
    this.regions = regions;
    this.events.emit("regions", regions);
  }

  /** Parts of faces beyond the smooth borders of the current regions. No parts if they cannot be computed. */
  borders(): Promise<Arrays> {
    const buffer = this.api.buffer(`${this.path}/borders?revision=${this.regions.revision}`);
    return buffer.then((whole) => readPacket(whole).arrays).catch(() => ({}));
  }

  private async loadSuggestions(): Promise<void> {
    const isNone = !this.state.n_suggestions;
    this.suggested = isNone ? NOTHING_SUGGESTED : suggestedFrom(await this.api.buffer(`${this.path}/suggestions`));
    this.events.emit("suggestions", this.suggested);
  }

  /** Merge a state sent by the server into the current state, unless the current state is newer. */
  private mergeState(news: Partial<State>): void {
    if (news.seq !== undefined && news.seq > this.state.seq) this.savedAt = new Date();
    if (news.seq === undefined || news.seq >= this.state.seq) Object.assign(this.state, news);
    this.events.emit("state", this.state);
  }

  private setPaint(cells: Uint32Array, paint: number): void {
    for (const cell of cells) this.paints.set(cell, paint);
  }

  /**
   * Give cells the class and object encoded by `paint`; 0 removes class and object. The change is shown
   * immediately and saved in the background. If `isLocked`, cells that have a class keep it. Returns the number of cells
   * that change.
   */
  paint(cells: Uint32Array, paint: number, strokeId = newStrokeId(), isLocked = this.isLocked): number {
    const { of } = this.paints;
    const keepsLabel = (cell: number): boolean => isLocked && paint !== 0 && of[cell] !== 0;
    const changed = cells.filter((cell) => of[cell] !== paint && !keepsLabel(cell));
    if (!changed.length) return 0;
    this.setPaint(changed, paint);
    this.saver.add({ paint, cells: changed, strokeId });
    this.events.emit("painted", changed);
    this.events.emit("state", this.state);
    return changed.length;
  }

  undo(): Promise<void> {
    return this.step("undo");
  }

  redo(): Promise<void> {
    return this.step("redo");
  }

  private async step(what: "undo" | "redo"): Promise<void> {
    const { fileId } = this;
    try {
      if (!this.online) throw new ServerGone();
      await this.alone(async () => {
        const reply = await this.post<Effect>(what);
        const cells = cellsIn(reply);
        const before = this.side(cells);
        await this.takeEffect(reply);
        const after = this.side(cells);
        const name = stepName(this, reply.kind, cells, what === "undo" ? [after, before] : [before, after]);
        this.events.emit("message", what === "undo" ? words.undone(name) : words.redone(name));
      });
    } catch (error) {
      if (error instanceof ServerError && error.status === 409) this.tell(what === "undo" ? words.nothingToUndo : words.nothingToRedo, fileId);
      else if (error instanceof ServerGone) {
        this.lose(error);
        this.events.emit("message", what === "undo" ? words.undoWaits : words.redoWaits);
      } else this.report(error, fileId);
    }
  }

  /**
   * Copy of the current lists of classes and object names, and of the current paint (class and object) of `cells`. Later
   * steps do not change the copy.
   */
  private side(cells: Uint32Array): Side {
    const { classes, object_names } = this.state;
    return { lists: { classes, object_names }, paint: cells.map((cell) => this.paints.of[cell]) };
  }

  private async takeEffect(reply: Effect): Promise<void> {
    const { kind, cells: _, paint: codedPaint, ...news } = reply;
    const cells = cellsIn(reply);
    const paint = new Uint32Array(fromBase64(codedPaint).buffer);
    cells.forEach((cell, i) => this.paints.set(cell, paint[i]));
    this.events.emit("painted", cells);
    for (const stroke of this.saver.strokes) {
      this.setPaint(stroke.cells, stroke.paint);
      this.events.emit("painted", stroke.cells);
    }
    if (kind !== "paint" && kind !== "settle") await this.reload();
    this.mergeState(news);
    if (kind === "settle") await this.loadSuggestions();
  }

  /**
   * Load the state again, labels if `withPaint` is set, changed regions, and suggestions if there are or were any.
   *
   * The state is fetched before the labels. If labels change in between, `beat` detects that `state.seq` is too low.
   */
  async reload(withPaint = false): Promise<void> {
    const state = await this.api.get<State>(`${this.path}/state`);
    if (withPaint) await this.loadPaint();
    if (state.seq > this.state.seq) this.savedAt = new Date();
    this.state = state;
    this.events.emit("classes", state.classes);
    if (state.revision !== this.regions.revision) await this.loadRegions(state.revision);
    if (state.n_suggestions || this.suggested.entries.length) await this.loadSuggestions();
    this.events.emit("state", this.state);
  }

  /** Accept suggestions, given as pairs of id and class, and reject other suggestions. Returns false on failure. */
  settle(accept: [number, number][], reject: number[]): Promise<boolean> {
    return this.attempt(async () => this.takeEffect(await this.post<Effect>("settle", { accept, reject })));
  }

  /** Segment with these parameters. If several requests are waiting, only the newest one is computed. */
  segment(parameters: Partial<Parameters>, preview: boolean): void {
    this.wanted = { fileId: this.fileId, parameters, preview };
    if (!this.segmentation) this.segmenting = this.segmentWanted();
    else if (this.lastSeconds > SHORT_SECONDS) this.segmentation.abort();
  }

  cancelSegmentation(): void {
    this.wanted = null;
    this.segmentation?.abort();
  }

  private async segmentWanted(): Promise<void> {
    while (this.wanted) {
      const { wanted } = this;
      this.wanted = null;
      const { signal } = (this.segmentation = new AbortController());
      try {
        await this.saver.flush();
        await this.segmentOnce(wanted, signal);
      } catch (error) {
        if (!signal.aborted) this.report(error, wanted.fileId);
      }
      this.segmentation = null;
    }
    this.events.emit("segmenting", null);
  }

  private async segmentOnce({ fileId, parameters, preview }: Wanted, signal: AbortSignal): Promise<void> {
    this.check(fileId);
    const started = performance.now();
    const body = { ...parameters, preview };
    this.events.emit("segmenting", { stage: text.parameters.starting });
    for await (const line of this.api.lines<SegmentLine>(`${this.path}/segment`, body, signal)) {
      this.check(fileId);
      if (line.error !== undefined) throw new ServerError(line.error, 400);
      if (line.cancelled) return;
      this.events.emit("segmenting", line);
      if (line.revision === undefined) continue;
      if (line.revision !== this.regions.revision) await this.loadRegions(line.revision);
    }
    this.lastSeconds = (performance.now() - started) / 1000;
    if (!preview) this.mergeState(await this.alone(() => this.api.get<State>(`${this.path}/state`)));
  }

  split(region: number, red: number[], blue: number[]): Promise<boolean> {
    return this.divide("split", { region, red, blue });
  }

  /** Divide a region into parts. */
  refine(region: number, parts: number): Promise<boolean> {
    return this.divide("refine", { region, parts });
  }

  private divide(what: string, body: object): Promise<boolean> {
    const { revision } = this.regions;
    return this.attempt(async () => {
      const reply = await this.post<SplitReply>(what, { ...body, revision });
      await this.loadRegions(reply.revision);
      this.mergeState(await this.api.get<State>(`${this.path}/state`));
    });
  }

  /** Regions similar to a region; empty if the request fails. */
  async similar(region: number, tolerance: number): Promise<number[]> {
    const { revision } = this.regions;
    let regions: number[] = [];
    await this.attempt(async () => {
      const body = { region, revision, tolerance };
      ({ regions } = await this.post<{ regions: number[] }>("similar", body));
    });
    return regions;
  }

  /** Edit the list of classes. `edit` receives the list that results from all earlier steps. */
  async setClasses(edit: (classes: ClassEntry[]) => ClassDraft[]): Promise<void> {
    const isDone = await this.attempt(async () => {
      await this.post<unknown>("classes", { classes: edit(this.state.classes) });
      // `reload` does not set `savedAt` for the class list of a folder, which is not saved as a step.
      this.savedAt = new Date();
      await this.reload();
    });
    if (!isDone) this.events.emit("classes", this.state.classes);
  }

  /** Write a file beside the work file. An existing file is replaced only if the user agrees. */
  async exportTo(format: string, what: string, replace = false): Promise<void> {
    const { fileId } = this;
    try {
      const { path } = await this.alone(async () => {
        const { labels } = this;
        const reply = await this.post<{ path: string }>("export", { format, what, replace });
        this.noteExport(labels);
        return reply;
      });
      this.tell(text.exchange.written(path), fileId);
    } catch (error) {
      const isThere = error instanceof ServerError && error.status === 409 && !replace;
      if (!isThere || fileId !== this.fileId) this.report(error, fileId);
      else if (confirm(text.exchange.replace(error.message))) await this.exportTo(format, what, true);
    }
  }

  /** A short text that identifies all labels and names: an FNV hash of the labels, and the names. */
  private get labels(): string {
    const { state: { classes, object_names }, paints } = this;
    let hash = 2166136261;
    for (const paint of paints.of) hash = Math.imul(hash ^ paint, 16777619);
    return JSON.stringify([hash, classes.map(({ id, name }) => [id, name]), object_names]);
  }

  private get exportKey(): string {
    return `superfacets exported ${this.state.work}`;
  }

  /** Call `start`, which downloads an export, as soon as all strokes are saved. Returns false on failure. */
  download(start: () => void): Promise<boolean> {
    return this.attempt(() => {
      if (this.nWaiting) throw new ServerGone();
      start();
      this.noteExport();
      return Promise.resolve();
    });
  }

  /** Remember which labels were exported last. */
  private noteExport(labels = this.labels): void {
    remember(this.exportKey, labels);
    this.events.emit("state", this.state);
  }

  /** Whether labels or names have changed since the last export. Takes time on large meshes once a file was exported. */
  get isExportOld(): boolean {
    const exported = remembered(this.exportKey);
    return exported !== null && exported !== this.labels;
  }

  downloadAddress(format: string, what: string): string {
    return this.api.address(`${this.path}/export`, { format, what });
  }

  thumbnailAddress(fileId: number): string {
    return this.api.address(`/api/files/${fileId}/thumbnail`);
  }

  async importFrom(files: { name: string; data: string }[], asSuggestions: boolean): Promise<void> {
    const { fileId } = this;
    if (!(await this.change("import", { files, as_suggestions: asSuggestions }))) return;
    const count = this.suggested.entries.length;
    this.tell(asSuggestions ? text.suggestions.imported(count) : text.exchange.imported, fileId);
  }

  /**
   * Compare with the given work file or, without `files`, with the file of the last comparison. Returns null on
   * failure.
   */
  async compare(files?: { name: string; data: string }[]): Promise<CompareReply | null> {
    return this.compared("compare", files ? { files } : {});
  }

  /** Resolve differences between two work files: the given cells get the labels of the given side. */
  async accept(cells: Uint32Array, side: "mine" | "theirs"): Promise<CompareReply | null> {
    return this.compared("accept", { cells: toBase64(cells), side });
  }

  private async compared(what: string, body: unknown): Promise<CompareReply | null> {
    let reply: CompareReply | null = null;
    const isDone = await this.attempt(async () => {
      reply = await this.post<CompareReply>(what, body);
      if (what === "accept") await this.reload(true);
      const { agreement, classes } = reply;
      const paint = await this.api.buffer(`${this.path}/theirs`);
      this.theirs = agreement && { classes, paints: new Paints(new Uint32Array(paint), this.mesh.areas) };
    });
    return isDone ? reply : null;
  }

  /** Run an operation that changes labels on the server, and load the new labels. Returns false on failure. */
  async change(what: string, body: unknown): Promise<boolean> {
    return this.attempt(async () => {
      await this.post<unknown>(what, body);
      await this.reload(true);
    });
  }

  private post<T>(what: string, body: unknown = {}): Promise<T> {
    if (!this.online) throw new ServerGone();
    return this.api.post<T>(`${this.path}/${what}`, body);
  }

  /** Show the message of an error of a file to the user. */
  report(error: unknown, fileId = this.fileId): void {
    if (error instanceof Dropped) return this.events.emit("message", error.message);
    if (error instanceof ServerGone) this.lose(error);
    const line = error instanceof Error ? error.message : String(error);
    const isWord = /^[a-z]+[ ,]/.test(line); // and not a file name, such as scan.ply
    this.tell(isWord ? `${line[0].toUpperCase()}${line.slice(1)}` : line, fileId, "error");
  }

  /** Handle a stroke that the server rejected: show the error, and load the labels from the server. */
  private async refused(error: unknown): Promise<void> {
    this.report(error);
    await this.attempt(() => this.reload(true));
  }

  private lose(why: Error): void {
    if (this.online) setTimeout(() => void this.tryAgain(), RETRY_MS);
    this.online = false;
    this.outage = why;
    this.events.emit("online", false);
  }

  private async tryAgain(): Promise<void> {
    const { path, mesh } = this;
    try {
      if (!mesh) { // the first file could not be opened
        await this.loadFiles();
        return location.reload();
      }
      const state = await this.api.get<State>(`${path}/state`, "short");
      if (state.input.n_cells !== mesh.nCells) throw new Error(words.otherServer);
      await this.alone(async () => {
        if (this.nWaiting) throw new ServerGone();
        await this.loadRegions((await this.api.get<State>(`${this.path}/state`)).revision);
        await this.reload(true);
      });
      this.online = true;
      this.events.emit("online", true);
    } catch (error) {
      this.online = false;
      if (!(error instanceof ServerGone || error instanceof Dropped)) this.events.emit("error", strangerLine(error));
      setTimeout(() => void this.tryAgain(), RETRY_MS);
    }
  }

  /** Check that the server responds, and load the labels if another page has changed them. */
  private async beat(): Promise<void> {
    if (!this.online || !this.state || !this.isIdle || document.hidden) return;
    try {
      await this.alone(async () => {
        const { seq } = await this.api.get<Progress>(`${this.path}/state`, "short");
        if (seq !== this.state.seq) await this.reload(true);
      });
    } catch (error) {
      if (error instanceof ServerGone) this.lose(error);
    }
  }
}
