// State shared by tools, keys and panels: open file, selection, and current class. Also shows regions and painted
// cells in the drawing.

import { element } from "../shared/dom";
import { NONE } from "../shared/shape";
import { dot, lengthOf, minus, plus, sphereOf, type Vector } from "../shared/vectors";
import { MARK_HIDDEN } from "./view/celltable";
import { cssColor, type Rgb, regionColors, shadesOfClasses, shadesOfObjects, usualShade } from "./data/colors";
import { ClassKeys } from "./data/classkeys";
import type { ClassEntry } from "./data/contract";
import { addTo, classOf, objectOf, paintOf, type Regions } from "./data/labeling";
import type { Drawing } from "./view/drawing";
import { Events } from "./session/events";
import { classNameIn, paintNameIn } from "./data/names";
import { Picker } from "./view/picker";
import { remember, rememberedValue } from "./session/remembered";
import type { Session } from "./session/session";
import { text } from "./text/index";

const MAX_OBJECT = 999; // highest object number of a class
const MIN_SEEN = 8; // if fewer pixels of cells are visible from every side, `fly` leaves out what hides them
const IN_SIGHT = 1 / 2000; // smallest part of the canvas in which a region is in sight: about 15 x 15 of 800 x 600 pixels
const MAX_NAMED = 3; // largest number of classes and objects that a message lists by name
const { hiding, objectMessages, painting, regionMessages } = text;

interface Kinds {
  "current-paint": number; // class and object that strokes assign, as one number (see `paintOf`)
  selection: ReadonlySet<number>;
  hover: number; // cell under the pointer; -1 if there is none
}

export class Workbench {
  readonly events = new Events<Kinds>();
  picker!: Picker;
  currentPaint = 0;
  classKeys = new ClassKeys(null);
  private keyless = 0; // class that lost its key to the class chosen last; 0 if there is none
  private shades: ReadonlyMap<number, Rgb[]> = new Map(); // colors of the objects of each class
  private objectShades: ReadonlyMap<number, number> = new Map(); // result of `shadesOfObjects`
  private stuff: ReadonlySet<number> = new Set(); // ids of classes without separate objects
  cursor = -1; // region selected by keyboard; -1 if there is none
  hoveredCell = -1;
  tolerance = 0.05; // `tolerance` of the Python function `similar_regions` for `fillSimilar`, 0 to 1
  nParts = 2; // number of parts into which `refineActive` divides a region
  readonly selection = new Set<number>();
  private readonly lastObjects = new Map<number, number>(); // last chosen object of each class
  private isFresh = true; // whether no class of this file was chosen yet
  private isPainted = false; // whether the selected regions were selected by painting them
  private smoothed: Regions | null = null; // regions whose borders were smoothed last
  private smoothing = Promise.resolve(); // resolves when no smooth borders are being computed
  private order: number[] = []; // order in which `moveCursor` visits the regions
  private readonly visited = new Set<number>(); // regions that `showNextBare` does not choose again before all others

  constructor(readonly session: Session, readonly drawing: Drawing) {
    const { events } = session;
    events.on("file", () => this.takeFile());
    events.on("regions", () => this.takeRegions());
    events.on("classes", (classes) => this.takeClasses(classes));
    drawing.onView.push(() => this.hoveredCell >= 0 && this.hover(-1)); // another cell may be under the pointer now
    drawing.afterView.push(() => this.sayIfEmpty(), () => void (this.smoothing = this.smoothing.then(() => this.smoothBorders())));
    events.on("painted", (cells) => {
      drawing.hasClasses = (session.paints.countOf.get(0) ?? 0) < session.paints.of.length;
      const bare = cells?.filter((cell) => !session.paints.of[cell] && drawing.cells.isHidden(cell)); // after an undo
      if (bare?.length) drawing.cells.mark(bare, MARK_HIDDEN, false);
      this.showPaint(cells);
    });
  }

  /** Show the paint of the given cells, or of all cells if `cells` is null or if an object gets another shade. */
  private showPaint(cells: Uint32Array | null): void {
    const { drawing, session, objectShades: before } = this;
    this.objectShades = shadesOfObjects(session.paints, session.regions);
    const isOther = [...this.objectShades].some(([paint, shade]) => shade !== (before.get(paint) ?? usualShade(objectOf(paint))));
    drawing.cells.setPaint(session.paints.of, isOther ? null : cells, this.stuff, this.objectShades);
  }

  private takeFile(): void {
    const { mesh } = this.session;
    this.lastObjects.clear();
    this.isFresh = true;
    this.classKeys = new ClassKeys(rememberedValue(this.keysName));
    this.drawing.setMesh(mesh);
    if (mesh.textureProblem) this.say(text.session.noTexture(mesh.textureProblem));
    this.picker = new Picker(this.drawing, mesh);
  }

  /** Draw smooth borders of the current regions. Until the server has computed them, borders of earlier regions stay smooth. */
  private async smoothBorders(): Promise<void> {
    const { session, session: { regions, mesh } } = this;
    if (!regions || this.smoothed === regions) return;
    const parts = await session.borders();
    if (mesh === session.mesh) this.drawing.setParts(parts);
    this.smoothed = regions;
  }

  private takeRegions(): void {
    const { regions, mesh } = this.session;
    this.selection.clear();
    this.cursor = -1;
    this.order = regions.neighbors.walk();
    this.session.events.emit("painted", new Uint32Array(0)); // other objects may touch now
    this.drawing.setLabels(regions.labels, regionColors(regions.neighbors, regions.count, mesh.palette), (region) => regions.cellsOf(region));
    this.drawing.mark({ hovered: this.regionOf(this.hoveredCell), cursor: -1 });
    this.events.emit("selection", this.selection);
  }

  private takeClasses(classes: ClassEntry[]): void {
    this.classKeys.take(classes);
    this.shades = shadesOfClasses(classes);
    this.drawing.setShades(this.shades);
    this.stuff = new Set(classes.filter((one) => one.stuff).map(({ id }) => id));
    this.session.events.emit("painted", null);
    const isKept = !this.isFresh && !this.currentPaint; // the user has chosen no class
    const entry = isKept ? undefined : classes.find(({ id }) => id === classOf(this.currentPaint)) ?? classes[0];
    this.isFresh = false;
    this.choose(entry?.id ?? 0);
  }

  /** Choose the class and object that strokes assign. By default, the last chosen object of the class is used. */
  choose(id: number, object = this.usualObject(id)): void {
    this.currentPaint = paintOf(id, this.isStuff(id) ? 0 : object);
    this.lastObjects.delete(id); // so that the classes are in the order in which they were used last
    this.lastObjects.set(id, object);
    const { labeledClasses } = this;
    this.keyless = this.classKeys.use(id, (other) => labeledClasses.has(other));
    remember(this.keysName, JSON.stringify(this.classKeys.stored));
    this.events.emit("current-paint", this.currentPaint);
  }

  private get labeledClasses(): Set<number> {
    return new Set([...this.session.paints.countOf].filter(([, n]) => n > 0).map(([paint]) => classOf(paint)));
  }

  /** All classes: those chosen in this file, from last to first, then classes of labeled cells, then all others. */
  get classesByUse(): ClassEntry[] {
    const { classes } = this.session.state;
    const first = [...[...this.lastObjects.keys()].reverse(), ...this.labeledClasses];
    const place = ({ id }: ClassEntry): number => (first.includes(id) ? first.indexOf(id) : first.length);
    return [...classes].sort((a, b) => place(a) - place(b));
  }

  /** Announce the chosen class and object, and the class that lost its key to the chosen class. */
  sayChosen(): void {
    const { currentPaint, keyless, classKeys } = this;
    const name = this.paintName(currentPaint);
    this.say(keyless ? text.isChosenByKey(name, classKeys.keyOf(classOf(currentPaint)), this.className(keyless)) : text.isChosen(name));
  }

  /** Name under which the browser stores the classes of keys: files of one folder share it. */
  private get keysName(): string {
    return `superfacets keys ${this.session.state.work.replace(/[^/\\]*$/, "")}`;
  }

  isStuff(id: number): boolean {
    return !id || this.stuff.has(id);
  }

  private usualObject(id: number): number {
    return this.lastObjects.get(id) ?? this.session.paints.objectsOf(id).pop() ?? 1;
  }

  /** Start a new object of the current class. Cells painted from now on belong to this object. */
  newObject(): void {
    const id = classOf(this.currentPaint);
    if (this.isStuff(id)) return this.say(id ? objectMessages.hasNoObjects(this.className(id)) : objectMessages.chooseFirst);
    const { paints, state } = this.session;
    const named = state.object_names.filter((one) => one.class === id).map((one) => one.object);
    const used = new Set([...paints.objectsOf(id), ...named]); // a deleted object keeps its name, because an undo can bring it back
    let object = 1;
    while (used.has(object)) object++;
    if (object > MAX_OBJECT) return this.say(objectMessages.most(MAX_OBJECT));
    this.choose(id, object);
    this.say(objectMessages.isNew(this.paintName(this.currentPaint)));
  }

  /** Merge an object into the current object. */
  mergeObject(paint: number): void {
    const { session, currentPaint } = this;
    if (!paint || paint === currentPaint) return this.say(objectMessages.noOther);
    if (classOf(paint) !== classOf(currentPaint)) return this.say(objectMessages.otherClass);
    const name = this.paintName(paint);
    this.session.paint(session.paints.cellsOf(classOf(paint), objectOf(paint)), currentPaint);
    this.say(objectMessages.merged(name, this.paintName(currentPaint)));
  }

  className(id: number): string {
    return classNameIn(this.session.state, id);
  }

  /** Name of the object of a paint (class and object) or, if the paint has no object, of its class. */
  paintName(paint: number): string {
    return paintNameIn(this.session.state, paint);
  }

  /** Color of a paint (class and object) as CSS; "none" if there is no such class. */
  paintColor(paint: number): string {
    const shades = this.shades.get(classOf(paint));
    return shades ? cssColor(shades[this.objectShades.get(paint) ?? usualShade(objectOf(paint))]) : "none";
  }

  /** Name of a paint (class and object) of the other file in a comparison. */
  theirName(paint: number): string {
    return paintNameIn({ ...this.session.state, classes: this.session.theirs?.classes ?? [] }, paint);
  }

  /** Remove class and object from all cells of an object. */
  deleteObject(paint: number): void {
    const { mesh, paints } = this.session;
    const [name, cells] = [this.paintName(paint), paints.cellsOf(classOf(paint), objectOf(paint))];
    this.session.paint(cells, 0);
    this.say(objectMessages.deleted(name, mesh.counted(cells.length)));
  }

  /** Make each connected piece of an object, except the largest piece, a new object. */
  async splitObject(paint: number): Promise<void> {
    const { session } = this;
    const [id, object] = [classOf(paint), objectOf(paint)];
    const before = new Set(session.paints.objectsOf(id));
    if (!(await session.change("split-object", { class: id, object }))) return;
    const names = [...session.paints.objectsOf(id)].filter((one) => !before.has(one)).sort((a, b) => a - b)
      .map((one) => this.paintName(paintOf(id, one)));
    if (names.length) this.say(objectMessages.split(names));
  }

  say(line: string): void {
    this.session.events.emit("message", line);
  }

  /** Show a message if no cell is in view. If the user has hidden all cells, another message already says so. */
  private sayIfEmpty(): void {
    const { drawing, session } = this;
    if (!session.paints) return;
    const isEmpty = drawing.isEmpty && !drawing.cells.isAllHidden;
    if (isEmpty) this.say(regionMessages.emptyView);
    else if (element("status").textContent === regionMessages.emptyView) this.say("");
  }

  /** Move the keyboard focus to the canvas, unless a link, button, list or text field has the focus. */
  takeFocus(): void {
    if (!document.activeElement?.matches("a, button, select, [type=text]")) this.drawing.canvas.focus();
  }

  regionOf(cell: number): number {
    return cell < 0 || !this.session.regions ? -1 : this.session.regions.labels[cell];
  }

  hover(cell: number): void {
    this.hoveredCell = cell;
    this.drawing.mark({ hovered: this.regionOf(cell) });
    this.events.emit("hover", cell);
  }

  /** The region that keys act on: the region under the pointer or, if there is none, the region selected by keyboard. */
  get activeRegion(): number {
    const hovered = this.regionOf(this.hoveredCell);
    return hovered >= 0 ? hovered : this.cursor;
  }

  select(regions: Iterable<number>, isPainted: boolean): void {
    this.drawing.select(this.selection, false);
    this.selection.clear();
    for (const region of regions) this.selection.add(region);
    this.isPainted = isPainted;
    if (!isPainted) this.drawing.select(this.selection, true);
    this.events.emit("selection", this.selection);
  }

  /** Return to the view before the last jump of the camera. */
  goBack(): void {
    this.drawing.setFocus(new Uint32Array(0), null);
    this.say(this.drawing.camera.back() ? text.views.wentBack : text.views.noEarlier);
  }

  /** Clear the selection and the region selected by keyboard. */
  clearSelection(): void {
    this.cursor = -1;
    this.drawing.mark({ cursor: -1 });
    this.drawing.setFocus(new Uint32Array(0), null);
    this.select([], false);
  }

  /** Paint regions and select them, so that `grow` and `shrink` can change the painted area. */
  paintRegions(regions: Iterable<number>, paint: number): void {
    const list = [...regions];
    if (!list.length) return;
    this.session.paint(this.session.regions.cellsOfAll(list), paint);
    this.select(list, true);
  }

  /** Go to the next (`step` is 1) or previous region that is not hidden; the first call goes to the nearest region. */
  moveCursor(step: 1 | -1): void {
    const { order } = this;
    const isShown = (region: number): boolean => this.session.regions.cellsOf(region).some((cell) => !this.isHidden(cell));
    const at = order.indexOf(this.cursor);
    const first = step > 0 ? at + 1 : at;
    const others = [...order.slice(first), ...order.slice(0, first)]; // the current region is the last one
    if (step < 0) others.reverse();
    const next = at < 0 ? this.nearestOf(order.filter(isShown)) : others.find(isShown) ?? -1;
    if (next < 0) this.say(regionMessages.allHidden);
    else this.setCursor(next);
  }

  setCursor(region: number): void {
    this.cursor = region;
    this.takeFocus();
    this.hover(-1);
    this.select([region], false);
    this.drawing.mark({ cursor: region });
    const isKept = !this.drawing.hasFocus && this.isInSight(region);
    const isOutside = isKept || this.fly(this.session.regions.cellsOf(region));
    const where = !isOutside ? regionMessages.inside : this.drawing.hasFocus ? regionMessages.uncovered : text.region;
    const { regions, paints, mesh } = this.session;
    const share = (100 * regions.areas[region]) / paints.totalArea;
    const name = this.paintName(paints.mainPaint(regions.cellsOf(region)));
    this.say(regionMessages.chosen(where(region), share, mesh.measure, name));
  }

  /**
   * Move the camera to cells. Unless `keepsAngles` is set, the camera also turns to the side from which most of the
   * cells is visible; if they are hidden from all sides, what hides them is left out. Returns false if all cells are
   * inside a tetrahedral mesh, where they cannot be seen.
   */
  fly(cells: Uint32Array, keepsAngles = false): boolean {
    const { mesh } = this.session;
    let normal: Vector = [0, 0, 0];
    const middles: Vector[] = [];
    for (const cell of cells) {
      const middle = mesh.middleOf(cell);
      if (!middle) continue;
      middles.push(middle);
      normal = plus(normal, mesh.normalOf(cell));
    }
    const sphere = sphereOf(middles);
    if (!sphere) return false;
    const { middle: place, radius: reach } = sphere;
    const { drawing, drawing: { camera } } = this;
    const distance = camera.distanceFor(reach);
    drawing.setFocus(cells, null);
    if (keepsAngles) {
      camera.fly(place, [0, 0, 0], distance);
      return true;
    }
    const poses = camera.posesAround(place, normal, Math.min(camera.distance * camera.zoom, distance)); // at most as far as zoom 1
    const counts = drawing.countSeen(poses, cells);
    const most = Math.max(...counts);
    if (most < MIN_SEEN) drawing.setFocus(cells, { middle: place, radius: Math.max(1.2 * reach, 0.02 * camera.size) });
    camera.flyTo(poses[most < MIN_SEEN ? 0 : counts.indexOf(most)]);
    return true;
  }

  /** Paint the selected regions or, if none is selected other than by painting, the active region. */
  paintActive(paint: number): void {
    const { activeRegion } = this;
    const list = this.selection.size && !this.isPainted ? [...this.selection] : [activeRegion];
    if (list[0] < 0) return this.say(regionMessages.none);
    const replaced = new Map<number, number>();
    this.countReplaced(list, paint, replaced);
    this.session.paint(this.session.regions.cellsOfAll(list), paint);
    this.sayPainted(list, paint, replaced);
  }

  /**
   * Add to `replaced`, for each main paint (class and object) that `paint` replaces, the number of regions that have it.
   */
  countReplaced(regions: Iterable<number>, paint: number, replaced: Map<number, number>): void {
    const { session: { paints, regions: all, isLocked } } = this;
    if (isLocked || !paint) return;
    for (const region of regions) {
      const old = paints.mainPaint(all.cellsOf(region), [0, paint]);
      if (old) addTo(replaced, old, 1);
    }
  }

  /** Warning that a stroke with this paint would replace the label of a cell; empty if it would not. */
  harmAt(cell: number, paint = this.currentPaint): string {
    const { paints, isLocked } = this.session;
    const old = cell < 0 ? 0 : paints.of[cell];
    if (!old || old === paint || isLocked) return "";
    return paint ? painting.replaces(this.paintName(paint), this.paintName(old)) : painting.erases(this.paintName(old));
  }

  /** Announce the new class and object of regions or cells, and the classes and objects that are replaced. */
  sayPainted(what: readonly number[] | string, paint: number, replaced: ReadonlyMap<number, number> = new Map(), more = ""): void {
    const name = typeof what === "string" ? what : painting.several(what);
    const { paints: { of }, regions, isLocked } = this.session;
    if (isLocked && paint && typeof what !== "string" && !regions.cellsOfAll(what).some((cell) => of[cell] === paint)) return this.say(painting.protected(name));
    if (!paint) return this.say(painting.erased(name));
    const was = [...replaced.keys()].map((old) => this.paintName(old));
    const names = was.length > MAX_NAMED ? painting.otherPaints(was.length) : text.list(was);
    const count = [...replaced.values()].reduce((sum, n) => sum + n, 0);
    const isOne = typeof what !== "string" && what.length === 1;
    const done = `${painting.done(name, this.paintName(paint))}${more}`;
    this.say(count ? `${done} ${isOne ? painting.wasReplaced(names) : painting.wereReplaced(count, names)}` : done);
  }

  /** A function that tells whether enough of a region is visible to label it without moving the camera. */
  private get isInSight(): (region: number) => boolean {
    const { cells } = this.picker.cellsSeen();
    const counts = new Uint32Array(this.session.regions.count);
    for (const cell of cells) if (cell !== NONE) counts[this.regionOf(cell)]++;
    return (region) => counts[region] >= IN_SIGHT * cells.length;
  }

  /** The candidate nearest to the target of the camera. Regions in sight come first; cells inside a body are far away. */
  private nearestOf(candidates: readonly number[]): number {
    const { drawing: { camera: { target } }, session: { mesh, regions } } = this;
    const seen = candidates.filter(this.isInSight);
    const distanceTo = (cell: number): number => {
      const middle = mesh.middleOf(cell);
      return middle ? lengthOf(minus(middle, target)) : Number.MAX_VALUE;
    };
    const distances = new Map((seen.length ? seen : candidates).map((region) =>
      [region, regions.cellsOf(region).reduce((least, cell) => Math.min(least, distanceTo(cell)), Infinity)]));
    return [...distances].reduce((best, one) => (one[1] < best[1] ? one : best), [-1, Infinity])[0];
  }

  /**
   * Go to the nearest region (see `nearestOf`) that is mostly unlabeled and has an unlabeled cell that is not hidden.
   * If an earlier call chose the current region, regions not chosen yet come first, and the current region comes last.
   */
  showNextBare(): void {
    const { regions, paints } = this.session;
    const isShown = (cell: number): boolean => !paints.of[cell] && !this.isHidden(cell);
    const bare = [...regions.areas.keys()].filter((region) => {
      const area = paints.bareArea(regions.cellsOf(region));
      return area > 0 && 2 * area >= regions.areas[region];
    });
    const shown = bare.filter((region) => regions.cellsOf(region).some(isShown));
    if (!shown.length) return this.say(bare.length ? regionMessages.allUnlabeledHidden : regionMessages.allLabeled);
    const { cursor, visited } = this;
    const isLeft = (region: number): boolean => !visited.has(region);
    if (!visited.has(cursor) || !shown.some(isLeft)) visited.clear();
    if (cursor >= 0 && shown.length > 1) visited.add(cursor);
    const next = this.nearestOf(shown.filter(isLeft));
    visited.add(next);
    this.setCursor(next);
  }

  grow(): void {
    if (!this.selection.size) return this.say(regionMessages.noneSelected);
    const { regions, paints } = this.session;
    let ring = regions.neighbors.ringAround(this.selection);
    if (this.isPainted) ring = ring.filter((r) => paints.mainPaint(regions.cellsOf(r)) === 0);
    if (!ring.length) return this.say(regionMessages.neighborsLabeled);
    const painted = paints.mainPaint(regions.cellsOfAll(this.selection));
    if (this.isPainted) this.session.paint(regions.cellsOfAll(ring), painted);
    this.select([...this.selection, ...ring], this.isPainted);
    this.say(regionMessages.grown(ring.length));
  }

  shrink(): void {
    const { regions } = this.session;
    const ring = regions.neighbors.outerRing(this.selection);
    if (!ring.length || ring.length === this.selection.size) return this.say(regionMessages.noRing);
    if (this.isPainted) this.session.paint(regions.cellsOfAll(ring), 0);
    const rest = [...this.selection].filter((region) => !ring.includes(region));
    this.select(rest, this.isPainted);
    this.say(regionMessages.shrunk(ring.length));
  }

  /** Paint the active region, and all similar unlabeled regions that are connected to it through such regions. */
  async fillSimilar(): Promise<void> {
    const { session, activeRegion, currentPaint, tolerance } = this;
    const { regions, isLocked, fileId } = session;
    if (activeRegion < 0) return this.say(regionMessages.noneActive);
    const mainPaint = (region: number): number => session.paints.mainPaint(regions.cellsOf(region));
    const isBare = (region: number): boolean => mainPaint(region) === 0;
    const own = mainPaint(activeRegion);
    const like = await session.similar(activeRegion, tolerance);
    if (!like.length) return; // the request failed, and an error message is shown
    if (session.regions !== regions || mainPaint(activeRegion) !== own) {
      return session.tell(regionMessages.changed, fileId);
    }
    const similar = new Set(like.filter(isBare));
    const filled = new Set<number>();
    for (let ring = [activeRegion]; ring.length; ring = regions.neighbors.ringAround(filled).filter((region) => similar.has(region))) {
      for (const region of ring) filled.add(region);
    }
    const left = like.filter((region) => !filled.has(region));
    const apart = left.filter(isBare).length;
    const countBare = (): number => [...regions.areas.keys()].filter(isBare).length;
    const before = countBare();
    session.paint(regions.cellsOfAll(filled), currentPaint, undefined, isLocked);
    this.select(filled, true);
    const told = [regionMessages.filled(filled.size, this.paintName(currentPaint), before, countBare())];
    if (left.length) told.push(regionMessages.leftOut(left.length - apart, apart));
    if (tolerance < 1) told.push(regionMessages.forMore(tolerance));
    this.say(told.join(" "));
  }

  /** Divide the active region into `nParts` parts. */
  async refineActive(): Promise<void> {
    const { activeRegion: region, session, nParts } = this;
    if (region < 0) return this.say(regionMessages.noneActive);
    const before = session.regions.count;
    if (await session.refine(region, nParts)) this.say(regionMessages.divided(region, session.regions.count - before + 1));
  }

  /** Whether a cell is hidden, or outside the clip box. */
  isHidden(cell: number): boolean {
    const middle = this.session.mesh.middleOf(cell);
    return this.drawing.cells.isHidden(cell) || (middle !== null && this.drawing.isCut(middle));
  }

  /** Whether a cell on the surface is seen from behind. */
  isBack(cell: number): boolean {
    const { session: { mesh }, drawing: { camera } } = this;
    const toward = minus(camera.target, mesh.middleOf(cell)!);
    return dot(mesh.normalOf(cell), plus(toward, camera.directions()[2], camera.distance)) < 0;
  }

  /** Move the camera to the active region, or else the current object, without changing the viewing direction. */
  frameActive(): void {
    const { activeRegion, session, currentPaint } = this;
    const chosen = activeRegion >= 0 ? session.regions.cellsOf(activeRegion)
      : session.paints.cellsOf(classOf(currentPaint), objectOf(currentPaint));
    const areHidden = chosen.length > 0 && chosen.every((cell) => this.isHidden(cell)); // then, all that is shown is framed
    const cells = areHidden ? Uint32Array.from(session.paints.of.keys()).filter((cell) => !this.isHidden(cell)) : chosen;
    if (!cells.length || !this.fly(cells, true)) this.say(regionMessages.nothingToFrame);
  }

  /** Move the camera to half the distance from a cell, and turn it around the cell from now on. */
  approach(cell: number): void {
    const { camera } = this.drawing;
    const middle = this.session.mesh.middleOf(cell);
    if (middle) camera.fly(middle, [0, 0, 0], Math.max(camera.distanceTo(middle) / 2, 0.1 * camera.closeness * camera.size));
  }

  hideActive(): void {
    if (this.activeRegion < 0) return this.say(regionMessages.noneActive);
    this.hide(this.session.regions.cellsOf(this.activeRegion), hiding.hidden(text.region(this.activeRegion)));
  }

  isolateActive(): void {
    if (this.activeRegion < 0) return this.say(regionMessages.noneActive);
    this.isolate(this.session.regions.cellsOf(this.activeRegion), hiding.aloneRegion(this.activeRegion));
  }

  private hide(cells: Uint32Array, line: string): void {
    this.drawing.cells.mark(cells, MARK_HIDDEN, true);
    this.say(line);
  }

  /** Hide all cells except the given ones. */
  private isolate(cells: Uint32Array, line: string): void {
    this.drawing.cells.mark(Uint32Array.from(this.session.paints.of.keys()), MARK_HIDDEN, true);
    this.drawing.cells.mark(cells, MARK_HIDDEN, false);
    this.say(line);
  }

  /** Show only the cells with the class and object encoded by `paint`. */
  isolatePaint(paint: number): void {
    if (!paint) return this.say(painting.noCell);
    const [cells, name] = [this.session.paints.cellsOf(classOf(paint), objectOf(paint)), this.paintName(paint)];
    if (!cells.length) return this.say(hiding.noCells(name));
    this.isolate(cells, hiding.alone(name));
    this.fly(cells, true);
  }

  /** Hide all cells of a class; id 0 hides the cells without a class. */
  hideClass(id: number): void {
    this.hide(this.session.paints.cellsOf(id), id ? hiding.hidden(this.className(id)) : hiding.unlabeledHidden);
  }

  /** Hide all cells that have a class, so that only what is left to label is shown. */
  hideLabeled(): void {
    const { mesh, paints } = this.session;
    const labeled = Uint32Array.from(paints.of.keys()).filter((cell) => paints.of[cell]);
    const nLeft = mesh.nCells - labeled.length;
    if (!nLeft || !labeled.length) return this.say(nLeft ? hiding.noneLabeled : hiding.allLabeled);
    this.drawing.cells.unmarkAll(MARK_HIDDEN);
    this.hide(labeled, hiding.labeledHidden(mesh.counted(nLeft)));
  }

  /** Let the cells without a class blink. */
  blinkBare(): void {
    const { mesh, paints } = this.session;
    const nLeft = paints.countOf.get(0) ?? 0;
    if (!nLeft) return this.say(hiding.allLabeled);
    this.drawing.blink();
    this.say(hiding.blinking(mesh.counted(nLeft)));
  }

  /** Set whether strokes that paint a class skip cells that already have one. */
  lock(isLocked = !this.session.isLocked): void {
    this.session.isLocked = isLocked;
    element<HTMLInputElement>("lock").checked = isLocked;
    this.say(isLocked ? painting.locked : painting.unlocked);
  }

  /** Class and object of the cell under the pointer, encoded as one number; 0 if there is no cell or no class. */
  get hoveredPaint(): number {
    return this.hoveredCell < 0 ? 0 : this.session.paints.of[this.hoveredCell];
  }

  showAll(): void {
    if (!this.drawing.cells.hasHidden) return this.say(hiding.nothingHidden);
    this.drawing.cells.unmarkAll(MARK_HIDDEN);
    this.say(hiding.allShown);
  }
}
