// Files of a scene: those that are dropped, or those that a file at an address names.

const isScene = (name) => /\.(glb|gltf|obj|toml)$/i.test(name);
export const isEnvironment = (name) => /\.(hdr|exr)$/i.test(name);
const text = (bytes) => new TextDecoder().decode(bytes);

/** Names and bytes of dropped files, scenes first. */
export const dropped = async (files) => {
  const read = await Promise.all([...files].map(async (file) => [file.name, new Uint8Array(await file.arrayBuffer())]));
  const place = ([name]) => (/\.toml$/i.test(name) ? 0 : isScene(name) ? 1 : 2);
  return read.sort((a, b) => place(a) - place(b));
};

/** The names of files that a file needs. */
function named(name, bytes) {
  const every = (pattern) => [...text(bytes).matchAll(pattern)].map(([, found]) => found.trim());
  if (/\.gltf$/i.test(name)) {
    const { buffers = [], images = [] } = JSON.parse(text(bytes));
    return [...buffers, ...images].map(({ uri }) => uri).filter((uri) => uri && !uri.startsWith("data:"));
  }
  if (/\.toml$/i.test(name)) return every(/^\s*(?:scene|environment)\s*=\s*"([^"]+)"/gm).filter((it) => !it.startsWith("demo:"));
  if (/\.obj$/i.test(name)) return every(/^mtllib\s+(.+)$/gm);
  if (/\.mtl$/i.test(name)) return every(/^\s*(?:map_\w+|norm|bump)\s.*?(\S+)\s*$/gim);
  return [];
}

/** A file at an address, and all that it names; a file that is named and missing is left out. `tell` hears the bytes so far. */
export async function fetched(url, tell, name = url.split("/").pop().split("?")[0]) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  const parts = [], all = Number(response.headers.get("Content-Length"));
  let length = 0;
  for (const reader = response.body.getReader(); ; ) {
    const { done, value } = await reader.read();
    if (done) break;
    parts.push(value);
    length += value.length;
    tell(`loading ${name}: ${(length / 1e6).toFixed(1)} MB${all ? ` of ${(all / 1e6).toFixed(1)}` : ""}`);
  }
  const bytes = new Uint8Array(await new Blob(parts).arrayBuffer());
  const folder = name.includes("/") ? name.slice(0, name.lastIndexOf("/") + 1) : "";
  const more = await Promise.all(named(name, bytes).map((it) => fetched(new URL(it, response.url).href, tell, folder + decodeURI(it)).catch(() => [])));
  return [[name, bytes], ...more.flat()];
}
