import init, { Viewer, settings } from "./lanternfish.js";

const at = (id) => document.getElementById(id);
const canvas = at("image"), context = canvas.getContext("2d");
const wanted = new URL(location).searchParams;
// A few frames at first; more while the view rests.
const chosen = { quality: "draft", accumulate: "32" };
for (const [name, value] of wanted) if (name !== "scene") chosen[name] = value;
const keys = new Set();
let viewer, source, moves = [], changes = [], opening;

const say = (text) => (at("note").textContent = text);
const fail = (error) => say(error.message ?? String(error));

async function open(next) {
  source = next;
  viewer = undefined;
  [moves, changes] = [[], []];
  viewer = await Viewer.open(source, chosen, (what) => say(`${what}…`));
  say("compiling what the first image needs…");
  // For tests.
  Object.assign(canvas.dataset, { scene: typeof source === "string" ? source : source[0][0], frames: 0 });
}

async function fetched(url) {
  say(`loading ${url}…`);
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  return [[url.split("/").pop(), new Uint8Array(await response.arrayBuffer())]];
}

/** Scenes first: a dropped glTF file names the others. */
async function dropped(files) {
  const isScene = ({ name }) => /\.(glb|gltf|obj)$/i.test(name);
  const sorted = [...files].sort((a, b) => isScene(b) - isScene(a));
  return Promise.all(sorted.map(async (file) => [file.name, new Uint8Array(await file.arrayBuffer())]));
}

function control({ name, values, value, help }) {
  const label = document.createElement("label"), input = document.createElement(values.length ? "select" : "input");
  values.forEach((text) => input.add(new Option(text)));
  [input.value, input.id, label.title] = [chosen[name] ?? value ?? "", name, help];
  input.onchange = () => {
    chosen[name] = input.value;
    changes.push([name, input.value]);
  };
  label.append(name, input);
  return label;
}

function fly(seconds) {
  const way = (plus, minus) => keys.has(plus) - keys.has(minus);
  const [right, up, forward] = [way("KeyD", "KeyA"), way("KeyE", "KeyQ"), way("KeyW", "KeyS")];
  if (right || up || forward) viewer.fly(right, up, forward, seconds);
}

async function run() {
  let before = performance.now(), frames = 0;
  for (;;) {
    await new Promise(requestAnimationFrame);
    const now = performance.now(), seconds = Math.min((now - before) / 1000, 0.1);
    before = now;
    try {
      if (opening) {
        const next = opening;
        opening = undefined;
        await open(await next());
        frames = 0;
      }
      if (!viewer) continue;
      for (const [name, value] of changes.splice(0)) viewer.set(name, value);
      for (const [kind, ...motion] of moves.splice(0)) viewer[kind](...motion);
      fly(seconds);
      const size = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(Math.round(side * devicePixelRatio), 1));
      const image = await viewer.image(...size);
      if (!image) continue;
      [canvas.width, canvas.height] = [image.width, image.height];
      context.putImageData(image, 0, 0);
      frames += 1;
      canvas.dataset.frames = frames;
      say(`${image.width} × ${image.height}, ${Math.round(performance.now() - now)} ms`);
    } catch (error) {
      fail(error);
      canvas.dataset.error = error.message ?? error;
      // A lost device is opened again, with the scene.
      const again = source, isLost = /lost/.test(error.message);
      if (isLost) opening = async () => again;
      if (!viewer) await new Promise((resume) => setTimeout(resume, 500));
    }
  }
}

function listen() {
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  canvas.onpointermove = (event) => {
    if (event.buttons) moves.push([event.buttons === 1 ? "orbit" : "look", event.movementX, event.movementY]);
  };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.onwheel = (event) => {
    event.preventDefault();
    moves.push(["dolly", -Math.sign(event.deltaY)]);
  };
  canvas.onkeydown = (event) => keys.add(event.code);
  canvas.onkeyup = (event) => keys.delete(event.code);
  canvas.onblur = () => keys.clear();
  document.ondragover = (event) => event.preventDefault();
  document.ondrop = (event) => {
    event.preventDefault();
    const files = [...event.dataTransfer.files];
    opening = () => dropped(files);
  };
  at("download").onclick = () => canvas.toBlob((blob) => {
    const link = document.createElement("a");
    [link.href, link.download] = [URL.createObjectURL(blob), "lanternfish.png"];
    link.click();
  });
}

try {
  if (!navigator.gpu) {
    throw new Error("This browser has no WebGPU, which the renderer needs. A current Chrome or Edge has it; so have Firefox and Safari on many systems.");
  }
  say("loading the renderer…");
  await init();
  ["atrium", "cornell", "hall", "street"].forEach((name) => at("scene").add(new Option(name, `demo:${name}`)));
  at("scene").onchange = ({ target }) => (opening = async () => target.value);
  at("quality").replaceWith(control({ name: "quality", values: ["draft", "good", "best", "realtime"], help: "preset" }).lastChild);
  for (const row of JSON.parse(settings())) (row.everyday ? at("everyday") : at("rest")).append(control(row));
  listen();
  const url = wanted.get("scene") ?? "demo:atrium";
  opening = () => (url.startsWith("demo:") ? url : fetched(url));
  run();
} catch (error) {
  fail(error);
}
