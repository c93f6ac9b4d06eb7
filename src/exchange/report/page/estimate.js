// An estimate's result: how probable the event is in an episode, its rate, and where the probability lies.
import { el, table } from "./dom.js";
import { intervals } from "./charts.js";
import { figure, plural, short, simulated } from "./words.js";

const EVENTS = { counted: "a collision that counts", collision: "a collision", breach: "a breach" };

/** An interval in brackets, ∞ without an upper end. */
const bounds = (found) => (found ? ` [${short(found.low)}, ${found.high === null ? "∞" : short(found.high)}]` : "");
const withBounds = (value, found) => (value === null ? "–" : `${short(value)}${bounds(found)}`);

const METHODS = {
  count: "Method: counting; exact intervals after Clopper and Pearson.",
  probe:
    "Method: dangerous rows are tried out beside those that chance chooses, and weighted; " +
    "intervals after Fay and Feuer.",
};

/** The whole estimate; `frame` says what its rates are rates of. */
export function estimate(results, frame) {
  const { event, method, parts, parts_wanted: wanted, missed_goals: missed = [], roads, together, mass } = results;
  const all = together && roads.length > 1 ? [...roads, { road: "all roads", ...together }] : roads;
  const title = `Probability of an episode with ${EVENTS[event] ?? `a breach of ${event}`}`;
  const plotted = all.map((one) => [one.road, one.probability, one.interval.low, one.interval.high]);
  const rows = all.map((one) => [
    one.road,
    withBounds(one.probability, one.interval),
    withBounds(one.per_1000_km, one.per_1000_km_interval),
    withBounds(one.per_hour, one.per_hour_interval),
    one.episodes,
    figure(one.driven_km, "", 1),
    simulated(one.simulated_h),
  ]);
  const heads = ["Road", "Probability", "in 1000 km", "in an hour", "Episodes", "km", "Simulated"];
  const shares = mass.map(({ share, row, road, events }) => [
    row ?? "what no action made appear",
    road,
    figure(100 * share, "%", 1),
    events,
  ]);
  return el(
    "section",
    { class: "study", "aria-labelledby": "h-estimate" },
    el("h2", { id: "h-estimate" }, "How often"),
    parts < wanted && el("p", { class: "muted" }, `${parts} of ${wanted} parts were played.`),
    missed.length > 0 && el("p", { class: "warning" }, `It missed its goals: ${missed.join("; ")}.`),
    el("p", {}, `In 1000 km and in an hour: ${frame}. ${METHODS[method] ?? ""}`),
    el("div", { class: "grid" }, intervals(`${title}, with 95 % intervals`, plotted)),
    gain(together),
    table(`${title}; in brackets: 95 % intervals`, heads, rows),
    shares.length > 0 && table("Where the probability lies", ["Row", "Road", "Share", "Events"], shares),
  );
}

/** What the method was worth. */
function gain(together) {
  if (!together) return null;
  const { gain: factor, effective_events: events } = together;
  const told = [];
  if (events !== null)
    told.push(`The events that were met say as much as ${plural(Math.round(events), "event")} of one weight.`);
  if (factor !== null) {
    const [times, how] = factor >= 1 ? [factor, "less"] : [1 / factor, "more"];
    told.push(`Roughly ${short(times)} times ${how} simulated time than counting for an interval as narrow.`);
  }
  return told.length > 0 && el("p", { class: "muted" }, told.join(" "));
}
