// Drives a report in Chromium, as a person would; see report.sh. Arguments: a folder for what it makes, the page to try,
// pages of 50 and 500 scenarios.
import assert from "node:assert/strict";
import { existsSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { inflateSync } from "node:zlib";

const [, , work, page, page50, page500, ...others] = process.argv;
const require = createRequire(join(work, "package.json"));
const puppeteer = (await import(pathToFileURL(require.resolve("puppeteer-core")))).default;
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const executablePath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
assert(executablePath, "no Chromium found: install Debian's package `chromium`, or say CHROMIUM=/path/to/it");

const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu"] });
const wrong = [];
const asked = [];

/** A tab whose errors and requests are kept. */
async function tab(width = 1440, height = 1000, scheme = "light") {
  const one = await browser.newPage();
  await one.setViewport({ width, height, deviceScaleFactor: width < 600 ? 2 : 1, hasTouch: width < 600, isMobile: width < 600 });
  await one.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
  one.on("console", (message) => ["error", "warn"].includes(message.type()) && wrong.push(message.text()));
  one.on("pageerror", (error) => wrong.push(error.message));
  one.on("request", (request) => request.url().startsWith("data:") || asked.push(request.url()));
  return one;
}

async function open(one, file, hash = "") {
  // A tab behind another draws no frames.
  await one.bringToFront();
  await one.goto("about:blank");
  await one.goto(pathToFileURL(file).href + hash);
  await ready(one);
}

/** Waits until the page shows what it was asked for. */
async function ready(one, shown = null) {
  await one.waitForFunction((wanted) => { const now = document.getElementById("main").dataset.ready; return wanted ? now === wanted : now; }, {}, shown);
  await one.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

/** When something was first seen, ms after the page was asked for. */
async function painted(one) {
  await one.bringToFront();
  await one.waitForFunction(() => performance.getEntriesByName("first-contentful-paint").length > 0);
  return one.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0].startTime);
}

async function accessible(one, name) {
  await one.evaluate(axe);
  const found = await one.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const told = found.violations.map((one) => `${name}: ${one.id}: ${one.help}: ${one.nodes.slice(0, 3).map((node) => node.html.slice(0, 120)).join(" | ")}`);
  assert.deepEqual(told, [], told.join("\n"));
  console.log(`${name}: no violation of ${found.passes.length} rules that axe-core tried`);
}

const time = (one) => one.evaluate(() => window.avastra.opened().clock.timeS);
const picture = (one, at = 0) => one.evaluate((number) => document.querySelectorAll("canvas.stage")[number].toDataURL(), at);

// The overview: painted soon, filters that live in the link.
const wide = await tab();
await open(wide, page);
const paint = await painted(wide);
console.log(`first paint of ${size(page)}: ${Math.round(paint)} ms`);
const tick = await wide.evaluate(() => window.avastra.data.quantisation.tick_s);
const said = await wide.$eval(".conditions", (list) => list.textContent);
assert.match(said, /Space.*avastra45.*Driving system.*never_yields.*Seed3/, "the first screen says what was played");
assert.match(await wide.$eval("#compared", (line) => line.textContent), /careful driver.*×/, "and what the comparison gave");
assert.equal(await wide.$("#refuted"), null, "all replay as they claim");
const all = await wide.$$eval("#list tbody tr", (rows) => rows.length);
assert(all > 1, "the page lists scenarios");
await wide.screenshot({ path: join(work, "overview_wide.png"), fullPage: true });
await accessible(wide, "overview");
const road = await wide.$eval("#filter-road option:nth-child(2)", (option) => option.value);
await wide.select("#filter-road", road);
const roads = await wide.$$eval("#list tbody tr td:nth-child(3)", (cells) => cells.map((cell) => cell.textContent));
assert(roads.length > 0 && roads.length < all && roads.every((one) => one === road), `filtered by ${road}: ${roads}`);
assert.match(await wide.evaluate(() => location.hash), new RegExp(`road=${road}`));
const filtered = await wide.evaluate(() => location.hash);
await open(wide, page, filtered);
assert.equal(await wide.$$eval("#list tbody tr", (rows) => rows.length), roads.length, "the link brings the filter back");
await wide.click("#clear");
await wide.waitForFunction((count) => document.querySelectorAll("#list tbody tr").length === count, {}, all);
console.log(`filters: ${roads.length} of ${all} on ${road}, by the link too`);

// The worst scenario: play, scrub, step, to the collision.
const worst = await wide.$eval("#list tbody tr:first-child a", (link) => new URLSearchParams(link.hash.slice(1)).get("s"));
await wide.click("#list tbody tr:first-child a");
await ready(wide, worst);
assert.equal(await wide.$$eval("canvas.stage", (stages) => stages.length), 2, "the other drive is there at first");
assert((await wide.$eval("#change", (line) => line.textContent)).includes("careful driver"), "with its result");
await wide.select("#with", "~nothing");
await wide.waitForFunction(() => document.querySelectorAll("canvas.stage").length === 1);
await ready(wide, worst);
const start = await time(wide);
await wide.keyboard.press("Space");
await new Promise((done) => setTimeout(done, 600));
await wide.keyboard.press("Space");
assert((await time(wide)) > start + 0.2, "it plays");
await wide.select("#rate", "8");
await wide.$eval("#scrub", (range) => { range.value = 1; range.dispatchEvent(new Event("input")); });
assert(Math.abs((await time(wide)) - 1) < 1e-6, "it scrubs");
await wide.evaluate(() => document.activeElement.blur());
await wide.keyboard.press("ArrowRight");
assert(Math.abs((await time(wide)) - 1 - tick) < 1e-6, "→ is a tick");
await wide.keyboard.press("ArrowLeft");
assert(Math.abs((await time(wide)) - 1) < 1e-6, "← is a tick back");
await wide.keyboard.down("Shift");
await wide.keyboard.press("ArrowRight");
await wide.keyboard.up("Shift");
const steps = await wide.evaluate(() => window.avastra.opened().recording.header.steps.map((step) => step.at_s));
assert.equal(await time(wide), steps[1], "shift → is a step");
await wide.keyboard.press("c");
const collision = await wide.evaluate(() => window.avastra.opened().recording.collision());
assert(Math.abs((await time(wide)) - collision.at_s) < 1e-6, "c is the collision");
const pick = await wide.evaluate(() => window.avastra.opened().recording.header.held.length);
assert(pick > 1, "something held the speed");
console.log(`plays, scrubs, steps; the collision is at ${collision.at_s.toFixed(2)} s`);

// Each layer changes the picture, from far enough that all are in it.
await wide.evaluate((at) => { const { clock, views } = window.avastra.opened(); views[0].zoomed = 5; clock.seek(at - 1.5); }, collision.at_s);
for (const name of await wide.$$eval(".layers input", (boxes) => boxes.map((box) => box.name))) {
  const before = await picture(wide);
  await wide.click(`input[name="${name}"]`);
  const after = await picture(wide);
  assert.notEqual(before, after, `layer ${name} is drawn`);
  await wide.click(`input[name="${name}"]`);
  assert.equal(await picture(wide), before, `layer ${name} comes back`);
}
console.log("each layer is drawn, and gone without its mark");
await wide.click("#keys");
await wide.waitForSelector("#help[open]");
await accessible(wide, "keys");
await wide.keyboard.press("Escape");
await accessible(wide, "replay");
await wide.screenshot({ path: join(work, "replay_wide.png"), fullPage: true });

// A link to a moment: what one copies, another sees.
const [linked, number] = await wide.evaluate((name) => {
  const other = window.avastra.data.scenarios.find((one) => !one.shrunk_from && one.file !== `${name}.ava`);
  return [other.file.replace(/\.ava$/, ""), other.n];
}, worst);
await open(wide, page, `#s=${linked}&with=~nothing&t=5.00&layers=truth,planned`);
assert.equal(await time(wide), 5);
assert.deepEqual(await wide.$$eval(".layers input:checked", (boxes) => boxes.map((box) => box.name)), ["truth", "planned"]);
const marked = await wide.$$eval(".source .marked", (lines) => lines.map((line) => line.textContent.trim()));
assert(marked.length > 0 && / 0:|^\d+\s+0:/.test(marked[0]), `the row of the moment is marked: ${marked}`);
console.log(`a deep link opens its moment and layers; marked in the source: ${marked[0]}`);

// Numbers read back: those that the page uses are those of the file, read here by other code.
const [header, columns] = unpacked(readFileSync(page, "utf8"), `s${number}`);
let chance = 20261122;
for (let i = 0; i < 20; i += 1) {
  chance = (chance * 1103515245 + 12345) % 2147483648;
  const at = chance % columns[header.ego.speed_mps].length;
  const found = await wide.evaluate((number) => window.avastra.opened().recording.ego(number * window.avastra.data.quantisation.tick_s), at);
  for (const [name, column] of [["x", header.ego.places[0]], ["y", header.ego.places[1]], ["heading", header.ego.places[2]], ["speed", header.ego.speed_mps], ["proc", header.ego.proc]]) {
    assert(Math.abs(found[name] - columns[column][at]) < 1e-6, `${name} at tick ${at}`);
  }
  const others = await wide.evaluate((number) => window.avastra.opened().recording.obstacles(number * window.avastra.data.quantisation.tick_s), at);
  for (const other of others) {
    const one = header.obstacles.find((known) => known.id === other.id);
    assert(Math.abs(other.x - columns[one.places[0]][at - one.from_tick]) < 1e-6, `${other.id} at tick ${at}`);
  }
}
console.log("20 random ticks: the page uses the numbers of the file (tests/it/report.rs holds those against the world)");

// Of two quick clicks the later one counts; a link whose scenario is gone says so.
await open(wide, page);
await wide.evaluate(([first, second]) => {
  location.hash = `#s=${first}`;
  setTimeout(() => (location.hash = `#s=${second}`));
}, [linked, worst]);
await ready(wide, worst);
await new Promise((done) => setTimeout(done, 300));
assert.equal(await wide.$eval("h1", (title) => title.textContent), worst.replace(/^.*\//, ""));
await open(wide, page, "#s=critical/gone_0001");
assert.match(await wide.$eval(".warning", (line) => line.textContent), /not on this page/);
console.log("two quick clicks end with the later one; a dead link says so");

// Two on one clock.
await open(wide, page, `#s=${worst}&t=3.00`);
assert.equal(await wide.$$eval("canvas.stage", (all) => all.length), 2);
await wide.evaluate((at) => window.avastra.opened().clock.seek(at), collision.at_s);
assert.notEqual(await picture(wide, 0), await picture(wide, 1), "the careful driver is elsewhere");
await accessible(wide, "comparison");
await wide.screenshot({ path: join(work, "compare_wide.png") });
const pdf = await wide.pdf({ format: "A4", printBackground: true });
writeFileSync(join(work, "replay.pdf"), pdf);
assert(pdf.length > 20_000, "it prints");
console.log(`two drives on one clock; prints to ${(pdf.length / 1e6).toFixed(1)} MB of PDF`);

// Dark, and on a phone.
const dark = await tab(1440, 1000, "dark");
await open(dark, page, `#s=${worst}&t=${(collision.at_s - 1).toFixed(2)}`);
await accessible(dark, "replay, dark");
await dark.screenshot({ path: join(work, "replay_dark.png") });
const paper = () => dark.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue("--paper").trim());
const shown = [await paper(), await picture(dark)];
await dark.evaluate(() => window.dispatchEvent(new Event("beforeprint")));
assert.deepEqual([await paper(), (await picture(dark)) === shown[1]], ["#ffffff", false], "paper is light");
await dark.evaluate(() => window.dispatchEvent(new Event("afterprint")));
assert.deepEqual([await paper(), (await picture(dark)) === shown[1]], [shown[0], true], "and the screen is dark again");
writeFileSync(join(work, "replay_dark.pdf"), await dark.pdf({ format: "A4", printBackground: true }));
await dark.emulateMediaType("print");
await dark.evaluate(() => window.dispatchEvent(new Event("beforeprint")));
await dark.screenshot({ path: join(work, "replay_print.png"), fullPage: true });
await dark.emulateMediaType(null);
await dark.evaluate(() => window.dispatchEvent(new Event("afterprint")));
await open(dark, page);
await accessible(dark, "overview, dark");
const phone = await tab(390, 844);
for (const [name, hash] of [["overview", ""], ["replay", `#s=${worst}&with=~nothing`], ["compare", `#s=${worst}`]]) {
  await open(phone, page, hash);
  const [wider, seen] = await phone.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth]);
  assert(wider <= seen, `${name} on a phone is ${wider} px wide`);
  await accessible(phone, `${name} on a phone`);
  await phone.screenshot({ path: join(work, `${name}_phone.png`) });
}

// A training, an estimate, and what else is given.
for (const file of others) {
  const name = file.replace(/^.*\//, "").replace(/\.html$/, "");
  await open(wide, file);
  await accessible(wide, name);
  await wide.screenshot({ path: join(work, `${name}.png`), fullPage: true });
}

// Sizes.
for (const [file, most] of [[page50, 3e6], [page500, 30e6]]) {
  const one = await tab();
  await open(one, file);
  const first = await painted(one);
  const count = await one.evaluate(() => window.avastra.data.scenarios.length);
  console.log(`${count} scenarios: ${size(file)}, first paint after ${Math.round(first)} ms`);
  assert(statSync(file).size < most);
  await one.close();
}
await browser.close();
const own = [page, page50, page500, ...others].map((file) => pathToFileURL(file).href);
assert.deepEqual(asked.filter((url) => url !== "about:blank" && !own.some((known) => url.startsWith(known))), [], "no request");
assert.deepEqual(wrong, [], "no error in the console");
console.log("no request, no error in the console");

function size(file) {
  return `${(statSync(file).size / 1e6).toFixed(2)} MB`;
}

/** Header and columns of an element of a page. */
function unpacked(html, id) {
  const text = new RegExp(`id="${id}">([^<]*)<`).exec(html)[1];
  const bytes = inflateSync(Buffer.from(text, "base64"));
  const end = 4 + bytes.readUInt32LE(0);
  const whole = JSON.parse(bytes.subarray(4, end).toString());
  let at = end;
  const next = () => {
    let value = 0n;
    for (let shift = 0n; ; shift += 7n) {
      const byte = bytes[at];
      at += 1;
      value |= BigInt(byte & 0x7f) << shift;
      if (byte < 0x80) return Number(value & 1n ? -(value >> 1n) - 1n : value >> 1n);
    }
  };
  const read = ([step, order, count]) => {
    let values = Array.from({ length: count }, next);
    for (let i = 0; i < order; i += 1) {
      let sum = 0;
      values = values.map((value) => (sum += value));
    }
    return values.map((value) => value * step);
  };
  return [whole.header, whole.columns.map(read)];
}
