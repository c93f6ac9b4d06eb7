// The page's modules without a browser: `node --test tests/page/*.test.mjs`. `tests/interop/report.sh` opens whole pages in one.
import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { test } from "node:test";
import { Script } from "node:vm";
import { deflateSync } from "node:zlib";

import { TimeAxis } from "../../src/exchange/report/page/axis.js";
import { Clock, RATES } from "../../src/exchange/report/page/clock.js";
import { unpackedText } from "../../src/exchange/report/page/decode.js";
import { key } from "../../src/exchange/report/page/keys.js";
import { filtered, kindOf } from "../../src/exchange/report/page/list.js";
import { byName, linkOf, linkToList, linked, relink } from "../../src/exchange/report/page/link.js";
import { Recording } from "../../src/exchange/report/page/moment.js";
import { Plots } from "../../src/exchange/report/page/plots.js";
import { LAYERS } from "../../src/exchange/report/page/view.js";
import { mainCollision, mainFinding, recursInWords } from "../../src/exchange/report/page/words.js";

/** Frames as a browser hands them out, at times that the test says. */
function browser() {
  const due = new Map();
  let [last, nowMs] = [0, 0];
  globalThis.requestAnimationFrame = (frame) => {
    last += 1;
    due.set(last, frame);
    return last;
  };
  globalThis.cancelAnimationFrame = (number) => due.delete(number);
  globalThis.performance.now = () => nowMs;
  const pass = (ms) => {
    nowMs += ms;
    const frames = [...due.values()];
    due.clear();
    frames.forEach((frame) => frame(nowMs));
  };
  return { due, pass };
}

test("a clock plays at its rate and stops at the end", () => {
  const { due, pass } = browser();
  const seen = [];
  const clock = new Clock(2, 0.02, (timeS) => seen.push(timeS));
  clock.play();
  pass(500);
  assert.equal(clock.timeS, 0.5);
  clock.faster(1);
  assert.equal(clock.rate, 2);
  pass(500);
  assert.equal(clock.timeS, 1.5);
  pass(500);
  assert.deepEqual([clock.timeS, clock.playing, due.size], [2, false, 0]);
  assert.equal(seen.at(-1), 2);
  clock.play();
  assert.equal(clock.timeS, 0, "from the end it begins anew");
});

test("a clock that is stopped and started within a frame plays once", () => {
  const { due, pass } = browser();
  const clock = new Clock(10, 0.02, () => {});
  clock.play();
  clock.pause();
  clock.play();
  clock.stop();
  assert.deepEqual([clock.playing, due.size], [false, 0]);
  clock.play();
  assert.equal(due.size, 1);
  pass(1000);
  assert.equal(clock.timeS, 1);
});

test("ticks are whole, and rates have ends", () => {
  browser();
  const clock = new Clock(10, 0.02, () => {});
  clock.seek(1.013);
  clock.ticks(1);
  assert.ok(Math.abs(clock.timeS - 1.02) < 1e-9);
  clock.ticks(-1);
  assert.ok(Math.abs(clock.timeS - 1) < 1e-9);
  clock.seek(-3);
  assert.equal(clock.timeS, 0);
  clock.seek(30);
  assert.equal(clock.timeS, 10);
  RATES.forEach(() => clock.faster(1));
  assert.equal(clock.rate, RATES.at(-1));
  RATES.forEach(() => clock.faster(-1));
  assert.equal(clock.rate, RATES[0]);
});

/** Packs whole numbers as `report/columns.rs` does, but written anew. */
function packed(header, columns) {
  const bytes = [];
  const layouts = columns.map(({ step, order, values }) => {
    let whole = values;
    for (let round = 0; round < order; round += 1) whole = whole.map((value, i) => value - (i ? whole[i - 1] : 0));
    for (const value of whole) {
      let zigzag = value < 0 ? -2 * value - 1 : 2 * value;
      for (; zigzag >= 128; zigzag = Math.floor(zigzag / 128)) bytes.push((zigzag % 128) + 128);
      bytes.push(zigzag);
    }
    return [step, order, values.length];
  });
  const text = Buffer.from(JSON.stringify({ columns: layouts, header }));
  const length = Buffer.alloc(4);
  length.writeUInt32LE(text.length);
  return deflateSync(Buffer.concat([length, text, Buffer.from(bytes)])).toString("base64");
}

test("packed columns come back, of any order, sign and size", async () => {
  const values = [0, -1, 63, 64, -64, -65, 8191, 2 ** 40, -(2 ** 40), 7];
  const columns = [0, 1, 2].map((order) => ({ step: 1, order, values }));
  columns.push({ step: 0.01, order: 1, values: [100, 129, 57] }, { step: 1, order: 0, values: [] });
  const found = await unpackedText(packed({ any: "Überholer" }, columns));
  assert.equal(found.header.any, "Überholer");
  for (const column of found.columns.slice(0, 3)) assert.deepEqual([...column], values);
  assert.deepEqual([...found.columns[3]], [1, 1.29, 0.57]);
  assert.equal(found.columns[4].length, 0);
});

/** Three ticks of an ego vehicle that gains 1 m a tick; another one is there from tick 1 on. */
function recording() {
  const rising = [{ at_s: 0, recurred: 1, replays: 4, is_likely: false }, { at_s: 0.02, recurred: 4, replays: 4, is_likely: true }];
  const columns = [[0, 1, 2], [0, 0, 0], [0, 0.2, 0.4], [50, 50, 50], [5, 7], [0, 0], [1, 0], [4, 6], [0, 2]];
  const ego = { places: [0, 1, 2], brake_lights: [[1, true], [2, false]], length_m: 4.7, width_m: 1.9 };
  for (const name of ["speed_mps", "acceleration_mps2", "steer_rad", "throttle_pct", "brake_pct", "proc"]) ego[name] = 3;
  const other = { id: 1, from_tick: 1, places: [4, 5, 5], speed_mps: 4, brake_lights: [], lights: [[2, "Hazard"]] };
  const way = { from_s: 0.02, every_s: 0.02, places: [4, 5, 5], speed_mps: 4 };
  const header = {
    ego, obstacles: [other], tracks: [], plans: { counts: 6, x_m: 7, y_m: 8 }, steps: [{ at_s: 0 }, { at_s: 0.04 }],
    held: [[0, "limit", "free"], [0.03, "leader", "follows"]], skies: [], signals: { 3: [[0, "red"], [2, "green"]] },
    collisions: [{ at_s: 0.02, counted: false, moments: [] }, { at_s: 0.04, counted: true, moments: rising }],
    summary: { breaches: [] },
  };
  const quantisation = { tick_s: 0.02, perceived_s: 0.1, thought_s: 0.1 };
  return { recording: new Recording({ header, columns: columns.map((of) => Float64Array.from(of)) }, quantisation), way };
}

test("a moment is between its ticks", () => {
  const { recording: of } = recording();
  assert.equal(of.endS, 0.04);
  assert.equal(of.ego(0.03).x, 1.5);
  assert.ok(Math.abs(of.ego(0.01).heading - 0.1) < 1e-9);
  assert.deepEqual([0, 0.02, 0.03, 0.04].map((timeS) => of.ego(timeS).braking), [false, true, true, false]);
  assert.equal(of.ego(99).x, 2, "after the end it is where it was");
});

test("others are there from their first tick on, with the lights of the moment", () => {
  const { recording: of } = recording();
  assert.deepEqual(of.obstacles(0.01), []);
  assert.deepEqual(of.obstacles(0.03).map(({ x, lights }) => [x, lights]), [[6, undefined]]);
  assert.equal(of.obstacles(0.04)[0].lights, "Hazard");
});

test("what was said last holds, and steps and lights are those of the moment", () => {
  const { recording: of } = recording();
  assert.deepEqual([of.held(0.01), of.held(0.03), of.sky(0.01)], ["limit", "leader", ""]);
  assert.deepEqual([of.step(0.03), of.step(0.04)], [0, 1]);
  assert.deepEqual([of.signal(3, 0.02), of.signal(3, 0.04), of.signal(9, 0)], ["red", "green", null]);
});

test("a finding becomes likely at the first moment with more than three quarters", () => {
  const { recording: of } = recording();
  assert.deepEqual([of.chances().at_s, of.rise().at_s], [0.04, 0.02]);
});

test("a careful driver is there once it takes over, until its end", () => {
  const { recording: of, way } = recording();
  assert.equal(of.driver({ ...way, from_s: null }, 0.03), null);
  assert.equal(of.driver(way, 0.01), null);
  assert.equal(of.driver(way, 0.03).x, 6);
  assert.equal(of.driver(way, 0.05), null);
  assert.deepEqual(of.wayOf(way), [{ x: 5, y: 0 }, { x: 7, y: 0 }]);
});

test("a plan has the points of its thought", () => {
  const { recording: of } = recording();
  assert.deepEqual(of.plan(0.05), [{ x: 4, y: 0 }]);
  assert.deepEqual(of.plan(0.1), []);
  assert.deepEqual(of.plan(9), [], "after the last thought there is none");
});

test("a replay is opened for its event: a collision, a breach, a failure, what came near, a manoeuvre, an action", () => {
  const { recording: of } = recording();
  const { header } = of;
  header.summary = { breaches: [], failure: null, duration_s: 9 };
  header.collisions[1].obstacle = 1;
  assert.deepEqual(of.event(), { at_s: 0.04, what: "contact", obstacle: 1 });
  header.collisions = [];
  header.summary.breaches = [{ requirement: "gap", at_s: 0.03, obstacle: null }];
  assert.deepEqual(of.event(), { at_s: 0.03, what: "breach of gap", obstacle: null });
  header.summary.breaches = [];
  header.summary.failure = "it died";
  assert.deepEqual(of.event(), { at_s: 9, what: "the driving system fails", obstacle: null });
  header.summary.failure = null;
  // 5 m apart at tick 1, less half of both lengths.
  header.obstacles[0].length_m = 2;
  assert.deepEqual(of.event(), { at_s: 0.02, what: "nearest approach", obstacle: 1 });
  assert.ok(Math.abs(of.nearest().distance_m - 0.65) < 1e-9, `${of.nearest().distance_m}`);
  // Far away, the beginning of a phase counts; its times are seconds.
  of.columns[4] = Float64Array.from([500, 700]);
  header.obstacles[0].phases = [[12.5, "cut_in"], [14, "brakes"]];
  assert.deepEqual(of.event(), { at_s: 12.5, what: "a manoeuvre begins", obstacle: 1 });
  delete header.obstacles[0].phases;
  header.steps = [{ at_s: 0, outcome: { kind: "passed" } }, { at_s: 6, outcome: { kind: "done" } }];
  assert.deepEqual(of.event(), { at_s: 6, what: "first action", obstacle: null });
  header.steps = [];
  assert.equal(of.event(), null);
});

test("a scenario is about the first collision that counts, or its first breach", () => {
  const { recording: of } = recording();
  assert.equal(of.collision().at_s, 0.04);
  const [touched, counted] = of.header.collisions;
  const breach = { requirement: "gap", recurrence: { word: "rarely recurs" } };
  assert.equal(mainCollision({ collisions: [touched, counted], breaches: [] }), counted);
  assert.equal(mainFinding({ collisions: [touched], breaches: [breach] }), breach);
  assert.equal(mainFinding({ collisions: [touched], breaches: [] }), touched);
  assert.deepEqual([recursInWords(breach), recursInWords(touched), recursInWords(null)], ["rarely recurs", "not tried", "not tried"]);
});

/** A browser's address. */
function at(hash) {
  globalThis.location = { hash };
  globalThis.history = { replaceState: (state, title, url) => (globalThis.location.hash = url === "#" ? "" : url) };
}

test("a link is the state, and changing it keeps the rest", () => {
  at("#s=critical/a,b&t=3.5&road=corner");
  assert.deepEqual(linked(), { s: "critical/a,b", t: "3.5", road: "corner" });
  relink({ t: "4" });
  assert.equal(location.hash, "#s=critical/a,b&t=4&road=corner");
  assert.equal(linkToList(), "#road=corner");
  relink({ s: null, t: null, road: "" });
  assert.equal(location.hash, "");
  assert.equal(linkOf({ q: "a b&c" }), "#q=a+b%26c");
});

test("a scenario is found by its file, or by the end of it", () => {
  const scenarios = [{ file: "critical/one.ava" }, { file: "shrunk/two.ava" }, { file: "two.ava" }];
  assert.equal(byName(scenarios, "critical/one"), scenarios[0]);
  assert.equal(byName(scenarios, "one"), scenarios[0]);
  assert.equal(byName(scenarios, "two"), scenarios[2], "the whole name first");
  assert.equal(byName(scenarios, "three"), null);
  assert.equal(byName(scenarios, ""), null);
});

test("times and places on an axis are each other's inverse", () => {
  const axis = new TimeAxis(20, 484, 74, 10);
  assert.deepEqual([axis.xOf(0), axis.xOf(20), axis.timeAt(74), axis.timeAt(474)], [74, 474, 0, 20]);
  for (const timeS of [0.02, 7, 19.98]) assert.ok(Math.abs(axis.timeAt(axis.xOf(timeS)) - timeS) < 1e-9);
  assert.deepEqual([axis.timeAt(-5), axis.timeAt(999)], [0, 20], "beside it are its ends");
});

test("labels of an axis have room", () => {
  for (const endS of [0.5, 3, 12, 60, 600]) {
    for (const width of [300, 1200]) {
      const axis = new TimeAxis(endS, width, 74, 10);
      const labels = axis.labels();
      assert.equal(labels[0], 0);
      assert.ok(labels.every((timeS) => timeS <= endS));
      const places = labels.map((timeS) => axis.xOf(timeS));
      assert.ok(places.slice(1).every((x, i) => x - places[i] > 46));
    }
  }
});

/** The modules in the order in which `page.rs` joins them. */
function modules() {
  const rust = readFileSync(new URL("../../src/exchange/report/page.rs", import.meta.url), "utf8");
  const names = [...rust.matchAll(/include_str!\("page\/(\w+\.js)"\)/g)].map(([, name]) => name);
  const folder = new URL("../../src/exchange/report/page/", import.meta.url);
  assert.deepEqual([...names].sort(), readdirSync(folder).filter((name) => name.endsWith(".js")).sort());
  return names.map((name) => [name, readFileSync(new URL(name, folder), "utf8")]);
}

test("joined, the modules are one script in which each name stands once", () => {
  const owners = new Map();
  let script = '"use strict";\n';
  for (const [name, text] of modules()) {
    for (const [, declared] of text.matchAll(/^(?:export )?(?:async )?(?:function|class|const|let) (\w+)/gm)) {
      assert.equal(owners.get(declared), undefined, `${declared} stands in ${owners.get(declared)} and in ${name}`);
      owners.set(declared, name);
    }
    assert.doesNotMatch(text, /^export (default|\{|\*)/m, `${name}: only declarations are exported`);
    assert.doesNotMatch(text, /^import (?!(\{[^}]*\}|\w+) from ")/m, `${name}: only names are imported`);
    assert.doesNotMatch(text, /^import \{[^}]*\bas\b/m, `${name}: a name has one spelling`);
    script += text.replace(/^import [^;]*;$/gm, "").replace(/^export /gm, "");
  }
  new Script(`(() => {\n${script}})();\n`);
});

test("what a module imports stands before it", () => {
  const order = modules().map(([name]) => name);
  for (const [name, text] of modules()) {
    for (const [, from] of text.matchAll(/^import [^;]*from "\.\/(\w+\.js)";$/gm)) {
      assert.ok(order.indexOf(from) < order.indexOf(name), `${name} imports ${from}, which stands behind it`);
    }
  }
});

/** Just so much of a browser as a canvas needs: what is drawn is noted. */
function canvas(width, height) {
  const drawn = [];
  const context = new Proxy(
    { measureText: (text) => ({ width: 6 * text.length }) },
    {
      get: (own, name) => own[name] ?? ((...values) => void drawn.push([name, ...values])),
      set: (own, name, value) => Boolean(drawn.push([name, value])),
    },
  );
  const on = {};
  const element = {
    style: {},
    clientWidth: width,
    clientHeight: height,
    getContext: () => context,
    getBoundingClientRect: () => ({ left: 100, width }),
    addEventListener: (name, act) => (on[name] = act),
    setPointerCapture: () => {},
  };
  return { element, drawn, on };
}

test("every row is drawn in its box, the cursor at its time, and a press seeks", () => {
  const { element, drawn, on } = canvas(484, 400);
  const still = canvas(0, 0);
  globalThis.document = { createElement: () => still.element, documentElement: {} };
  globalThis.getComputedStyle = () => ({ getPropertyValue: (name) => name });
  globalThis.window = { devicePixelRatio: 1 };
  const { recording: of } = recording();
  Object.assign(of.header, {
    margins: [{ requirement: "gap", unit: "m", parts: [[1, 6]] }],
    summary: { breaches: [{ requirement: "gap", at_s: 0.02, until_s: 0.04, moments: [] }] },
    rows: ["walk()"],
    steps: [
      { at_s: 0, outcome: { kind: "done", row: 0, text: "walk(5 m)", made: [1], at_s: 0 } },
      { at_s: 0.02, outcome: { kind: "refused", row: 0, rule: null, reason: "" } },
      { at_s: 0.03, outcome: { kind: "passed" } },
    ],
  });
  of.header.ego.proc = 2;
  const sought = [];
  const plots = new Plots(element, of, (timeS) => sought.push(timeS), of);
  plots.draw(0.02);
  const texts = still.drawn.filter(([name]) => name === "fillText").map(([, text]) => text);
  for (const label of ["Speed", "Accel.", "ProC", "gap", "Chance", "Held by", "Actions", "walk", "refused walk()", "–", "✕", "0 s"])
    assert.ok(texts.includes(label), `${label} is in ${texts}`);
  const tops = still.drawn.filter(([name, , x]) => name === "fillText" && x === 2).map(([, , , y]) => y);
  assert.ok(Math.max(...tops) < Number.parseFloat(element.style.height), "all labels are on the canvas");
  for (const [name, x, y] of still.drawn.filter(([name]) => name === "lineTo" || name === "moveTo"))
    assert.ok(x >= 74 && x <= 474 && y >= 0 && y <= 400, `${name} ${x} ${y}`);
  assert.deepEqual(drawn.find(([name]) => name === "moveTo"), ["moveTo", 274, 0]);
  const painted = still.drawn.length;
  plots.draw(0.03);
  assert.equal(still.drawn.length, painted, "the still is drawn once for a size");
  plots.repaint();
  plots.draw(0.03);
  assert.ok(still.drawn.length > painted, "and anew when the colours change");
  on.pointerdown({ pointerId: 1, clientX: 100 + 274 });
  on.pointermove({ buttons: 0, clientX: 100 });
  on.pointermove({ buttons: 1, clientX: 100 + 474 });
  assert.deepEqual(sought, [0.02, 0.04]);
});

/** A scenario of the list. */
function entry(file, { collisions = [], breaches = [], road = "corner", shrunkFrom = null, end = "arrived" } = {}) {
  const name = file.split("/").pop();
  return { file: `${file}.ava`, shrunk_from: shrunkFrom, change: null, summary: { name, road, end, collisions, breaches } };
}

test("the list is what the link asks for", () => {
  const hit = { counted: true, class: "avoidable", precrash: "pedestrian", precrash_number: 12, cause: ["planning"] };
  const all = [
    entry("critical/one", { collisions: [hit] }),
    entry("shrunk/one", { collisions: [hit], shrunkFrom: "one" }),
    entry("critical/two", { breaches: [{ requirement: "gap" }], road: "boulevard" }),
    entry("critical/three", { end: "stalled" }),
  ];
  const files = (hash) => {
    at(hash);
    return filtered(all).map((one) => one.file.replace(".ava", ""));
  };
  assert.deepEqual(files("#"), ["critical/one", "critical/two", "critical/three"], "a shrunk one beside its original");
  assert.deepEqual(files("#shrunk=1").length, 4);
  assert.deepEqual(files("#road=boulevard"), ["critical/two"]);
  assert.deepEqual(files("#verdict=avoidable"), ["critical/one"]);
  assert.deepEqual(files("#q=STALLED"), ["critical/three"]);
  assert.deepEqual(all.map(kindOf), [
    "12 pedestrian, planning", "12 pedestrian, planning", "breach of gap", "nothing found, kept to look at",
  ]);
  assert.deepEqual(files(linkOf({ group: "breach of gap" })), ["critical/two"]);
});

test("keys do what the help says", () => {
  browser();
  at("#s=critical/one&road=corner");
  const { recording: of } = recording();
  of.header.steps = [{ at_s: 0 }, { at_s: 0.02 }];
  const done = [];
  const note = (name) => (...values) => done.push([name, ...values]);
  const watch = {
    clock: new Clock(of.endS, 0.02, () => {}),
    recording: of,
    controls: { flipFollow: note("follow"), setLayer: note("layer") },
    toCollision: note("collision"),
    zoom: note("zoom"),
  };
  const press = (name, shiftKey = false) => key({ key: name, shiftKey }, watch);
  assert.equal(press(" ") && watch.clock.playing, true);
  press(" ");
  assert.equal(watch.clock.playing, false);
  press("End");
  assert.equal(watch.clock.timeS, 0.04);
  press("ArrowLeft");
  assert.ok(Math.abs(watch.clock.timeS - 0.02) < 1e-9);
  press("Home");
  press("ArrowRight", true);
  assert.equal(watch.clock.timeS, 0.02, "to the next step");
  press("ArrowRight", true);
  assert.equal(watch.clock.timeS, 0.04, "behind the last step is the end");
  press("ArrowLeft", true);
  assert.equal(watch.clock.timeS, 0.02);
  for (const name of ["f", "c", "+", "1", "0"]) assert.equal(press(name), true);
  const layers = LAYERS.map(([name]) => name);
  assert.deepEqual(done.map(([name]) => name), ["follow", "collision", "zoom", "layer", "layer"]);
  assert.deepEqual(done.filter(([name]) => name === "layer").map(([, layer]) => layer), [layers[0], layers[9]]);
  press("]");
  assert.equal(watch.clock.rate, 2);
  assert.equal(press("x"), false, "other keys are the browser's");
  press("Escape");
  assert.equal(location.hash, "#road=corner");
});
