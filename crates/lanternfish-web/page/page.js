import { dropped, fetched, isEnvironment } from "./files.js";

const at = (id) => document.getElementById(id);
const wanted = new URL(location).searchParams;
/** Flags of `lanternfish render`, by name: a few frames at first, more while the view rests. */
const chosen = { quality: "draft", accumulate: "32", ...Object.fromEntries(wanted) };
const address = chosen.shot ?? chosen.scene ?? "demo:atrium";
delete chosen.scene;
delete chosen.shot;
/** Flags of which another scene results. */
const OF_SCENES = { lights: ["", "rain:100", "rain:1000", "rain:10000", "rain:100000"], "light-rig": ["", "studio", "sun", "none"] };
const COMPARED = { nothing: undefined, "direct light alone": { indirect: "none" } };
const keys = new Set(), pointers = new Map();
/** What the worker has opened and set. */
let good = {};
let worker, source, names = new Map(), moves = [], is_playing = false, frames = 0;

const note = (text) => (at("note").textContent = text);
const fail = (error) => note(error.message ?? String(error));
const save = (name, blob) => Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name }).click();

/** A worker with a canvas of its own: one that has ended leaves its canvas behind. */
function start() {
  worker?.terminate();
  worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
  const canvas = at("image").cloneNode();
  at("image").replaceWith(canvas);
  listen(canvas);
  worker.onmessage = ({ data }) => heard[data.kind](data);
  worker.onerror = ({ message }) => note(message);
  const offscreen = canvas.transferControlToOffscreen();
  send = (kind, more = {}, moved = []) => worker.postMessage({ kind, ...more }, moved);
  resize();
  open = (next = source) => {
    [source, is_playing] = [next, false];
    at("play").textContent = "play";
    const first = worker.canvas ? {} : { canvas: offscreen };
    worker.canvas = offscreen;
    frames = 0;
    send("open", { source, options: chosen, ...first }, first.canvas ? [offscreen] : []);
  };
}
let send, open;

const heard = {
  note: ({ text }) => note(text),
  settings: ({ settings }) => names.size || panel(settings),
  opened({ options }) {
    good = { source, chosen: { ...options } };
    compare();
  },
  done: ({ name, value }) => (value === undefined ? delete good.chosen[name] : (good.chosen[name] = value)),
  frame({ size: [width, height], ms, source: name, memory }) {
    const data = at("image").dataset;
    // For tests: the scene, all frames so far, and the module's memory.
    [data.scene, data.frames, data.memory] = [name, Number(data.frames ?? 0) + 1, memory];
    frames += 1;
    note(`${width} × ${height}, ${Math.round(ms)} ms, ${frames} ${frames === 1 ? "frame" : "frames"}`);
  },
  image: ({ blob }) => save("lanternfish.png", blob),
  shot: ({ text }) => save("lanternfish.toml", new Blob([text])),
  pixel: ({ color }) => (at("image").dataset.pixel = color),
  error({ text, is_over, is_trap }) {
    at("image").dataset.error = text;
    note(text);
    const isLost = /lost/.test(text);
    if (good.source && !isLost) {
      // Back to what was shown before.
      Object.keys(chosen).forEach((name) => delete chosen[name]);
      Object.assign(chosen, good.chosen);
      for (const [name, value] of names) if (at(name)) at(name).value = chosen[name] ?? value ?? "";
    }
    if (!is_over) return;
    start();
    if (isLost) open();
    else if (good.source && !(is_trap && good.source === source)) open(good.source);
  },
};

function choice(values, value, change) {
  const input = document.createElement(values.length ? "select" : "input");
  const texts = values.length && value === null ? ["", ...values] : values;
  texts.forEach((text) => input.add(new Option(text || "none", text)));
  [input.value, input.onchange] = [value ?? "", () => change(input.value)];
  return input;
}

function row(name, help, input) {
  const label = document.createElement("label");
  [label.title, input.id] = [help, name];
  label.append(name, input);
  return label;
}

function panel(settings) {
  const set = (name) => (value) => {
    value === "" ? delete chosen[name] : (chosen[name] = value);
    send("set", { name, value: value || undefined });
  };
  const again = (name) => (value) => {
    value ? (chosen[name] = value) : delete chosen[name];
    open();
  };
  for (const { name, help, values, value, everyday } of settings) {
    names.set(name, value);
    if (name === "scene") {
      at("first").append(row(name, help, choice(values, address, open)));
      for (const [own, texts] of Object.entries(OF_SCENES)) at("first").append(row(own, "", choice(texts, chosen[own], again(own))));
    } else if (name === "as") {
      for (const paper of values) {
        COMPARED[paper] = { as: paper };
        const button = Object.assign(document.createElement("button"), { textContent: paper, onclick: () => set("as")(paper) });
        at("papers").append(button);
      }
    } else {
      if (name === "quality") values.forEach((preset) => (COMPARED[preset] = { quality: preset }));
      at(name === "quality" ? "first" : everyday ? "everyday" : "rest").append(row(name, help, choice(values, chosen[name] ?? value, set(name))));
    }
  }
  at("first").append(row("compare", "Another technique, to the right of a line", choice(Object.keys(COMPARED), "nothing", compare)));
  at("split").oninput = () => send("split", { part: at("split").value / 1000 });
}

function compare() {
  const other = COMPARED[at("compare")?.value];
  at("split").hidden = !other;
  if (other || at("image").dataset.compared) send("compare", { options: other && { ...chosen, ...other } });
  at("image").dataset.compared = other ? "1" : "";
}

function resize() {
  const side = (length) => Math.max(Math.round(length * devicePixelRatio), 1);
  send?.("size", { size: [side(at("image").clientWidth), side(at("image").clientHeight)] });
}

function move(...motion) {
  if (!moves.length) requestAnimationFrame(() => send("moves", { moves: moves.splice(0) }));
  moves.push(motion);
}

function listen(canvas) {
  canvas.onpointerdown = (event) => {
    canvas.focus();
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
  };
  canvas.onpointerup = canvas.onpointercancel = ({ pointerId }) => pointers.delete(pointerId);
  canvas.onpointermove = (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    pointers.set(event.pointerId, event);
    const [right, down] = [event.clientX - before.clientX, event.clientY - before.clientY];
    const other = [...pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
    if (!other) return move(event.buttons === 1 ? "orbit" : "look", right, down);
    // Two fingers: apart is nearer, together they look around.
    const apart = ({ clientX, clientY }) => Math.hypot(clientX - other.clientX, clientY - other.clientY);
    move("dolly", (apart(event) - apart(before)) / 40);
    move("look", -right / 2, -down / 2);
  };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.onwheel = (event) => {
    event.preventDefault();
    move("dolly", -Math.sign(event.deltaY));
  };
  const press = (event, is_down) => {
    is_down ? keys.add(event.code) : keys.delete(event.code);
    const way = (plus, minus) => keys.has(plus) - keys.has(minus);
    send("fly", { way: [way("KeyD", "KeyA"), way("KeyE", "KeyQ"), way("KeyW", "KeyS")] });
    if (is_down && event.code === "Home") move("home");
  };
  canvas.onkeydown = (event) => press(event, true);
  canvas.onkeyup = (event) => press(event, false);
  canvas.onblur = () => (keys.clear(), send("fly", { way: [0, 0, 0] }));
}

async function drop(files) {
  const read = await dropped(files);
  const [first] = read[0];
  if (!isEnvironment(first)) {
    delete chosen.environment;
    return open(read);
  }
  chosen.environment = first;
  // The scene stays: a built-in one is a name without bytes.
  const scene = typeof source === "string" ? [[source, new Uint8Array()]] : source.filter(([name]) => !isEnvironment(name));
  open([...scene, ...read]);
}

try {
  if (!navigator.gpu) {
    throw new Error("This browser has no WebGPU, which the renderer needs. A current Chrome or Edge has it; so have Firefox and Safari on many systems.");
  }
  note("loading the renderer…");
  start();
  onresize = resize;
  document.ondragover = (event) => event.preventDefault();
  document.ondrop = (event) => {
    event.preventDefault();
    drop(event.dataTransfer.files).catch(fail);
  };
  at("files").onchange = () => drop(at("files").files).catch(fail);
  at("download").onclick = () => send("image");
  at("shot").onclick = () => send("shot");
  at("play").onclick = () => {
    is_playing = !is_playing;
    at("play").textContent = is_playing ? "pause" : "play";
    send("play", { is_playing });
  };
  // For tests.
  globalThis.lanternfish = { pixel: (x, y) => send("pixel", { at: [x, y] }), end: () => worker.terminate() };
  open(address.startsWith("demo:") ? address : await fetched(new URL(address, location).href, note));
} catch (error) {
  fail(error);
}
