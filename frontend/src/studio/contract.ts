// What the server sends and takes.

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
}

export interface Progress {
  seq: number;
  progress: number;
  can_undo: boolean;
  can_redo: boolean;
}

export interface State extends Progress {
  parameters: Parameters;
  ranges: Record<string, Range>;
  revision: number;
  n_regions: number;
  classes: ClassEntry[];
  levels: number[];
  input: { name: string; n_cells: number; sha256?: string };
  notes: string[];
  exports?: Record<string, string[]>; // formats of what
}

export interface FileEntry {
  id: number;
  name: string;
  done: number;
  n_cells?: number;
  error?: string;
}

export interface PaintReply extends Progress {
  changed: number;
}

/** What an undo or redo did, and how things are now. */
export interface UndoReply extends Progress {
  kind: string;
  cells: string;
  classes: string;
  revision: number;
  parameters: Parameters;
}

export interface SplitReply extends Progress {
  revision: number;
  n_regions: number;
}

/** A line of the stream that `segment` answers with. */
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
