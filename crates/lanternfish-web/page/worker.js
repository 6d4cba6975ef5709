// The renderer, beside the page: while it reads, compiles or builds, the page answers. Takes messages of a `kind`, and tells what it does.
import init, { Viewer, settings } from "./lanternfish.js";

let viewer, name, canvas, opening, size = [1, 1], is_playing = false, way = [0, 0, 0], queue = [];
let ready;
const tell = (kind, more = {}, moved = []) => postMessage({ kind, ...more }, moved);
const turn = () => new Promise(globalThis.requestAnimationFrame ?? ((then) => setTimeout(then, 4)));

/** What messages do to a view, between two frames. */
const acts = {
  moves: ({ moves }) => moves.forEach(([name, ...motion]) => viewer[name](...motion)),
  set({ name, value }) {
    viewer.set(name, value);
    tell("done", { name, value });
  },
  compare: ({ options }) => viewer.compare(options),
  split: ({ part }) => viewer.split(part),
  shot: () => tell("shot", { text: viewer.shot() }),
  image: async () => {
    const image = await viewer.image();
    const copy = new OffscreenCanvas(image.width, image.height);
    copy.getContext("2d").putImageData(image, 0, 0);
    tell("image", { blob: await copy.convertToBlob() });
  },
  pixel: async ({ at: [x, y] }) => {
    const { width, height, data } = await viewer.image();
    const first = 4 * (Math.floor(y * height) * width + Math.floor(x * width));
    tell("pixel", { color: [...data.slice(first, first + 4)] });
  },
};

onmessage = ({ data }) => {
  if (data.kind === "open") [opening, queue, canvas] = [data, [], data.canvas ?? canvas];
  else if (data.kind === "size") size = data.size;
  else if (data.kind === "play") is_playing = data.is_playing;
  else if (data.kind === "fly") way = data.way;
  else queue.push(data);
  ready?.();
};

async function step(seconds) {
  if (opening) {
    const { source, options } = opening;
    opening = undefined;
    name = typeof source === "string" ? source : source[0][0];
    viewer?.free();
    viewer = undefined;
    viewer = await Viewer.open(canvas, source, options, (what) => tell("note", { text: `${what}…` }));
    tell("opened", { options });
  }
  if (!viewer) return new Promise((then) => (ready = then));
  for (const act of queue.splice(0)) await acts[act.kind](act);
  if (way.some((part) => part)) viewer.fly(...way, seconds);
  if (is_playing && !viewer.play(seconds)) is_playing = false;
  const started = performance.now();
  const shown = await viewer.frame(...size);
  if (shown) tell("frame", { source: name, size: [...shown], ms: performance.now() - started, memory: memory.buffer.byteLength });
}

const { memory } = await init();
tell("settings", { settings: JSON.parse(settings()) });
for (let before = performance.now(); ; await turn()) {
  const now = performance.now(), seconds = Math.min((now - before) / 1000, 0.1);
  before = now;
  try {
    await step(seconds);
  } catch (error) {
    // What a trap leaves is of no use, nor is a device with an error: the page starts another worker.
    const is_trap = error instanceof WebAssembly.RuntimeError;
    tell("error", { text: error.message ?? String(error), is_over: is_trap || /lost/.test(error.message) || viewer?.is_broken(), is_trap });
  }
}
