// Names of classes and objects, and descriptions of steps that are undone or redone.

import type { State } from "./contract";
import { classOf, objectOf, paintOf, type Regions } from "./labeling";
import type { Mesh } from "./mesh";
import { text } from "../text/index";

export type Lists = Pick<State, "classes" | "object_names">;

/**
 * The state before or after a step that can be undone: lists of classes and names, and the paint (class and object) of
 * the cells that the step changes.
 */
export interface Side {
  lists: Lists;
  paint: Uint32Array;
}

const words = text.steps;
const TOLD = new Set(["paint", "classes", "objects"]); // steps of these kinds are described only by their changes
const MAX_TOLD = 2; // maximum number of class and object changes listed in the description of a step

export const classNameIn = ({ classes }: Lists, id: number): string =>
  classes.find((entry) => entry.id === id)?.name ?? text.noClass;

/** Name of the object of a paint (class and object) or, if the paint has no object, of its class. */
export function paintNameIn(lists: Lists, paint: number): string {
  const [id, object] = [classOf(paint), objectOf(paint)];
  const name = classNameIn(lists, id);
  if (!object || lists.classes.find((entry) => entry.id === id)?.stuff) return name;
  // "chair 2", or "class 1 #2" if the class name ends with a digit.
  return ownName(lists, paint) ?? `${name} ${/\d$/.test(name) ? "#" : ""}${object}`;
}

const ownName = ({ object_names }: Lists, paint: number): string | undefined =>
  object_names.find((one) => paintOf(one.class, one.object) === paint)?.name;

function classChanges(old: Lists, now: Lists): string[] {
  const deleted = old.classes.filter(({ id }) => !now.classes.some((entry) => entry.id === id));
  const changed = now.classes.flatMap(({ id, name, color, stuff = false }) => {
    const was = old.classes.find((entry) => entry.id === id);
    if (!was) return [words.newClass(name)];
    if (was.name !== name) return [words.renamed(was.name, name)];
    if (was.color !== color) return [words.color(name)];
    return (was.stuff ?? false) === stuff ? [] : [stuff ? words.withoutObjects(name) : words.withObjects(name)];
  });
  return [...deleted.map(({ name }) => words.deleted(name)), ...changed];
}

function objectChanges(old: Lists, now: Lists): string[] {
  const named = new Set([...old.object_names, ...now.object_names].map((one) => paintOf(one.class, one.object)));
  return [...named].filter((paint) => ownName(old, paint) !== ownName(now, paint))
    .map((paint) => words.renamed(paintNameIn(old, paint), paintNameIn(now, paint)));
}

function paintChanges({ regions, mesh }: { regions: Regions; mesh: Mesh }, cells: Uint32Array, now: Side): string[] {
  if (!cells.length) return [];
  const touched = [...new Set(cells.map((cell) => regions.labels[cell]))];
  const isWhole = 2 * cells.length >= regions.cellsOfAll(touched).length;
  const what = isWhole ? text.regions(touched.length) : mesh.counted(cells.length);
  const paints = new Set(now.paint);
  if (paints.size > 1) return [words.severalPaints(what, paints.size)];
  return [now.paint[0] ? words.painted(what, paintNameIn(now.lists, now.paint[0])) : words.erased(what)];
}

/** Description of a step that changed the state `old` to the state `now`. */
export function stepName(
  open: { regions: Regions; mesh: Mesh }, kind: string, cells: Uint32Array, [old, now]: [Side, Side],
): string {
  const told = [...classChanges(old.lists, now.lists), ...objectChanges(old.lists, now.lists)];
  const more = told.length > MAX_TOLD ? [words.moreNames(told.length - MAX_TOLD)] : [];
  const named = TOLD.has(kind) ? [] : [words.kinds[kind] ?? kind];
  const all = [...named, ...told.slice(0, MAX_TOLD), ...more, ...paintChanges(open, cells, now)];
  return text.list(all) || (words.kinds[kind] ?? kind);
}
