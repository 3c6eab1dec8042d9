// Data of the page: labels of each level, ground truth, and features by which cells can be colored.

import type { Arrays, Entry, Numbers } from "../shared/arrays";
import { NONE, type ShapeFacts } from "../shared/shape";

const NO_VALUE = 65535;

interface LabelingFacts {
  ids: number[] | null; // label of each region in the input; null if the labels are 0, 1, 2, ...
  n_left_out: number; // number of cells that are in no region
  mean_area: number;
}

interface Feature {
  name: string;
  of: "cell" | "region";
  low: number;
  high: number;
  n_missing: number;
}

/** JSON that superfacets_show.page.document writes in addition to the arrays. */
export interface Facts extends ShapeFacts {
  noun: string;
  n_cells: number;
  measure: string;
  levels: LabelingFacts[];
  truth: LabelingFacts | null;
  features: Feature[];
  arrays: Entry[];
}

export interface Labeling extends LabelingFacts {
  name: string;
  colors: Numbers;
  counts: Numbers; // number of cells in each region
  sizes: Numbers; // area or volume of each region
}

export type Coloring =
  | { kind: "level" | "truth" | "plain"; name: string }
  | { kind: "feature"; name: string; feature: Feature; values: Numbers };

export class Content {
  readonly levels: Labeling[];
  readonly truth: Labeling | null;
  readonly colorings: Coloring[] = [];
  private last: { name: string; labels: Numbers } | null = null;

  constructor(readonly facts: Facts, readonly arrays: Arrays) {
    this.levels = facts.levels.map((level, i) => this.labeling(level, `level_${i}`));
    this.truth = facts.truth && this.labeling(facts.truth, "truth");
    if (this.levels.length) this.colorings.push({ kind: "level", name: "Regions" });
    if (this.truth) this.colorings.push({ kind: "truth", name: "Ground truth" });
    facts.features.forEach((feature, i) => {
      const values = arrays[`feature_${i}`]!;
      this.colorings.push({ kind: "feature", name: feature.name, feature, values });
    });
    if (!this.colorings.length) this.colorings.push({ kind: "plain", name: "Plain" });
  }

  private labeling(facts: LabelingFacts, name: string): Labeling {
    const take = (part: string): Numbers => this.arrays[`${name}_${part}`]!;
    return { ...facts, name, colors: take("colors"), counts: take("counts"), sizes: take("sizes") };
  }

  private get base(): Numbers {
    return this.arrays.level_0_labels!;
  }

  /** The label of each cell. For a coarser level, only the parent of each region of the first level is stored. */
  labelsOf({ name }: Labeling): Numbers {
    const given = this.arrays[`${name}_labels`];
    if (given) return given;
    if (this.last?.name === name) return this.last.labels;
    const parents = this.arrays[`${name}_parents`]!;
    const labels = this.base.map((region) => (region === NONE ? NONE : parents[region]));
    this.last = { name, labels };
    return labels;
  }

  /** The color group of each cell: its value quantized to 256 steps, or NONE if the cell has no value. */
  groupsOf(feature: Feature, values: Numbers): Numbers {
    const steps = Uint32Array.from(values, (value) => (value === NO_VALUE ? NONE : value >> 8));
    if (feature.of === "cell") return steps;
    return this.base.map((region) => (region === NONE ? NONE : steps[region]));
  }

  /** The value of a cell, or null if the cell has no value. */
  valueOf(feature: Feature, values: Numbers, cell: number): number | null {
    const place = feature.of === "cell" ? cell : this.base[cell];
    const value = place === NONE ? NO_VALUE : values[place];
    return value === NO_VALUE ? null : feature.low + ((feature.high - feature.low) * value) / (NO_VALUE - 1);
  }
}
