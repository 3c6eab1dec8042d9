// Types of the responses of the studio server. The parameters of a `segment` request also have a type.

export interface Parameters {
  n_segments: number;
  alpha: number;
  ridges: number;
  smooth: boolean;
  scans: boolean; // whether noise is smoothed more before creases are measured
  color: boolean; // whether borders follow colors, too
  level: number | null;
}

export type Range = [min: number, max: number];

export interface ClassEntry {
  id: number;
  name: string;
  color: string;
  key: string;
  stuff?: boolean; // whether the class has no separate objects, for example "wall"
}

export interface ObjectName {
  class: number;
  object: number;
  name: string;
}

/** Active time and strokes of the work on a file. */
export interface Statistics {
  seconds: number; // active time: without pauses of more than a minute
  strokes: number;
}

export interface Progress {
  seq: number;
  progress: number;
  can_undo: boolean;
  can_redo: boolean;
  object_names: ObjectName[];
  is_reviewed: boolean;
  is_changed: boolean; // whether labels have changed since the review
  n_suggestions: number;
  statistics?: Statistics; // missing if nothing was done yet, or if an old version did it
}

export interface State extends Progress {
  parameters: Parameters;
  ranges: Record<string, Range>;
  has_colors: boolean;
  revision: number;
  n_regions: number;
  classes: ClassEntry[];
  levels: number[];
  input: { name: string; n_cells: number; sha256?: string };
  work: string; // path of the file that stores the labels
  notes: string[];
  exports?: Record<string, Record<string, string>>; // file names, indexed by exported data and format
}

export interface FileEntry {
  id: number;
  name: string;
  done: number;
  reviewed?: boolean;
  changed_since_review?: boolean;
  time?: number; // of the last step, in seconds since 1970
  statistics?: Statistics;
  error?: string;
}

/** An object suggested by an imported file. */
export interface SuggestionEntry {
  id: number;
  class: number; // class id; 0 if the user must choose a class
  score: number | null; // 0 to 1; null if the file contains no score
  n_cells: number;
  area: number; // volume for tetrahedra
}

/** Changes made by undo, by redo, or by accepting or rejecting suggestions, and the state after the change. */
export interface Effect extends Progress {
  kind: string;
  cells: string; // indices of the changed cells, as base64 of uint32 numbers
  paint: string; // new paint (class and object) of each changed cell, as base64 of uint32 numbers
}

/** Agreement on one object. */
export interface ObjectAgreement {
  object: number; // object number after a merge
  mine: number | null; // object number in this file
  theirs: number | null; // object number in the other file
  iou: number | null; // null if no cell of it is labeled in both files
}

/** Agreement of the labels in two work files. */
export interface Agreement {
  name: string;
  labeled: number; // fraction of the whole area that is labeled in both files
  share: number; // fraction of the area labeled in both files that has the same labels
  classes: { class: number; name: string; iou: number | null; objects: ObjectAgreement[] }[]; // null as below
}

export interface CompareReply extends Progress {
  agreement: Agreement | null; // null if no file is compared
  classes: ClassEntry[]; // classes of this file, followed by classes that only the other file has
  differs: string; // cells labeled differently in the two files, as base64 of uint32 numbers
  bare: string; // cells labeled only in the other file, as base64 of uint32 numbers
}

export type SplitReply = Progress & Pick<State, "revision" | "n_regions">;

/** A line of the streamed response to a `segment` request. */
export interface SegmentLine {
  stage?: string;
  iteration?: number;
  revision?: number;
  n_regions?: number;
  seconds?: number;
  cancelled?: boolean;
  error?: string;
}
