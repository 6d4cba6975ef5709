// Renders in a headless Chromium, with SwiftShader. Arguments: the page's folder, Chromium, the folder of playwright-core, and a JSON list
// of steps: `{ source, options, to, lose }`. The image, RGBA, is written to `to`; a `source` that is a path is read; the device is lost
// after `lose` milliseconds. Then the page itself is used, and a file dropped on it. Prints a JSON object: what each step gave (`ms`,
// `memory`, `error`), what the page shows, and what it says without WebGPU.
import { createRequire } from "node:module";
import { createServer } from "node:http";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { basename, extname, join } from "node:path";

const [folder, executablePath, modules, steps, file] = process.argv.slice(2);
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");
const types = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };
const server = createServer((request, response) => {
  const file = join(folder, basename(new URL(request.url, "http://localhost").pathname) || "index.html");
  if (!existsSync(file)) return response.writeHead(404).end("none");
  response.writeHead(200, { "Content-Type": types[extname(file)] ?? "application/octet-stream" }).end(readFileSync(file));
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
const address = `http://localhost:${server.address().port}`;
const browser = await chromium.launch({
  executablePath,
  args: ["--headless=new", "--no-sandbox", "--enable-unsafe-webgpu", "--disable-gpu-sandbox", "--disable-gpu-watchdog",
    "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan", "--use-vulkan=swiftshader", "--use-angle=swiftshader"],
});
const open = async (path, script) => {
  const page = await browser.newPage();
  page.on("console", (message) => console.error(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => console.error(`page: ${error}`));
  await page.addInitScript(script);
  await page.goto(address + path);
  return page;
};
try {
  // A page without content, which loads the module itself.
  const empty = await open("/none", () => {
    const request = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...wanted) {
      return (globalThis.device = await request.apply(this, wanted));
    };
  });
  const outcomes = [];
  for (const { source, options, to, lose } of JSON.parse(steps)) {
    const bytes = existsSync(source) ? [...readFileSync(source)] : null;
    const { rgba, ...outcome } = await empty.evaluate(async ([name, bytes, options, lose]) => {
      const module = await import("/lanternfish.js");
      const { memory } = await module.default();
      const started = performance.now();
      if (lose !== undefined) setTimeout(() => globalThis.device.destroy(), lose);
      let rgba = [], error = null;
      try {
        rgba = [...(await module.render(bytes ? new Uint8Array(bytes) : name, options)).data];
      } catch (thrown) {
        error = thrown.message;
      }
      return { rgba, error, ms: performance.now() - started, memory: memory.buffer.byteLength };
    }, [source, bytes, options, lose]);
    if (to) writeFileSync(to, Buffer.from(rgba));
    console.error(`${source} ${JSON.stringify(options)}: ${JSON.stringify(outcome)}`);
    outcomes.push(outcome);
  }
  // Frames of a page that is small and has direct light alone: at rest, in motion, and of a file.
  const shown = await open("/?scene=demo:cornell&indirect=none&accumulate=4", () => {});
  await shown.setViewportSize({ width: 480, height: 240 });
  await shown.mouse.move(60, 120);
  const use = async (wanted, what) => {
    const before = await shown.evaluate(() => Number(document.getElementById("image").dataset.frames ?? 0));
    await what();
    await shown.waitForFunction(([wanted, before]) => {
      const { scene, frames, error } = document.getElementById("image").dataset;
      return error || (scene === wanted && Number(frames) > before);
    }, [wanted, wanted === "demo:cornell" ? before : 0], { timeout: 120_000 });
  };
  const drop = (name, text) => shown.evaluate(([name, text]) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([text], name));
    document.dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  }, [name, text]);
  const center = () => shown.evaluate(() => [...document.getElementById("image").getContext("2d").getImageData(
    document.getElementById("image").width / 2, document.getElementById("image").height / 2, 1, 1).data]);
  await use("demo:cornell", () => {});
  for (let step = 0; step < 30; step++) await use("demo:cornell", () => shown.mouse.wheel(0, step % 2 ? 100 : -100));
  const box = await center();
  await use("triangle.gltf", () => drop("triangle.gltf", readFileSync(file, "utf8")));
  const page = { box, dropped: await center(), error: await shown.evaluate(() => document.getElementById("image").dataset.error) };
  await shown.screenshot({ path: join(file, "../page.png") });
  const without = await open("/", () => delete Navigator.prototype.gpu);
  await without.waitForFunction(() => document.getElementById("note").textContent !== "Starting…");
  console.log(JSON.stringify({ outcomes, page, without: await without.textContent("#note") }));
} finally {
  await browser.close();
  server.close();
}
