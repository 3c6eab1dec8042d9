import { expect, test } from "vitest";
import { percent } from "../src/shared/dom";
import { en } from "../src/studio/text/en";
import { ClassKeys, classesFor, withKey } from "../src/studio/data/classkeys";
import type { ClassEntry } from "../src/studio/data/contract";

const NAMES = ["wall", "floor", "cabinet", "bed", "office chair", "sofa", "table", "Tür", "window", "desk", "desk lamp"];
const classes: ClassEntry[] = NAMES.map((name, i) => ({ id: i + 1, name, color: "#102030", key: "" }));

function keysOf(list: ClassEntry[], stored: [string, number][] | null = null): ClassKeys {
  const keys = new ClassKeys(stored);
  keys.take(list);
  return keys;
}

const all = (keys: ClassKeys): number[] => [..."123456789"].map((key) => keys.classOf(key));

test("at first, the keys have the first classes of the list", () => {
  expect(all(keysOf(classes))).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 9]);
});

test("a used class takes the key of the class that was not used for the longest time, and no other key moves", () => {
  const keys = keysOf(classes);
  keys.use(10);
  expect(all(keys)).toEqual([1, 2, 3, 4, 5, 6, 7, 8, 10]);
  for (const id of [8, 7, 6, 11]) keys.use(id);
  expect(all(keys)).toEqual([1, 2, 3, 4, 11, 6, 7, 8, 10]);
  keys.use(0); // no class
  expect(keys.keyOf(11)).toBe("5");
});

test("a class with labels keeps its key, and the class that loses its key is told", () => {
  const keys = keysOf(classes);
  expect(keys.use(10, (id) => id !== 3)).toBe(3);
  expect(keys.use(10, () => true)).toBe(0);
  expect(keys.use(11, () => true)).toBe(0);
  expect(all(keys)).toEqual([1, 2, 10, 4, 5, 6, 7, 8, 9]);
});

test("an assigned key stays, whatever is used, and leaves the class that had it before", () => {
  const list = withKey(withKey(classes, 11, "2"), 10, "2");
  expect(list.filter(({ key }) => key).map(({ id }) => id)).toEqual([10]);
  const keys = keysOf(list);
  for (const { id } of classes) keys.use(id);
  expect(keys.classOf("2")).toBe(10);
  expect([...new Set(all(keys))]).toHaveLength(9);
  expect(keysOf(withKey(list, 10, "")).isAssigned("2")).toBe(false);
});

test("the keys of used classes survive a reload and an edited list", () => {
  const keys = keysOf(classes);
  keys.use(10);
  const again = keysOf(classes.filter(({ id }) => id !== 2), keys.stored);
  expect(again.keyOf(10)).toBe("9");
  expect(again.classOf("2")).toBe(9);
});

test.each([
  ["de", ["desk", "desk lamp"]],
  ["lamp", ["desk lamp"]],
  ["chair off", ["office chair"]],
  ["TUR", ["Tür"]],
  ["ab", ["cabinet", "table"]],
  ["11", ["desk lamp"]],
  ["", NAMES],
  ["x", []],
])("typing %o finds %o", (text, names) => {
  expect(classesFor(classes, text).map(({ name }) => name)).toEqual(names);
});

test("names that begin with the text come before names with a word that does", () => {
  const list = ["table lamp", "shower curtain", "curtain"].map((name, id) => ({ id, name, color: "", key: "" }));
  expect(classesFor(list, "cur").map(({ name }) => name)).toEqual(["curtain", "shower curtain"]);
});

test.each([
  [0, "0.0 %"],
  [0.054, "5.4 %"],
  [0.5, "50 %"],
  [0.9949, "99 %"],
  [0.9997, "> 99 %"],
  [1 - 1e-12, "100 %"],
])("the fraction %d of the labeled area is shown as %s", (fraction, shown) => {
  expect(percent(fraction)).toBe(shown);
});

test("works that nearly agree are not said to agree", () => {
  expect(en.comparison.agreement("a", 1, 0.99999)).toContain("label 100.0 % of the area, and agree on 99.9 %");
  expect([en.comparison.ratio(0.9996), en.comparison.ratio(1)]).toEqual(["0.999", "1.000"]);
});
