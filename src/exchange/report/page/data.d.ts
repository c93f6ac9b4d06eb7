// What the page reads: written by `report/recording.rs`, `report/mind.rs` and `report/page.rs`. `tests/it/report.rs` holds the
// names of the fields, and of plain ones whether they are numbers, texts, truths or lists, against what is written. A `Column` is the number of a column of values, packed by `report/columns.rs`.

export type Column = number;
/** Columns of x (m), y (m) and heading (rad). */
export type Places = [Column, Column, Column];
/** From a tick or a time (s) on: what. Lights and signals go by ticks; `held`, `skies` and `phases` by seconds. */
export type Changes<T> = [number, T][];
/** How much a reason holds the speed back: it brakes hard, comes to a stop, follows somebody, or drives freely. */
export type Restraint = "hard" | "stops" | "follows" | "free";

export interface Header {
  summary: Summary;
  origin: [string, string][];
  source: string;
  rows: string[];
  step_s: number;
  collisions: Collision[];
  steps: Step[];
  held: [number, string, Restraint][];
  ego: Ego;
  obstacles: Obstacle[];
  tracks: Track[];
  plans: Plans;
  margins: Margin[];
  signals: Record<number, Changes<string>>;
  skies: Changes<string>;
}

export interface Summary {
  name: string;
  road: string;
  ads: string;
  duration_s: number;
  end: string;
  steps: number;
  actions: number;
  collisions: Finding[];
  refuted: { claim: string; confirmed: boolean | null; found: string }[];
  same: boolean | null;
  breaches: Breach[];
  crashes: Crash[];
  /** Why the driving system failed, if it did. */
  failure: string | null;
}

/** Two road users crash into each other, not into the ego vehicle. */
export interface Crash {
  at_s: number;
  x_m: number;
  y_m: number;
  obstacle: number;
  other: number;
  text: string;
}

/** How often a finding recurs under other noise. */
export interface Recurrence {
  recurred: number;
  replays: number;
  /** `14 of 20 (0.48 to 0.85)`. */
  text: string;
  recurs: boolean;
  /** `recurs`, `may recur` or `rarely recurs`. */
  word: string;
  /** Said where the driving system need not repeat itself. */
  mixed: string | null;
}

/** A collision of the list. */
export interface Finding {
  at_s: number;
  obstacle: number;
  body: string;
  kind: string;
  shape: string;
  precrash: string;
  precrash_number: number | null;
  verb: string;
  x_m: number;
  y_m: number;
  counted: boolean;
  /** The clauses of the verdict that it does not meet. */
  unmet: string[];
  class: string;
  onset_s: number;
  avoided_by: string[];
  letter: string[];
  evasion: string | null;
  priority: string;
  /** Who had priority, by which rule, since when, and whose motion decided. */
  ruling: string;
  side: string;
  approach: string;
  ego_mps: number;
  closing_mps: number;
  delta_v_mps: number;
  other_delta_v_mps: number;
  harm: string;
  harm_share: number;
  recurrence: Recurrence | null;
  moments: Branched[];
  sudden: boolean;
  struck: boolean;
  cause: string[] | null;
  held: string | null;
}

/** A collision with the drives of careful drivers. */
export interface Collision extends Finding {
  ways: Way[];
}

/** The drive of a careful driver from the onset of a collision; `from_s` is null where it never took over. */
export interface Way {
  name: string;
  avoids: boolean;
  from_s: number | null;
  every_s: number;
  places: Places;
  speed_mps: Column;
}

/** In how many branches from a moment on the finding happened again. */
export interface Branched {
  at_s: number;
  recurred: number;
  replays: number;
  is_likely: boolean;
}

export interface Breach {
  requirement: string;
  obstacle: number | null;
  docs: string;
  formula: string;
  at_s: number;
  until_s: number;
  margin: number | null;
  unit: string | null;
  kept_by: string[] | null;
  recurrence: Recurrence | null;
  moments: Branched[];
}

export interface Step {
  at_s: number;
  outcome: Outcome;
  proc: number;
  reward: number;
  offers: { legal: number[]; masked: [string, number[]][] } | null;
}

export type Outcome =
  | { kind: "done"; row: number; text: string; made: number[]; at_s: number }
  | { kind: "passed" }
  | { kind: "refused"; row: number; rule: string | null; reason: string };

export interface Ego {
  places: Places;
  speed_mps: Column;
  acceleration_mps2: Column;
  steer_rad: Column;
  throttle_pct: Column;
  brake_pct: Column;
  proc: Column;
  brake_lights: Changes<boolean>;
  length_m: number;
  width_m: number;
}

export interface Obstacle {
  id: number;
  body: string;
  like: string;
  colour: string;
  verb: string;
  ambient: boolean;
  from_tick: number;
  length_m: number;
  width_m: number;
  places: Places;
  speed_mps: Column;
  brake_lights: Changes<boolean>;
  lights?: Changes<string>;
  phases?: Changes<string>;
}

/** What the driving system believed to be there; `track` is null for a ghost. `counts` and `predicted_m` are of each thought. */
export interface Track {
  track: number | null;
  of: number | null;
  from_look: number;
  body: string;
  length_m: number;
  width_m: number;
  places: Places;
  speed_mps: Column;
  counts: Column;
  predicted_m: [Column, Column];
}

export interface Plans {
  counts: Column;
  x_m: Column;
  y_m: Column;
}

/** A requirement's margin, in stretches of ticks in which it was asked. */
export interface Margin {
  requirement: string;
  unit: string | null;
  parts: [number, Column][];
}

/** Half of each column's step, and the times between ticks, looks and thoughts. */
export interface Quantisation {
  place_m: number;
  heading_rad: number;
  speed_mps: number;
  acceleration_mps2: number;
  probability: number;
  sketch_m: number;
  tick_s: number;
  perceived_s: number;
  thought_s: number;
}

/** All that is not packed. */
export interface Index {
  schema: 1;
  title: string;
  avastra: string;
  engine: string;
  quantisation: Quantisation;
  overview: any;
  remarks: string[];
  compared_with: string | null;
  scenarios: Entry[];
}

/** A scenario of the list: `n` names its packed data, `ground` that of its road. */
export interface Entry {
  n: number;
  file: string;
  ground: string;
  summary: Summary;
  shrunk_from: string | null;
  compared: boolean;
  change: { kind: string; later_s?: number; why?: string | null } | null;
  changed: string | null;
}
