// What the engine's short words mean, and figures as people read them.

export const VERDICTS = {
  avoidable: "a careful driver would have avoided it",
  beyond_reference: "only a driver without any delay would have avoided it",
  unavoidable: "no driver that was tried avoids it",
};

export const PRIORITIES = {
  ego: "the ego vehicle had priority",
  other: "the other had priority",
  none: "neither had priority",
};

export const DRIVERS = {
  cc: "careful driver (UN R157)",
  fsm: "fuzzy safety model (UN R157)",
  rss: "responsibility-sensitive safety",
  r157: "least performance of UN R157",
};

export const ENDS = {
  arrived: "it arrived",
  stalled: "it stood for several steps",
  blocked: "others blocked its way",
  astray: "it left its lane",
  limit: "the step limit was reached",
  script: "the scenario ends here",
};

/** A figure with a unit, `12.3 s`. */
export function figure(value, unit = "", digits = 1) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const text = value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
  return unit ? `${text} ${unit}` : text;
}

export const kmh = (mps) => figure(mps * 3.6, "km/h", 0);

/** `1 scenario`, `2 scenarios`. */
export function plural(count, noun) {
  return `${count.toLocaleString("en")} ${noun}${count === 1 ? "" : "s"}`;
}

/** The collision that a scenario is about: the first that counts, or the first. */
export function mainCollision(summary) {
  return summary.collisions.find((collision) => collision.counted) ?? summary.collisions[0] ?? null;
}

/** A collision in a sentence. */
export function collisionInWords(collision, road) {
  const others = { standing: "standing", along: "moving along", oncoming: "oncoming" };
  const how = others[collision.approach] ?? `coming ${collision.approach}`;
  const struck = collision.struck ? " runs into the ego vehicle" : " is hit by the ego vehicle";
  return (
    `${collision.body} #${collision.obstacle} (${how})${struck} at ${figure(collision.at_s, "s", 2)}` +
    ` on ${road}: the ego vehicle drives ${kmh(collision.ego_mps)}, contact at its ${collision.side}`
  );
}

/** A cause in words. */
export function causeInWords(cause) {
  if (!cause) return "not looked for";
  return cause.length === 0 ? "none found" : cause.join(" and ");
}
