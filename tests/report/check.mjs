// Opens reports from disk in headless Chromium, clicks through them, and looks for what must not be.
//
//     node tests/report/check.mjs [--pictures FOLDER] [--quick] REPORT...
//
// Each report is opened at two widths, light and dark. The check fails at any message in the console that is an error, any request that
// does not go to a file, any serious fault that axe-core finds, a file over 3 MB, a page that is wider than its window, a control that
// does nothing, or a 3D view below 30 frames a second (drawn by SwiftShader, in software). `--quick` opens each report once at each width,
// in one theme, measures frames once, and accepts 12 of them a second. playwright-core and axe-core must be in NODE_PATH; CHROMIUM names the browser.

import { createRequire } from "node:module";
import { mkdtempSync, mkdirSync, readdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

// Modules are looked for in NODE_PATH by `require`, not by `import`.
const require = createRequire(import.meta.url);
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const LARGEST = 3e6;
const SLOWEST = 30;

/** The same with `--quick`, which runs on machines of any speed. */
const SLOWEST_QUICK = 12;
const WIDTHS = [1280, 400];
const ARGUMENTS = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"];
// WebGL by SwiftShader. The page itself is not put together by it: that costs five times as much as the picture.
ARGUMENTS.push("--disable-sync", "--disable-gpu", "--enable-unsafe-swiftshader");

let pictures = null, quick = false;
const reports = [];
for (let words = process.argv.slice(2); words.length; words = words.slice(1)) {
  if (words[0] === "--pictures") {
    pictures = words[1];
    words = words.slice(1);
  } else if (words[0] === "--quick") quick = true;
  else reports.push(words[0]);
}
if (!reports.length) {
  console.error("usage: node tests/report/check.mjs [--pictures FOLDER] [--quick] REPORT...");
  process.exit(2);
}

const faults = [];
const profile = mkdtempSync(join(tmpdir(), "report-check-"));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  headless: true,
  args: ARGUMENTS,
});

/** The name of a report: that of its folder, or its own where it is no report.html. */
const nameOf = (file) => (basename(file) === "report.html" ? basename(dirname(resolve(file))) : basename(file, ".html"));

async function open(file, width, scheme, fault) {
  const page = await context.newPage();
  page.on("console", (message) => message.type() === "error" && fault(`console: ${message.text()}`));
  page.on("pageerror", (error) => fault(`error: ${error.message}`));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || fault(`request to ${request.url()}`));
  await page.setViewportSize({ width, height: 900 });
  await page.emulateMedia({ colorScheme: scheme });
  await page.goto(pathToFileURL(resolve(file)).href);
  if (await page.$("#scene")) {
    try {
      await page.waitForSelector("#scene[data-ready]", { state: "attached", timeout: 20000 });
    } catch {
      fault(`no 3D view: ${await page.textContent("#no-view")}`);
    }
  }
  return page;
}

/** Processor seconds of this process's children and theirs, the browser's, so far; Linux counts them in /proc. */
function processorSeconds() {
  const processes = new Map();
  for (const id of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${id}/stat`, "utf8").replace(/^.*\) /, "").split(" ");
      processes.set(Number(id), { parent: Number(fields[1]), ticks: Number(fields[11]) + Number(fields[12]) });
    } catch {
      // It has ended meanwhile.
    }
  }
  const isOurs = (id) => id === process.pid || (processes.has(id) && isOurs(processes.get(id).parent));
  let ticks = 0;
  for (const [id, own] of processes) if (id !== process.pid && isOurs(id)) ticks += own.ticks;
  return ticks / 100;
}

/**
 * Frames a second while the load is played, or while the keys turn what has one step: by the clock, and by the processor time of the whole
 * browser, which is what one processor that does nothing else would show.
 */
async function frames(page) {
  const count = () => page.$eval("#scene", (canvas) => Number(canvas.dataset.frames));
  const play = await page.$("#play");
  await page.locator("#scene").scrollIntoViewIfNeeded();
  if (play) await play.click();
  else {
    await page.evaluate(() => {
      const canvas = document.getElementById("scene");
      window.turning = true;
      const turn = () => {
        canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
        if (window.turning) requestAnimationFrame(turn);
      };
      turn();
    });
  }
  // Until the number of pixels has adapted to the machine.
  await page.waitForTimeout(1500);
  const before = await count(), begin = performance.now(), used = processorSeconds();
  await page.waitForTimeout(2500);
  const drawn = (await count()) - before;
  const rates = { clock: drawn / ((performance.now() - begin) / 1000), processor: drawn / (processorSeconds() - used) };
  if (play) await play.click();
  else await page.evaluate(() => (window.turning = false));
  return rates;
}

/** Uses every control once, by pointer and by keyboard. */
async function useControls(page, fault) {
  const theme = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const before = await theme();
  await page.focus("#theme");
  await page.keyboard.press("Enter");
  if ((await theme()) === before) fault("the switch between light and dark does nothing");
  await page.click("#theme");
  if ((await theme()) !== before) fault("the switch between light and dark does not switch back");

  for (const chart of await page.$$(".chart")) {
    await chart.focus();
    await page.keyboard.press("ArrowRight");
    const first = await chart.$eval(".tip", (tip) => tip.textContent);
    if (!/\d/.test(first)) fault("a chart shows no values by keyboard");
    const box = await (await chart.$("svg")).boundingBox();
    await page.mouse.move(box.x + 0.8 * box.width, box.y + 0.5 * box.height);
    if (!/\d/.test(await chart.$eval(".tip", (tip) => tip.textContent))) fault("a chart shows no values under the pointer");
    await page.keyboard.press("Escape");
    await page.mouse.move(0, 0);
  }
  const select = await page.$("select[data-steps]");
  if (select) {
    const shown = () => page.$$eval("#matrices > div", (all) => all.filter((own) => own.offsetHeight > 0).length);
    await select.selectOption({ index: 1 });
    if ((await shown()) !== 1) fault("more or less than one matrix is shown");
  }
  const canvas = await page.$("#scene[data-ready]");
  if (canvas) {
    const look = async () => (await canvas.screenshot()).toString("base64");
    const changes = async (what, action) => {
      await page.waitForTimeout(500);
      const before = await look();
      await action();
      for (let k = 0; k < 20; k++) {
        await page.waitForTimeout(200);
        if ((await look()) !== before) return;
      }
      fault(`${what} does not change the 3D view`);
    };
    await canvas.scrollIntoViewIfNeeded();
    await changes("an arrow key", async () => {
      await canvas.focus();
      await page.keyboard.press("ArrowLeft");
    });
    await changes("the key +", () => page.keyboard.press("+"));
    await changes("the first view", () => page.click("#home"));
    await changes("dragging", async () => {
      const box = await canvas.boundingBox();
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await page.mouse.down();
      await page.mouse.move(box.x + box.width / 2 + 60, box.y + box.height / 2 + 20, { steps: 4 });
      await page.mouse.up();
    });
    await page.click("#home");
    if (await page.$("#step")) {
      await page.focus("#step");
      const at = () => page.textContent("#step-label");
      const before = await at();
      await page.keyboard.press("ArrowRight");
      if ((await at()) === before) fault("the slider does not go to the next step by keyboard");
      await page.keyboard.press("End");
      await page.keyboard.press("Home");
      if ((await at()) !== before) fault("the slider does not come back by keyboard");
    }
    // The scale bar, which nothing hides.
    await changes("hiding a body", () => page.click("#bodies label >> nth=-1"));
    await page.click("#bodies label >> nth=-1");
  }
  await page.$$eval("details", (all) => all.forEach((own) => (own.open = true)));
}

/** What axe-core calls serious or critical. */
async function accessibility(page, fault) {
  await page.evaluate(axe);
  const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  for (const own of found.violations.filter((v) => ["serious", "critical"].includes(v.impact))) {
    fault(`axe-core, ${own.impact}: ${own.id}, ${own.nodes.length} times: ${own.nodes[0].html.slice(0, 160)} ${own.nodes[0].failureSummary ?? ""}`);
  }
  return found.passes?.length ?? 0;
}

for (const file of reports) {
  const name = nameOf(file), size = statSync(file).size;
  const fault = (text) => {
    faults.push(`${name}: ${text}`);
    console.log(`  FAULT ${text}`);
  };
  console.log(`${name}: ${(size / 1e6).toFixed(2)} MB`);
  if (size >= LARGEST) fault(`${size} bytes are more than 3 MB`);
  let clock = Infinity, processor = Infinity;
  for (const width of WIDTHS) {
    for (const scheme of quick ? [width > 800 ? "light" : "dark"] : ["light", "dark"]) {
      const at = (text) => fault(`${text} (${width} px, ${scheme})`);
      const page = await open(file, width, scheme, at);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) at(`the page is ${wide} px wide`);
      await useControls(page, at);
      await accessibility(page, at);
      if ((await page.$("#scene[data-ready]")) && !(quick && width < 800)) {
        const rates = await frames(page);
        (clock = Math.min(clock, rates.clock)), (processor = Math.min(processor, rates.processor));
      }
      if (pictures) {
        mkdirSync(pictures, { recursive: true });
        await page.evaluate(() => {
          localStorage.clear();
          scrollTo(0, 0);
        });
        await page.reload();
        if (await page.$("#scene")) await page.waitForSelector("#scene[data-ready]", { state: "attached" });
        await page.waitForTimeout(300);
        await page.screenshot({ path: join(pictures, `${name}-${width}-${scheme}.png`), fullPage: true });
      }
      await page.close();
    }
  }
  if (clock < Infinity) {
    console.log(`  3D view: at least ${clock.toFixed(0)} frames a second by the clock, ${processor.toFixed(0)} by processor time`);
    // Whichever is larger: other programs may take the processors away, but not add to the browser's own time.
    if (Math.max(clock, processor) < (quick ? SLOWEST_QUICK : SLOWEST)) fault(`${Math.max(clock, processor).toFixed(1)} frames a second`);
  }
}
await context.close();
rmSync(profile, { recursive: true, force: true });
console.log(faults.length ? `${faults.length} faults` : `${reports.length} reports without a fault`);
process.exit(faults.length ? 1 : 0);
