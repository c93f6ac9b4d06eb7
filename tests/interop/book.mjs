// Looks at the rendered book; see book.sh. Arguments: the folder of what it makes, with the book in `html`, and the glossary.
import assert from "node:assert/strict";
import { existsSync, readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [, , work, glossary] = process.argv;
const require = createRequire(join(work, "package.json"));
const puppeteer = (await import(pathToFileURL(require.resolve("puppeteer-core")))).default;
const executablePath = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
assert(executablePath, "no Chromium found: install Debian's package `chromium`, or say CHROMIUM=/path/to/it");
const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"] });
const html = join(work, "html");
const pages = readdirSync(html, { recursive: true })
  .map(String)
  .filter((name) => name.endsWith(".html") && !/(^|\/)(404|print|toc)\.html$/.test(name))
  .sort();
assert(pages.length > 50, `${pages.length} pages`);

const wrong = [];
for (const [width, scheme] of [[1280, "light"], [1280, "dark"], [420, "light"], [420, "dark"]]) {
  const tab = await browser.newPage();
  await tab.setViewport({ width, height: 900 });
  await tab.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
  let at = "";
  tab.on("console", (message) => message.type() === "error" && wrong.push(`${at} (${width}, ${scheme}): ${message.text()}`));
  tab.on("pageerror", (error) => wrong.push(`${at} (${width}, ${scheme}): ${error.message}`));
  for (const page of pages) {
    at = page;
    await tab.goto(pathToFileURL(join(html, page)).href, { waitUntil: "load" });
    const seen = await tab.evaluate(() => ({
      title: document.querySelector("main h1")?.textContent,
      broken: [...document.images].filter((image) => !image.complete || image.naturalWidth === 0).map((image) => image.src),
      // Tables and code scroll within themselves; the page itself does not.
      over: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    }));
    if (!seen.title) wrong.push(`${page}: no heading`);
    wrong.push(...seen.broken.map((src) => `${page}: broken picture ${src}`));
    if (seen.over > 1) wrong.push(`${page} (${width}): wider than the window by ${seen.over} px`);
  }
  await tab.goto(pathToFileURL(join(html, "language/action.html")).href, { waitUntil: "load" });
  await tab.screenshot({ path: join(work, `action_${width}_${scheme}.png`) });
  await tab.close();
}
assert.deepEqual(wrong, [], wrong.join("\n"));
console.log(`${pages.length} pages at two widths, light and dark: no error, no broken picture, none wider than its window`);

// The search of a reader who opened the book from a file.
const words = [...readFileSync(glossary, "utf8").matchAll(/^\| ([^|`]+?)[ ]*[,(|]/gm)].map((found) => found[1].trim());
const asked = words.filter((word) => !["word", "---"].includes(word) && /^[A-Za-z -]{3,}$/.test(word)).slice(0, 40);
assert.equal(asked.length, 40, `${asked.length} words`);
const tab = await browser.newPage();
await tab.goto(pathToFileURL(join(html, "index.html")).href, { waitUntil: "load" });
await tab.keyboard.press("s");
await tab.waitForSelector("#mdbook-searchbar, #searchbar", { visible: true });
const lost = [];
for (const word of asked) {
  const bar = (await tab.$("#mdbook-searchbar")) ? "#mdbook-searchbar" : "#searchbar";
  await tab.$eval(bar, (input) => (input.value = ""));
  await tab.type(bar, word);
  await tab
    .waitForFunction(() => document.querySelectorAll("#mdbook-searchresults li, #searchresults li").length > 0, { timeout: 5000 })
    .catch(() => lost.push(word));
}
assert.deepEqual(lost, [], `not found: ${lost.join(", ")}`);
console.log(`the search finds ${asked.length} of ${asked.length} words of the glossary`);
await browser.close();
