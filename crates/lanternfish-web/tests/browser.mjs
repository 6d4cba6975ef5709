// Renders in a headless Chromium, with SwiftShader. Arguments: the page's folder, Chromium, the folder of playwright-core, a plan as JSON,
// and a folder for screenshots. The plan: `steps`, each `{ source, options, to, lose }`: the image, RGBA, is written to `to`; a `source`
// that is a path is read; the device is lost after `lose` milliseconds. Then the page itself is used, on `scene` with `width` and
// `height`: `frames` in motion, each of `controls` once, all `papers`, a dropped `file`, a lost device. Prints a JSON object: what each
// step gave (`ms`, `memory`, `error`), what the page shows, and what it says without WebGPU.
import { createServer } from "node:http";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { basename, extname, join, normalize } from "node:path";
import { launch } from "./chromium.mjs";

const [folder, executablePath, modules, words, images] = process.argv.slice(2);
const plan = JSON.parse(words);
const types = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };
const server = createServer((request, response) => {
  const file = join(folder, normalize(new URL(request.url, "http://localhost").pathname).replace(/\/$/, "/index.html"));
  if (!existsSync(file)) return response.writeHead(404).end("none");
  response.writeHead(200, { "Content-Type": types[extname(file)] ?? "application/octet-stream" }).end(readFileSync(file));
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
const address = `http://localhost:${server.address().port}`;
const library = address + "/" + /lanternfish-\w+/.exec(readFileSync(join(folder, "index.html"), "utf8"))[0] + "/lanternfish.js";
const browser = await launch(executablePath, modules);
const open = async (path, script) => {
  const page = await browser.newPage({ viewport: { width: plan.width, height: plan.height } });
  page.on("console", (message) => console.error(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => console.error(`page: ${error}`));
  await page.addInitScript(script);
  await page.goto(address + path);
  return page;
};

async function stills() {
  // A page without content, which loads the module itself.
  const empty = await open("/none", () => {
    const request = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...wanted) {
      return (globalThis.device = await request.apply(this, wanted));
    };
  });
  const outcomes = [];
  for (const { source, options, to, lose } of plan.steps) {
    const bytes = existsSync(source) ? [...readFileSync(source)] : null;
    const { rgba, ...outcome } = await empty.evaluate(async ([library, name, bytes, options, lose]) => {
      const module = await import(library);
      const { memory } = await module.default();
      const started = performance.now();
      if (lose !== undefined) setTimeout(() => globalThis.device.destroy(), lose);
      let rgba = [], error = null;
      try {
        rgba = [...(await module.render(bytes ? [[name, new Uint8Array(bytes)]] : name, options)).data];
      } catch (thrown) {
        error = thrown.message;
      }
      return { rgba, error, ms: performance.now() - started, memory: memory.buffer.byteLength };
    }, [library, bytes ? basename(source) : source, bytes, options, lose]);
    if (to) writeFileSync(to, Buffer.from(rgba));
    console.error(`${source} ${JSON.stringify(options)}: ${JSON.stringify(outcome)}`);
    outcomes.push(outcome);
  }
  await empty.close();
  return outcomes;
}

async function use() {
  const shown = await open(`/?scene=${plan.scene}&accumulate=4&${plan.options ?? ""}`, () => {});
  const state = () => shown.evaluate(() => ({ ...document.getElementById("image").dataset, note: document.getElementById("note").textContent }));
  /** Waits for a frame of `scene` after `what`, or an error, which it returns. */
  const after = async (what, scene = plan.scene) => {
    await shown.evaluate(() => Object.assign(document.getElementById("image").dataset, { before: document.getElementById("image").dataset.frames ?? 0, error: "" }));
    await what();
    await shown.waitForFunction((scene) => {
      const { scene: now, frames, before, error } = document.getElementById("image").dataset;
      return error || (now === scene && Number(frames) > (before ?? 0));
    }, scene, { timeout: 600_000 });
    return (await state()).error;
  };
  const pixel = async () => {
    await shown.evaluate(() => {
      delete document.getElementById("image").dataset.pixel;
      lanternfish.pixel(0.5, 0.5);
    });
    await shown.waitForFunction(() => document.getElementById("image").dataset.pixel);
    return (await state()).pixel.split(",").map(Number);
  };
  const errors = {};
  const note = (what, error) => {
    if (error) errors[what] = error;
    console.error(`${what}: ${error || "shown"}`);
  };
  const started = Date.now();
  note("first image", await after(() => {}));
  const first = Date.now() - started, start = Number((await state()).memory);
  for (let step = 0; step < plan.frames; step++) {
    const error = await after(() => shown.mouse.move(60, 120).then(() => shown.mouse.wheel(0, step % 2 ? 100 : -100)));
    if (error) note(`frame ${step}`, error);
    if (step % 50 === 49) console.error(`${step + 1} frames, ${Date.now() - started} ms: ${(await state()).note}`);
  }
  const box = await pixel();
  await shown.screenshot({ path: join(images, "page.png") });
  const used = [];
  const change = (id, value) => shown.evaluate(([id, value]) => {
    const input = document.getElementById(id);
    [input.value] = [value];
    input.dispatchEvent(new Event("change"));
  }, [id, value]);
  const rows = await shown.evaluate(() => [...document.querySelectorAll("#panel label > [id]")]
    .filter(({ type }) => type !== "file").map(({ id, value, options }) => ({ id, value, values: [...(options ?? [])].map(({ value }) => value) })));
  for (const { id, value, values } of plan.controls ? rows : []) {
    if (plan.skip?.includes(id)) continue;
    const other = plan.values?.[id] ?? values.filter((it) => it !== value).at(-1) ?? value;
    used.push(id);
    note(`${id} ${other}`, await after(() => change(id, other), id === "scene" ? other : plan.scene));
    note(`${id} ${value}`, await after(() => change(id, value)));
  }
  // A value that is refused is not left in its control. Frames of the last value may still come before the error.
  const refused = plan.controls && [];
  if (plan.controls) {
    await shown.evaluate(() => { document.getElementById("image").dataset.error = ""; });
    await change("samples", "8");
    await shown.waitForFunction(() => document.getElementById("image").dataset.error, null, { timeout: 120_000 });
    refused.push((await state()).error, await shown.evaluate(() => document.getElementById("samples").value));
  }
  if (plan.papers) {
    for (const name of await shown.evaluate(() => [...document.querySelectorAll("#papers button")].map(({ textContent }) => textContent))) {
      const began = Date.now();
      note(`as ${name}`, await after(() => shown.evaluate((name) => [...document.querySelectorAll("#papers button")].find(({ textContent }) => textContent === name).click(), name)));
      console.error(`${Date.now() - began} ms`);
      await shown.screenshot({ path: join(images, `${name.replaceAll(" ", "-")}.png`) });
    }
  }
  const drop = (name, text) => shown.evaluate(([name, text]) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([text], name));
    document.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  }, [name, text]);
  let dropped = null, shot = null;
  if (plan.file) {
    note("drop", await after(() => drop(basename(plan.file), readFileSync(plan.file, "utf8")), basename(plan.file)));
    dropped = await pixel();
    const [download] = await Promise.all([shown.waitForEvent("download"), shown.click("#shot")]);
    shot = readFileSync(await download.path(), "utf8");
  }
  let lost = null;
  if (plan.lose) {
    await shown.evaluate(() => (document.getElementById("image").dataset.error = ""));
    await shown.workers()[0].evaluate(() => {
      const make = GPUDevice.prototype.createCommandEncoder;
      GPUDevice.prototype.createCommandEncoder = function (...wanted) {
        this.destroy();
        return make.apply(this, wanted);
      };
    });
    await shown.mouse.wheel(0, 100);
    await shown.waitForFunction(() => document.getElementById("image").dataset.error);
    lost = (await state()).error;
    note("after a lost device", await after(() => {}, basename(plan.file)));
  }
  const memory = { start, end: Number((await state()).memory) };
  return { first, box, used, errors, dropped, shot, lost, memory, refused };
}

try {
  const outcomes = await stills();
  const page = await use();
  const without = await open("/", () => delete Navigator.prototype.gpu);
  await without.waitForFunction(() => document.getElementById("note").textContent !== "Starting…");
  console.log(JSON.stringify({ outcomes, page, without: await without.textContent("#note") }));
} finally {
  await browser.close();
  server.close();
}
