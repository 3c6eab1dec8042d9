// Which regions touch, rings around them, and a walk through all regions.

import { readPacket } from "./packet";

export class Neighbors {
  private readonly lists: number[][];

  constructor(buffer: ArrayBuffer, count: number) {
    const { arrays } = readPacket<object>(buffer);
    this.lists = Array.from({ length: count }, () => []);
    const arcs = arrays.arcs as Uint32Array;
    for (let i = 0; i < arcs.length; i += 2) {
      this.lists[arcs[i]].push(arcs[i + 1]);
      this.lists[arcs[i + 1]].push(arcs[i]);
    }
  }

  of(region: number): readonly number[] {
    return this.lists[region] ?? [];
  }

  /** Regions around a set that are not in it. */
  ringAround(regions: ReadonlySet<number>): number[] {
    const ring = new Set<number>();
    for (const region of regions) {
      for (const other of this.of(region)) if (!regions.has(other)) ring.add(other);
    }
    return [...ring];
  }

  /** Regions of a set that touch one outside, or the end of the surface. */
  outerRing(regions: ReadonlySet<number>): number[] {
    return [...regions].filter((region) => this.of(region).some((other) => !regions.has(other)));
  }

  /** All regions, piece by piece, each breadth first. */
  walk(): number[] {
    const order: number[] = [];
    const seen = new Uint8Array(this.lists.length);
    for (let first = 0; first < this.lists.length; first++) {
      if (seen[first]) continue;
      seen[first] = 1;
      let at = order.push(first) - 1;
      for (; at < order.length; at++) {
        for (const other of this.of(order[at])) {
          if (seen[other]) continue;
          seen[other] = 1;
          order.push(other);
        }
      }
    }
    return order;
  }
}
