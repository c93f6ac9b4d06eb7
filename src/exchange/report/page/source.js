// The scenario's own file beside its replay, with the row of the moment marked.
import { el, refill } from "./dom.js";

/** Lines of a source, each with the number of the step that it belongs to, or -1. */
export function linesOf(source) {
  let inSteps = false;
  let step = -1;
  let depth = 0;
  return source
    .replace(/\n$/, "")
    .split("\n")
    .map((text) => {
      if (/^\s*steps\s*\{/.test(text)) {
        inSteps = true;
        depth = 1;
        return { text, step: -1 };
      }
      if (!inSteps) return { text, step: -1 };
      const begin = /^\s*(\d+)\s*:/.exec(text);
      if (begin && depth === 1) step = Number(begin[1]);
      const code = text.replace(/"[^"]*"/g, "").replace(/\/\/.*$/, "");
      depth += (code.match(/\{/g) ?? []).length - (code.match(/\}/g) ?? []).length;
      if (depth <= 0) {
        inSteps = false;
        return { text, step: -1 };
      }
      return { text, step };
    });
}

/** Shows a source; gives a function that marks the row of a step. */
export function showSource(place, source, seekStep) {
  const lines = linesOf(source);
  const shown = lines.map(({ text, step }, i) => {
    const inside = coloured(text);
    const attributes = { class: "line", "data-step": step };
    if (step >= 0) {
      attributes.onclick = () => seekStep(step);
      attributes.class = "line live";
    }
    return el("span", attributes, el("span", { class: "no", "aria-hidden": "true" }, String(i + 1)), inside);
  });
  const code = el(
    "pre",
    { class: "source", tabindex: "0", "aria-label": "Source of the scenario" },
    el("code", {}, shown),
  );
  refill(place, code);
  let marked = -2;
  return (step) => {
    if (step === marked) return;
    marked = step;
    for (const line of shown) line.classList.toggle("marked", Number(line.dataset.step) === step);
    const first = shown.find((line) => Number(line.dataset.step) === step);
    if (first) code.scrollTop = Math.max(0, first.offsetTop - code.offsetTop - code.clientHeight / 3);
  };
}

const WORDS = "scenario|origin|road|start|steps|expect|with|use|digest|language|once|after|failed";
const PARTS = new RegExp(`(//.*$|"(?:[^"\\\\]|\\\\.)*"|\\b(?:${WORDS})\\b)`);

/** A line with comments, texts and words of the language apart. */
function coloured(text) {
  const parts = text.split(PARTS);
  return parts.map((part, i) => {
    if (i % 2 === 0) return part;
    const kind = part.startsWith("//") ? "remark" : part.startsWith('"') ? "text" : "word";
    return el("span", { class: kind }, part.length > 90 ? `${part.slice(0, 86)}…"` : part);
  });
}
