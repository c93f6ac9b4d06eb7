// What the page begins with, and what the link leads to.
import { index } from "./decode.js";
import { el, refill } from "./dom.js";
import { byName, linked, nameOf } from "./link.js";
import { showOverview, showTop } from "./overview.js";
import { key, showKeys } from "./keys.js";
import { closeWatch, opened, showWatch } from "./watch.js";

const data = index();
const main = /** @type {HTMLElement} */ (document.getElementById("main"));
/** @type {string | null} */
let shown = null;

/** Shows what the link asks for. */
async function route() {
  const { s: wanted = null } = linked();
  const found = byName(data.scenarios, wanted);
  // With one scenario and nothing around it, that one is the page.
  const entry = found ?? (data.scenarios.length === 1 && !data.overview ? data.scenarios[0] : null);
  const was = shown;
  shown = entry ? nameOf(entry) : "overview";
  document.title = entry ? `${entry.summary.name} · avastra` : `${data.title} · avastra`;
  if (!entry) {
    closeWatch();
    showOverview(main, data, wanted);
  } else if (!(await showWatch(main, data, entry))) {
    // Meanwhile something else was asked for.
    return;
  }
  main.dataset.ready = shown;
  if (was !== null && was !== shown) {
    window.scrollTo(0, 0);
    main.focus({ preventScroll: true });
  }
}

/** For the console of a browser, and for tests: what is open, with all its numbers. */
/** @type {any} */ (window).avastra = { data, opened };

function begin() {
  showTop(document.getElementById("top"), data);
  refill(
    document.getElementById("foot"),
    el(
      "p",
      {},
      `avastra ${data.avastra}, engine ${data.engine}. Everything is in this file; it asks nothing of a network. ` +
        "Press ? for keys.",
    ),
  );
  if (typeof DecompressionStream === "undefined") {
    refill(
      main,
      el("p", { class: "warning" }, "This browser is too old for this page: it needs DecompressionStream (2023)."),
    );
    return;
  }
  window.addEventListener("hashchange", () => route().catch(failed));
  document.addEventListener("keydown", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const isTyping = target.closest("input:not([type=range]):not([type=checkbox]), select, textarea, dialog");
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping) return;
    if (event.key === "?") showKeys();
    else if (!opened() || isPress(event) || !key(event, opened())) return;
    event.preventDefault();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => opened()?.repaint());
  // Paper is light: canvases are painted anew in the colours that `print` has in the sheet.
  const paint = (/** @type {boolean} */ isPrinted) => () => {
    document.documentElement.classList.toggle("printed", isPrinted);
    opened()?.repaint();
  };
  window.addEventListener("beforeprint", paint(true));
  window.addEventListener("afterprint", paint(false));
  route().catch(failed);
}

/** A button and a link know what space and enter mean. */
function isPress(event) {
  return event.key === " " && event.target.closest("button, a, summary, input[type=checkbox]");
}

function failed(error) {
  refill(main, el("p", { class: "warning" }, `This part of the page cannot be shown: ${error.message}`));
  throw error;
}

begin();
