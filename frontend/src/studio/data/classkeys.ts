// Which classes the keys 1 to 9 choose, and the search for classes by name.

import type { ClassEntry } from "./contract";

const KEYS = ["1", "2", "3", "4", "5", "6", "7", "8", "9"];

/**
 * Classes of the keys 1 to 9. Keys that the user has assigned, and keys of classes with labels, do not change. The
 * other keys choose the classes that were used last.
 */
export class ClassKeys {
  private assigned = new Map<string, number>(); // class id by key
  private held: Map<string, number>; // class id by key, for keys that are not assigned; the least recently used class first

  /** `stored` is an earlier result of `stored`, or null. */
  constructor(stored: [string, number][] | null) {
    this.held = new Map(stored ?? []);
  }

  get stored(): [string, number][] {
    return [...this.held];
  }

  /** Take a new list of classes. Free keys get the first classes that have no key. */
  take(classes: readonly ClassEntry[]): void {
    this.assigned = new Map(classes.flatMap(({ id, key }) => (KEYS.includes(key) ? [[key, id] as const] : [])));
    const others = classes.map(({ id }) => id).filter((id) => ![...this.assigned.values()].includes(id));
    const held = [...this.held].filter(([key, id]) => KEYS.includes(key) && !this.assigned.has(key) && others.includes(id));
    const bare = others.filter((id) => !held.some(([, other]) => other === id));
    const free = KEYS.filter((key) => !this.assigned.has(key) && !held.some(([other]) => other === key));
    const filled = free.slice(0, bare.length).map((key, i) => [key, bare[i]] as const);
    this.held = new Map([...filled.reverse(), ...held]); // classes at the top of the list are the last to lose their keys
  }

  /**
   * Note that a class is used. If it has no key, it gets the key of the least recently used class without labels, if
   * there is one. Returns the class that loses its key, or 0.
   */
  use(id: number, hasLabels: (id: number) => boolean = () => false): number {
    const key = this.keyOf(id) || ([...this.held].find(([, other]) => !hasLabels(other))?.[0] ?? "");
    if (!id || !key || this.assigned.has(key)) return 0;
    const before = this.classOf(key);
    this.held.delete(key);
    this.held.set(key, id);
    return before === id ? 0 : before;
  }

  /** Class that a key chooses; 0 if there is none. */
  classOf(key: string): number {
    return this.assigned.get(key) ?? this.held.get(key) ?? 0;
  }

  /** Key of a class; empty if there is none. */
  keyOf(id: number): string {
    return KEYS.find((key) => this.classOf(key) === id) ?? "";
  }

  isAssigned(key: string): boolean {
    return this.assigned.has(key);
  }
}

/** The list of classes after the user has assigned a key (empty: none) to a class. Another class loses the key. */
export const withKey = (classes: readonly ClassEntry[], id: number, key: string): ClassEntry[] =>
  classes.map((entry) => (entry.id === id ? { ...entry, key } : { ...entry, key: key && entry.key === key ? "" : entry.key }));

const folded = (text: string): string => text.normalize("NFKD").replace(/\p{M}/gu, "").toLowerCase().trim();

/**
 * Classes whose name contains all words of a text, or whose id is the text. Names that begin with the text come first,
 * then names with a word that begins with it.
 */
export function classesFor(classes: readonly ClassEntry[], text: string): ClassEntry[] {
  const wanted = folded(text);
  const rank = ({ id, name }: ClassEntry): number => {
    const own = folded(name);
    if (own.startsWith(wanted) || String(id) === wanted) return 0;
    if (own.split(/[^\p{L}\p{N}]+/u).some((word) => word.startsWith(wanted))) return 1;
    return wanted.split(/\s+/).every((word) => own.includes(word)) ? 2 : 3;
  };
  return [0, 1, 2].flatMap((wantedRank) => classes.filter((entry) => rank(entry) === wantedRank));
}

/** Whether a class has this name. Upper and lower case, and accents, make no difference. */
export const hasNamed = (classes: readonly ClassEntry[], name: string): boolean =>
  classes.some((entry) => folded(entry.name) === folded(name));
