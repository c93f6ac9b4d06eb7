// What is known of a scenario's collision and of the moment, in words and tables.
import { el, refill, table } from "./dom.js";
import { linkOf, nameOf } from "./link.js";
import {
  ENDS,
  HARMS,
  PROC,
  VERDICTS,
  atTime,
  breachInWords,
  causeInWords,
  collisionInWords,
  driverInWords,
  figure,
  kmh,
  plural,
} from "./words.js";

/** @import { Entry, Header, Outcome, Summary } from "./data" */
/** @import { Recording } from "./moment.js" */

/**
 * Everything about the collisions of a scenario; `watchDrivers` shows the reference drivers from a time on.
 * @param {HTMLElement} place
 * @param {Recording} recording
 * @param {(timeS: number) => void} seek
 * @param {(timeS: number) => void} watchDrivers
 */
export function showVerdict(place, recording, seek, watchDrivers) {
  const { collisions, summary } = recording.header;
  const parts = collisions.map((collision) => verdict(recording, collision, seek, watchDrivers));
  if (parts.length === 0)
    parts.push(el("p", {}, `No collision: ${ENDS[summary.end] ?? `it ended with ${summary.end}`}.`));
  parts.push(...summary.breaches.map((breach) => broken(breach, seek)));
  parts.push(...summary.crashes.map((crash) => crashed(crash, seek)));
  if (summary.same && summary.refuted.length === 0) {
    parts.push(el("p", { class: "muted" }, "This replay equals the recorded episode in every bit of every tick."));
  }
  refill(place, parts);
}

/** Two others crash into each other. */
function crashed(crash, seek) {
  const jump = el("button", { type: "button", onclick: () => seek(crash.at_s) }, `Go to ${atTime(crash.at_s)}`);
  return el("section", {}, el("p", {}, `${crash.text}.`), el("p", { class: "buttons" }, jump));
}

/** A requirement that was not kept: what it asks, for how long it was broken, who keeps it. */
function broken(breach, seek) {
  const jump = el("button", { type: "button", onclick: () => seek(breach.at_s) }, `Go to ${atTime(breach.at_s)}`);
  const rows = [
    ["Required", el("code", {}, breach.formula)],
    ...(breach.docs ? [["In words", breach.docs]] : []),
    ["Broken", `from ${atTime(breach.at_s)} to ${atTime(breach.until_s)}`],
    ...again(breach),
    ...rise(breach),
  ];
  if (breach.kept_by) {
    const keepers = breach.kept_by.map(driverInWords).join(", ");
    rows.push(["Kept in the same steps by", keepers || "no careful driver"]);
  }
  return el(
    "section",
    { class: "verdict counted" },
    el("p", { class: "lead" }, `${breachInWords(breach)}.`),
    el("p", { class: "buttons" }, jump),
    el(
      "dl",
      {},
      rows.map(([name, text]) => [el("dt", {}, name), el("dd", {}, text)]),
    ),
  );
}

/** How often a finding happens again under other noise, if that was tried. */
function again({ recurrence }) {
  if (!recurrence) return [];
  const { text, mixed } = recurrence;
  return [["Under other noise", `recurs in ${text}${mixed ? `; ${mixed}` : ""}`]];
}

/** How the chance of a finding rose before it, if that was asked. */
function rise({ moments }) {
  if (moments.length === 0) return [];
  const told = moments.map(({ at_s: atS, recurred, replays }) => `from ${atTime(atS)} in ${recurred} of ${replays}`);
  return [["Under other noise from a moment on", `again ${told.join(", ")}`]];
}

function verdict(recording, collision, seek, watchDrivers) {
  const { summary } = recording.header;
  const says = collision.counted ? "Counts" : `Does not count (not met: ${collision.unmet.join(", ")})`;
  const jump = el("button", { type: "button", onclick: () => seek(collision.at_s) }, `Go to ${atTime(collision.at_s)}`);
  const watch =
    collision.ways.length > 0 &&
    el(
      "button",
      { type: "button", class: "drivers-from", onclick: () => watchDrivers(collision.onset_s) },
      "Watch the reference drivers",
    );
  const onset = el(
    "button",
    { type: "button", onclick: () => seek(collision.onset_s) },
    `Hazard begins: ${atTime(collision.onset_s)}`,
  );
  const rows = [
    ["Verdict", `${says}: ${VERDICTS[collision.class]}`],
    ...again(collision),
    ...rise(collision),
    ["Priority", collision.ruling],
    ["Harm", `${collision.harm}: ${HARMS[collision.harm]}`],
    ["Cause", causeInWords(collision.cause)],
    ["Held by, at contact", collision.held ?? "nothing"],
    [
      "Closing speed",
      `${kmh(collision.closing_mps)}; change of velocity ${kmh(collision.delta_v_mps)}, ` +
        `the other's ${kmh(collision.other_delta_v_mps)}`,
    ],
    ["Manoeuvre", `${collision.verb}${collision.sudden ? ", appeared less than 0.75 s before" : ""}`],
  ];
  if (collision.evasion) rows.push(["Evasion that works", collision.evasion]);
  const drivers = collision.ways.map((way) => [
    driverInWords(way.name),
    way.avoids ? "✓ avoids it" : "✕ does not",
    endOf(recording, way),
    collision.letter.includes(way.name) ? "✓" : ["cc", "fsm"].includes(way.name) ? "✕" : "–",
  ]);
  return el(
    "section",
    { class: `verdict ${collision.counted ? "counted" : ""}` },
    el("p", { class: "lead" }, `${collisionInWords(collision, summary.road)}.`),
    el("p", { class: "buttons" }, jump, onset, watch),
    el(
      "dl",
      {},
      rows.map(([name, text]) => [el("dt", {}, name), el("dd", {}, text)]),
    ),
    drivers.length > 0 &&
      table(
        "Reference drivers from the beginning of the hazard on",
        ["Driver", "Result", "What it does", "By braking alone"],
        drivers,
      ),
  );
}

/** What a reference driver comes to: where it stands, or how it drives on. */
function endOf(recording, way) {
  const speeds = recording.columns[way.speed_mps];
  if (speeds.length === 0) return "–";
  const stands = speeds.findIndex((speed) => speed < 0.05);
  const timeOf = (at) => figure(way.from_s + at * way.every_s, "s", 1);
  if (stands >= 0) return `stands from ${timeOf(stands)} on`;
  const slowest = speeds.reduce((least, speed) => Math.min(least, speed), Infinity);
  return `slows down to ${kmh(slowest)}${way.avoids ? "" : `, until ${timeOf(speeds.length - 1)}`}`;
}

/**
 * A warning before everything else, where the replay is not what the file claims.
 * @param {Summary} summary
 */
export function refutedClaims({ refuted }) {
  if (refuted.length === 0) return null;
  return el(
    "div",
    { class: "warning", id: "refuted" },
    el(
      "p",
      {},
      el("strong", {}, "This replay is not what the file claims"),
      ": the file, its space, the driving system or the engine has changed since. What is drawn here is the replay.",
    ),
    el(
      "ul",
      {},
      refuted.map(({ claim, found }) => el("li", {}, `claimed: ${claim}; found: ${found}`)),
    ),
  );
}

/**
 * Where a scenario comes from: space, driving system with its profile, seed.
 * @param {Header} header
 */
export function origin({ origin: known }) {
  return el("p", { class: "muted", id: "origin" }, known.map(([name, text]) => `${name}: ${text}`).join(" · "));
}

/**
 * The moment in figures; gives a function that updates it.
 * @param {HTMLElement} place
 */
export function showMoment(place) {
  const names = ["Time", "Speed", "Pedals", "ProC", "Held by", "Weather"];
  const cells = names.map(() => el("dd", {}, ""));
  refill(
    place,
    names.map((name, i) => el("div", {}, el("dt", { title: name === "ProC" ? PROC : null }, name), cells[i])),
  );
  return (recording, timeS) => {
    const ego = recording.ego(timeS);
    const pedals = ego.braking ? `brake ${figure(ego.brake, "%", 0)}` : `throttle ${figure(ego.throttle, "%", 0)}`;
    const texts = [
      `${atTime(timeS)} of ${atTime(recording.endS)}`,
      `${kmh(ego.speed)}, ${figure(ego.acceleration, "m/s²", 1)}`,
      pedals,
      figure(ego.proc, "", 2),
      recording.held(timeS) || "–",
      recording.sky(timeS),
    ];
    texts.forEach((text, i) => {
      if (cells[i].textContent !== text) cells[i].textContent = text;
    });
  };
}

/**
 * The road users of a moment as a table.
 * @param {HTMLElement} place
 * @param {Recording} recording
 * @param {number} timeS
 */
export function showUsers(place, recording, timeS) {
  const ego = recording.ego(timeS);
  const rows = recording
    .obstacles(timeS)
    .map((body) => [
      `${body.body} #${body.id}`,
      kmh(Math.abs(body.speed)),
      figure(Math.hypot(body.x - ego.x, body.y - ego.y), "m", 1),
      body.ambient ? "ambient" : body.verb,
    ]);
  refill(
    place,
    rows.length === 0
      ? el("p", { class: "muted" }, "Nobody else is there.")
      : table(`Road users at ${atTime(timeS)}`, ["Who", "Speed", "Distance", "Does"], rows),
  );
}

/**
 * What became of a step.
 * @param {Outcome} outcome
 * @param {string[]} rows
 */
function outcomeInWords(outcome, rows) {
  if (outcome.kind === "done") return outcome.text;
  if (outcome.kind === "passed") return "no action";
  return `refused: ${rows[outcome.row] ?? ""}: ${outcome.rule ? `${outcome.rule}: ` : ""}${outcome.reason}`;
}

/**
 * The actions of all steps: offered, masked and by which rule, chosen, refused.
 * @param {HTMLElement} place
 * @param {Recording} recording
 * @param {(timeS: number) => void} seek
 */
export function showSteps(place, recording, seek) {
  const { steps, rows, obstacles } = recording.header;
  const phases = obstacles.flatMap((one) => (one.phases ?? []).map(([atS, what]) => ({ id: one.id, atS, what })));
  const shown = steps.map((step, number) => {
    const endS = steps[number + 1]?.at_s ?? Infinity;
    const begun = phases.filter(({ atS }) => atS > step.at_s - 1e-6 && atS < endS - 1e-6);
    const { outcome, offers } = step;
    const said = outcomeInWords(outcome, rows);
    const masked = offers?.masked ?? [];
    const isMasked = masked.reduce((sum, [, list]) => sum + list.length, 0);
    const details =
      offers &&
      el(
        "details",
        {},
        el("summary", {}, `${offers.legal.length} offered, ${isMasked} masked`),
        el("p", {}, el("strong", {}, "Offered: "), offers.legal.map((row) => rows[row]).join(" · ") || "none"),
        masked.length > 0 &&
          el(
            "ul",
            {},
            masked.map(([why, list]) =>
              el(
                "li",
                {},
                el("strong", {}, why),
                ` masks ${plural(list.length, "row")}: ${list.map((row) => rows[row]).join(" · ")}`,
              ),
            ),
          ),
      );
    return el(
      "tr",
      { "data-step": number, class: outcome.kind },
      el(
        "th",
        { scope: "row" },
        el(
          "button",
          { type: "button", class: "plain", onclick: () => seek(step.at_s) },
          `${number} · ${figure(step.at_s, "s", 0)}`,
        ),
      ),
      el(
        "td",
        {},
        said,
        begun.map(({ id, atS, what }) =>
          el(
            "div",
            { class: "muted" },
            el("button", { type: "button", class: "plain", onclick: () => seek(atS) }, figure(atS, "s", 1)),
            ` npc#${id}: ${what} begins`,
          ),
        ),
      ),
      el("td", {}, details || "–"),
      el("td", { class: "number" }, figure(step.proc, "", 3)),
    );
  });
  const heads = ["Step", "Chosen", "Offered and masked", el("abbr", { title: PROC }, "ProC")];
  refill(place, table("Actions, step by step", heads, shown));
  return (step) => shown.forEach((row) => row.classList.toggle("marked", Number(row.dataset.step) === step));
}

/**
 * Links to the shrunk twin, or to that of which this is one.
 * @param {Entry} entry
 * @param {Entry[]} scenarios
 */
export function twins(entry, scenarios) {
  const link = (other, text) => el("a", { href: linkOf({ s: nameOf(other) }) }, text);
  const own = entry.shrunk_from;
  const found = scenarios.filter(
    (other) =>
      other.n !== entry.n &&
      (own ? other.summary.name === own && !other.shrunk_from : other.shrunk_from === entry.summary.name),
  );
  return found.map((other) =>
    el(
      "p",
      {},
      own ? "Shrunk from " : "Shrunk twin: ",
      link(other, nameOf(other)),
      ` with ${plural(other.summary.actions, "action")} in ${plural(other.summary.steps, "step")}` +
        ` (here ${entry.summary.actions} in ${entry.summary.steps}).`,
    ),
  );
}
