// The link is the state: what is open, which moment, which layers and filters. So a link shows another what one sees.

/** @import { Entry } from "./data" */

/**
 * The parts of the link after `#`, as an object of texts.
 * @returns {Record<string, string>}
 */
export function linked() {
  return Object.fromEntries(new URLSearchParams(location.hash.replace(/^#/, "")));
}

/**
 * Changes parts of the link; `null` takes a part away. With `step`, the way back leads here.
 * @param {Record<string, string | null | undefined>} changes
 */
export function relink(changes, step = false) {
  const parts = { ...linked(), ...changes };
  const kept = Object.entries(parts).filter(([, value]) => value !== null && value !== undefined && value !== "");
  const hash = linkOf(/** @type {Record<string, string>} */ (Object.fromEntries(kept)));
  if (hash === location.hash) return;
  if (step) location.hash = hash;
  else history.replaceState(null, "", hash || "#");
}

/**
 * A link with these parts.
 * @param {Record<string, string>} parts
 */
export function linkOf(parts) {
  const text = new URLSearchParams(parts).toString().replaceAll("%2C", ",").replaceAll("%2F", "/");
  return `#${text}`;
}

/** The parts of a link that belong to an open scenario. */
const OF_A_SCENARIO = ["s", "t", "layers", "with"];

/** The link to the list, with its filters. */
export function linkToList() {
  const parts = linked();
  for (const part of OF_A_SCENARIO) delete parts[part];
  return linkOf(parts);
}

/**
 * What a link calls a scenario: its file, so that a link still holds when other scenarios come or go.
 * @param {Entry} entry
 */
export const nameOf = (entry) => entry.file.replace(/\.ava$/, "");

/**
 * The scenario of that name, or of a file that ends with it; `null` if there is none.
 * @param {Entry[]} scenarios
 * @param {string | null | undefined} name
 */
export function byName(scenarios, name) {
  if (!name) return null;
  const ends = (/** @type {Entry} */ entry) => nameOf(entry).endsWith(`/${name}`);
  return scenarios.find((entry) => nameOf(entry) === name) ?? scenarios.find(ends) ?? null;
}

/** What `with` says of the other driving system's drive, and of none beside; scenarios stand there by name. */
export const COMPARED = "~compared";
export const NOTHING = "~nothing";

export const COPY_LINK = "Copy link";

/**
 * Copies the whole link. Where the browser forbids that, it is shown to be copied by hand.
 * @param {HTMLElement} button
 */
export async function copyLink(button) {
  const text = location.href;
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    window.prompt("Link to this moment", text);
  }
  setTimeout(() => (button.textContent = COPY_LINK), 1500);
}
