// What the engine's short words mean, and figures as people read them.

/** @import { Branched, Breach, Finding, Recurrence, Summary } from "./data" */

export const VERDICTS = {
  avoidable: "a careful driver would have avoided it",
  beyond_reference: "only a driver quicker than the careful ones, or an evasive manoeuvre, would have avoided it",
  unavoidable: "no driver that was tried avoids it",
};

export const DRIVERS = {
  cc: "careful driver (UN R157)",
  fsm: "fuzzy safety model (UN R157)",
  rss: "responsibility-sensitive safety",
  r157: "least performance of UN R157",
};

/** A driving system that scenarios are compared with, in words. */
export const driverInWords = (name) => DRIVERS[name] ?? name;

export const ENDS = {
  arrived: "it arrived",
  stalled: "it stood for several steps",
  blocked: "others blocked its way",
  astray: "it left its lane",
  left_the_map: "it drove off the map",
  limit: "the step limit was reached",
  script: "the scenario ends here",
};

/** A figure with a unit, `12.3 s`. */
export function figure(value, unit = "", digits = 1) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const text = value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
  return unit ? `${text} ${unit}` : text;
}

/** Three digits, however small or large. */
export const short = (value) => Number(value).toLocaleString("en", { maximumSignificantDigits: 3 });

/** Simulated time, in hours or, if it is short, in minutes. */
export const simulated = (hours) => (hours < 1 ? figure(hours * 60, "min", 1) : figure(hours, "h", 1));

/** A moment of a replay, to a hundredth wherever the page tells it. */
export const atTime = (timeS) => figure(timeS, "s", 2);

export const kmh = (mps) => figure(mps * 3.6, "km/h", 0);

/** `1 scenario`, `2 scenarios`. */
export function plural(count, noun) {
  return `${count.toLocaleString("en")} ${noun}${count === 1 ? "" : "s"}`;
}

/**
 * The collision that a scenario is about: the first that counts, or the first.
 * @param {Summary} summary
 */
export function mainCollision(summary) {
  return summary.collisions.find((collision) => collision.counted) ?? summary.collisions[0] ?? null;
}

/**
 * What a scenario is about: its main collision, or else its first breach.
 * @param {Summary} summary
 */
export const mainFinding = (summary) => {
  const collision = mainCollision(summary);
  return collision?.counted ? collision : (summary.breaches[0] ?? collision);
};

/**
 * Whether a finding recurs under other noise, in the engine's words.
 * @param {{ recurrence: Recurrence | null } | null} finding
 */
export function recursInWords(finding) {
  const recurrence = finding?.recurrence;
  if (!recurrence) return "not tried";
  return recurrence.word;
}

/**
 * The share of branches in which a finding happened again.
 * @param {Branched} branches
 */
export const inHundred = ({ recurred, replays }) => `${Math.round((100 * recurred) / replays)} %`;

/** What an impact means for people, by the word of the page's data. */
export const HARMS = {
  minor: "between vehicles, below walking pace",
  moderate: "fewer than one person in ten is seriously injured at such a speed",
  serious: "at least one person in ten is seriously injured at such a speed",
};

/**
 * A collision in a sentence.
 * @param {Finding} collision
 * @param {string} [road]
 */
export function collisionInWords(collision, road) {
  const others = { standing: "standing", along: "moving along", oncoming: "oncoming" };
  const how = others[collision.approach] ?? `coming ${collision.approach}`;
  const struck = collision.struck ? " runs into the ego vehicle" : " is hit by the ego vehicle";
  return (
    `${collision.body} #${collision.obstacle} (${how})${struck} at ${atTime(collision.at_s)}` +
    ` on ${road}: the ego vehicle drives ${kmh(collision.ego_mps)}, contact at its ${collision.side}`
  );
}

/**
 * A breach of a requirement in a sentence.
 * @param {Breach} breach
 */
export function breachInWords({ requirement, obstacle, at_s: atS, margin, unit }) {
  const of = obstacle === null ? "" : ` of #${obstacle}`;
  const by = margin === null ? "" : `, by ${figure(Math.abs(margin), unit ?? "", 2).trim()} at most`;
  return `The ego vehicle does not keep ${requirement}${of} at ${atTime(atS)}${by}`;
}

/** What another driving system makes of a scenario, by the word of the page's data. */
export const CHANGES = {
  same: "same crash",
  other_time: "same crash, at another time",
  not_counted: "the same obstacle is hit, and it does not count",
  other_crash: "another crash",
  gone: "no crash any more",
  never_met: "the obstacle never appears",
  failed: "the driving system failed",
  new: "a new crash",
  none: "no crash in either",
};

/** What ProC means, for those who do not know the word. */
export const PROC = "collision probability: how near the ego vehicle is to a crash, from 0 to 1";

/**
 * The result of a comparison, with how far the time of the crash has moved.
 * @param {{ kind: string, later_s?: number }} change
 */
export function changeInWords({ kind, later_s: laterS }) {
  if (kind !== "other_time") return CHANGES[kind] ?? kind;
  const movedS = laterS ?? 0;
  return `same crash, ${figure(Math.abs(movedS), "s", 2)} ${movedS > 0 ? "later" : "earlier"}`;
}

/** A cause in words. */
export function causeInWords(cause) {
  if (!cause) return "not looked for";
  return cause.length === 0 ? "none found" : cause.join(" and ");
}
