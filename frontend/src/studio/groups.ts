// Indices grouped by their values, by a counting sort.

export class Groups {
  private readonly starts: Uint32Array;
  private readonly members: Uint32Array;

  /** `values`: the group of each index, below `count`; negative values are left out. */
  constructor(values: Int32Array | Uint32Array, count: number) {
    this.starts = new Uint32Array(count + 1);
    for (const value of values) if (value >= 0) this.starts[value + 1]++;
    for (let k = 0; k < count; k++) this.starts[k + 1] += this.starts[k];
    this.members = new Uint32Array(this.starts[count]);
    const next = this.starts.slice();
    for (let i = 0; i < values.length; i++) if (values[i] >= 0) this.members[next[values[i]]++] = i;
  }

  /** Indices of one group in rising order. */
  of(group: number): Uint32Array {
    return this.members.subarray(this.starts[group], this.starts[group + 1]);
  }
}
