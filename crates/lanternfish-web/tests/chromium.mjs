// A headless Chromium with SwiftShader, which has WebGPU on any machine.
import { createRequire } from "node:module";
import { join } from "node:path";

/// Starts it, driven by the playwright-core of this folder.
export const launch = (executablePath, modules) => createRequire(join(modules, "x.js"))("playwright-core").chromium.launch({
  executablePath,
  args: ["--headless=new", "--no-sandbox", "--enable-unsafe-webgpu", "--disable-gpu-sandbox", "--disable-gpu-watchdog",
    "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan", "--use-vulkan=swiftshader", "--use-angle=swiftshader"],
});
