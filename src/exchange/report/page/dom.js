// Elements of the page, made in one call.

/** An element with attributes and children; `on…` attributes are listeners, a text is a text. */
export function el(name, attributes = {}, ...children) {
  return filled(document.createElement(name), attributes, children);
}

/** An SVG element with attributes and children, as `el` makes them. */
export function svg(name, attributes = {}, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", name), attributes, children);
}

function filled(element, attributes, children) {
  for (const [key, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else element.setAttribute(key, value === true ? "" : String(value));
  }
  element.append(...children.flat(2).filter(isShown));
  return element;
}

/** Puts new children into an element. */
export function refill(element, ...children) {
  element.replaceChildren(...children.flat(2).filter(isShown));
}

function isShown(child) {
  return child !== null && child !== undefined && child !== false;
}

/** A table with a caption; a cell is a text, a number or an element. The first of a row is its heading. */
export function table(caption, heads, rows, attributes = {}) {
  const isNumeric = (value) =>
    typeof value === "number" || /^[-\d.,]+( [\w/%]+)?$/.test(String(value?.textContent ?? value));
  const cell = (value, at) => {
    const numeric = isNumeric(value);
    const shown = typeof value === "number" ? value.toLocaleString("en") : (value ?? "–");
    return at === 0 ? el("th", { scope: "row" }, shown) : el("td", { class: numeric ? "number" : null }, shown);
  };
  return el(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": `Table: ${caption}` },
    el(
      "table",
      attributes,
      el("caption", {}, caption),
      el(
        "thead",
        {},
        el(
          "tr",
          {},
          heads.map((head, at) =>
            el("th", { scope: "col", class: at > 0 && isNumeric(rows[0]?.[at]) ? "number" : null }, head),
          ),
        ),
      ),
      el(
        "tbody",
        {},
        rows.map((row) => (row instanceof Element ? row : el("tr", {}, row.map(cell)))),
      ),
    ),
  );
}

let announced = 0;

/** Says something to a screen reader, and shows it for a moment. */
export function announce(text) {
  const place = document.getElementById("said");
  if (!place) return;
  place.textContent = text;
  clearTimeout(announced);
  announced = window.setTimeout(() => (place.textContent = ""), 2500);
}

/** A colour or another value of the style sheet. */
export function styled(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
