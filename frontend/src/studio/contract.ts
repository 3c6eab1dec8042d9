// Types of requests to the server and of its answers.

export interface Parameters {
  n_segments: number;
  alpha: number;
  ridges: number;
  smooth: boolean;
  level: number | null;
}

export type Range = [min: number, max: number];

export interface ClassEntry {
  id: number;
  name: string;
  color: string;
  key: string;
  stuff?: boolean; // has no objects
}

export interface ObjectName {
  class: number;
  object: number;
  name: string;
}

export interface Progress {
  seq: number;
  progress: number;
  can_undo: boolean;
  can_redo: boolean;
  object_names: ObjectName[];
  is_reviewed: boolean;
  is_changed: boolean; // since the review
  n_suggestions: number;
}

export interface State extends Progress {
  parameters: Parameters;
  ranges: Record<string, Range>;
  revision: number;
  n_regions: number;
  classes: ClassEntry[];
  levels: number[];
  input: { name: string; n_cells: number; sha256?: string };
  work: string; // path of the work file
  notes: string[];
  exports?: Record<string, Record<string, string>>; // names of files, by what is exported and by format
}

export interface FileEntry {
  id: number;
  name: string;
  done: number;
  reviewed?: boolean;
  changed_since_review?: boolean;
  n_cells?: number;
  error?: string;
}

/** An object that a file suggests. */
export interface SuggestionEntry {
  id: number;
  class: number; // 0: the user chooses it
  score: number | null; // 0 to 1; null: the file has none
  n_cells: number;
}

/** Effect of an undo, a redo or a settled suggestion, and the state after it. */
export interface Effect extends Progress {
  kind: string;
  cells: string;
  paint: string;
}

/** How far two works agree. */
export interface Agreement {
  name: string;
  share: number;
  classes: { class: number; name: string; iou: number; objects: { object: number; iou: number }[] }[];
}

export interface CompareReply extends Progress {
  agreement: Agreement | null; // null: nothing is compared
  differs: string; // cells
  bare: string; // cells that only the other work has labeled
}

export interface SplitReply extends Progress {
  revision: number;
  n_regions: number;
}

/** A line of the streamed answer of `segment`. */
export interface SegmentLine {
  stage?: string;
  iteration?: number;
  moved?: number;
  revision?: number;
  n_regions?: number;
  seconds?: number;
  cancelled?: boolean;
  error?: string;
}
