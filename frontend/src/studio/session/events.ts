// Event listeners, grouped by kind of event. `Kinds` maps each kind of event to the type of its value.

export class Events<Kinds> {
  private readonly listeners = new Map<keyof Kinds, Set<(value: never) => void>>();

  on<K extends keyof Kinds>(kind: K, listener: (value: Kinds[K]) => void): void {
    if (!this.listeners.has(kind)) this.listeners.set(kind, new Set());
    this.listeners.get(kind)!.add(listener);
  }

  emit<K extends keyof Kinds>(kind: K, value: Kinds[K]): void {
    for (const listener of this.listeners.get(kind) ?? []) (listener as (value: Kinds[K]) => void)(value);
  }
}
