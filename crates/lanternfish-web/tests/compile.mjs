// Compiles shaders as a page does, in a headless Chromium. Arguments: Chromium, and the folder of playwright-core. Reads WGSL from the
// standard input, texts that a NUL separates. Prints a line for each error and warning, `INDEX KIND: MESSAGE`, and `compiled COUNT`.
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { launch } from "./chromium.mjs";

const texts = readFileSync(0);
const server = createServer((_, response) => response.end(texts));
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
const browser = await launch(...process.argv.slice(2));
try {
  const page = await browser.newPage();
  await page.route("**/empty", (route) => route.fulfill({ contentType: "text/html", body: "" }));
  await page.goto(`http://localhost:${server.address().port}/empty`);
  const lines = await page.evaluate(async () => {
    const device = await (await navigator.gpu.requestAdapter()).requestDevice();
    const texts = (await (await fetch("/texts")).text()).split("\0");
    const compile = async (code, index) => {
      device.pushErrorScope("validation");
      const info = device.createShaderModule({ code }).getCompilationInfo();
      const [error, { messages }] = await Promise.all([device.popErrorScope(), info]);
      const said = messages.filter(({ type }) => type !== "info").map(({ type, lineNum, message }) =>
        `${type}: ${message} in \`${code.split("\n")[lineNum - 1]?.trim()}\``);
      if (error && !said.length) said.push(`error: ${error.message}`);
      return said.map((what) => `${index} ${what.replaceAll("\n", " ")}`);
    };
    const lines = [], batch = 64;
    for (let first = 0; first < texts.length; first += batch) {
      const said = texts.slice(first, first + batch).map((code, i) => compile(code, first + i));
      lines.push(...(await Promise.all(said)).flat());
    }
    return [...lines, `compiled ${texts.length}`];
  });
  console.log(lines.join("\n"));
} finally {
  await browser.close();
  server.close();
}
