// Names of classes and objects, and descriptions of steps that are undone or redone.

import type { State } from "./contract";
import { classOf, objectOf, paintOf, type Regions } from "./labeling";
import type { Mesh } from "./mesh";

export type Lists = Pick<State, "classes" | "object_names">;

/**
 * The state before or after a step that can be undone: lists of classes and names, and the paint (class and object) of
 * the cells that the step changes.
 */
export interface Side {
  lists: Lists;
  paint: Uint32Array;
}

/** Description of each kind of step that can be undone. */
const STEPS: Record<string, string> = {
  paint: "stroke", split: "split of a region", segment: "new regions", classes: "list of classes",
  objects: "name of an object", review: "review mark", suggest: "import of suggestions", settle: "suggestion",
};
const TOLD = new Set(["paint", "classes", "objects"]); // steps of these kinds are described only by their changes
const MAX_TOLD = 2; // maximum number of class and object changes listed in the description of a step

export const classNameIn = ({ classes }: Lists, id: number): string =>
  classes.find((entry) => entry.id === id)?.name ?? "no class";

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
    if (!was) return [`new class ${name}`];
    if (was.name !== name) return [`renamed ${was.name} to ${name}`];
    if (was.color !== color) return [`color of ${name}`];
    return (was.stuff ?? false) === stuff ? [] : [`${name} ${stuff ? "without" : "with"} objects`];
  });
  return [...deleted.map(({ name }) => `deleted ${name}`), ...changed];
}

function objectChanges(old: Lists, now: Lists): string[] {
  const named = new Set([...old.object_names, ...now.object_names].map((one) => paintOf(one.class, one.object)));
  return [...named].filter((paint) => ownName(old, paint) !== ownName(now, paint))
    .map((paint) => `renamed ${paintNameIn(old, paint)} to ${paintNameIn(now, paint)}`);
}

function paintChanges({ regions, mesh }: { regions: Regions; mesh: Mesh }, cells: Uint32Array, now: Side): string[] {
  if (!cells.length) return [];
  const touched = [...new Set(cells.map((cell) => regions.labels[cell]))];
  const isWhole = 2 * cells.length >= regions.cellsOfAll(touched).length;
  const [n, noun] = isWhole ? [touched.length, "regions"] : [cells.length, mesh.cellName];
  const what = n > 1 ? `${n} ${noun}` : `1 ${isWhole ? "region" : mesh.oneCell}`;
  const paints = new Set(now.paint);
  if (paints.size > 1) return [`${what} of ${paints.size} classes or objects`];
  return [now.paint[0] ? `${what} ${paintNameIn(now.lists, now.paint[0])}` : `class removed from ${what}`];
}

/** Description of a step that changed the state `old` to the state `now`. */
export function stepName(
  open: { regions: Regions; mesh: Mesh }, kind: string, cells: Uint32Array, [old, now]: [Side, Side],
): string {
  const told = [...classChanges(old.lists, now.lists), ...objectChanges(old.lists, now.lists)];
  const more = told.length > MAX_TOLD ? [`${told.length - MAX_TOLD} more changes of names`] : [];
  const named = TOLD.has(kind) ? [] : [STEPS[kind] ?? kind];
  const all = [...named, ...told.slice(0, MAX_TOLD), ...more, ...paintChanges(open, cells, now)];
  return all.join(", ") || (STEPS[kind] ?? kind);
}
