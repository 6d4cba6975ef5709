//! `cargo xtask web`: builds the page in `dist/`, which any server of static files can show.

use std::{
    fs,
    io::{BufRead as _, BufReader, Write as _},
    net::{TcpListener, TcpStream},
    path::{Component, Path, PathBuf},
    process::Command,
};

use crate::command::{cargo, find_program, run as step, succeeds, workspace};

const TARGET: &str = "wasm32-unknown-unknown";
const FOLDER: &str = "dist";

/// Library crates that a browser can run.
const CRATES: [&str; 7] = [
    "lanternfish",
    "lanternfish-gpu",
    "lanternfish-limits",
    "lanternfish-metrics",
    "lanternfish-papers",
    "lanternfish-scene",
    "lanternfish-web",
];

/// Builds the page; with `--serve` shows it on the loopback device, with `--full` uses all of it in a browser.
pub fn run(words: &[String]) -> Result<(), String> {
    let then: fn(&Path) -> Result<(), String> = match words {
        [] => |_| Ok(()),
        [word] if word == "--serve" => serve,
        [word] if word == "--full" => full,
        _ => return Err(format!("web takes --serve or --full, not {words:?}")),
    };
    if !has_target() {
        return Err(format!("no target {TARGET}: `rustup target add {TARGET}` adds it"));
    }
    let folder = workspace().join(FOLDER);
    build(&folder)?;
    then(&folder)
}

/// Uses the page for minutes: the atrium, each paper, 300 frames. Its screenshots are in `target/web-full`.
fn full(page: &Path) -> Result<(), String> {
    let [chromium, modules] = browser()?.ok_or("this needs Chromium, node and npm")?;
    let images = workspace().join("target/web-full");
    fs::create_dir_all(&images).map_err(|error| format!("{}: {error}", images.display()))?;
    let plan = r#"{"scene": "demo:atrium", "options": "indirect=none", "width": 480, "height": 270, "frames": 300,
        "papers": true, "steps": []}"#;
    let script = workspace().join("crates/lanternfish-web/tests/browser.mjs");
    step(Command::new("node").arg(script).args([page, &chromium, &modules]).arg(plan).arg(images))
}

/// The test that renders in a browser.
const RENDERS: &str = "gpu_a_browser_shows_what_a_program_shows";

/// Tests that compile shaders in a browser.
const COMPILE: [&str; 3] = [
    "shaders::tests::every_variant_validates_and_fits_the_floor_and_shares_its_structs",
    "testing::every_shader::every_variant_validates_and_fits_the_floor_and_shares_its_structs",
    "shaders::tests::a_shader_that_only_a_browser_refuses_is_reported",
];

/// The package that drives a browser.
const PLAYWRIGHT: &str = "playwright-core@1.65.1";

/// Fetches what the selected tests need to drive a browser, and builds the page: only for `--full`, or for tests
/// selected by name. Returns their environment, without what this machine cannot have; the tests say so.
pub fn for_tests(is_selected: impl Fn(&str) -> bool) -> Result<Vec<(&'static str, PathBuf)>, String> {
    let renders = is_selected(RENDERS);
    if !renders && !COMPILE.iter().any(|name| is_selected(name)) {
        return Ok(Vec::new());
    }
    let Some([chromium, modules]) = browser()? else { return Ok(Vec::new()) };
    let mut environment = vec![("LANTERNFISH_CHROMIUM", chromium), ("LANTERNFISH_PLAYWRIGHT", modules)];
    if renders && has_target() {
        let page = workspace().join(FOLDER);
        build(&page)?;
        environment.push(("LANTERNFISH_PAGE", page));
    }
    Ok(environment)
}

/// Chromium, and the folder of what drives it, which is fetched; none where a program is missing.
fn browser() -> Result<Option<[PathBuf; 2]>, String> {
    let chromium = ["chromium", "chromium-browser", "google-chrome"].iter().find_map(|name| find_program(name));
    let Some(chromium) = chromium.filter(|_| find_program("node").is_some()) else { return Ok(None) };
    let modules = workspace().join("target/playwright");
    let has_playwright = modules.join("node_modules/playwright-core").is_dir();
    let is_fetched =
        has_playwright || step(Command::new("npm").args(["install", PLAYWRIGHT, "--prefix"]).arg(&modules)).is_ok();
    Ok(is_fetched.then_some([chromium, modules]))
}

/// Compiles the product's library crates for a browser. Prints a line if this machine cannot.
pub fn check() -> Result<(), String> {
    if !has_target() {
        eprintln!("LEFT OUT (tool): web: no target {TARGET}, and no rustup that adds it");
        return Ok(());
    }
    let packages = CRATES.iter().flat_map(|name| ["--package", name]);
    step(cargo(["clippy", "--target", TARGET]).args(packages).args(["--", "-D", "warnings"]))
}

/// True if the compiler has the target, or gets it from rustup.
fn has_target() -> bool {
    let is_there = || {
        let sysroot = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output();
        sysroot.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir())
    };
    is_there() || (succeeds(Command::new("rustup").args(["target", "add", TARGET])) && is_there())
}

fn build(folder: &Path) -> Result<(), String> {
    if !cfg!(feature = "web") {
        // This program again, with what writes the JavaScript beside the module.
        return step(&mut cargo(["run", "--quiet", "--package", "xtask", "--features", "web", "--", "web"]));
    }
    step(&mut cargo(["build", "--profile", "web", "--package", "lanternfish-web", "--target", TARGET]))?;
    let io = |error: std::io::Error| format!("{}: {error}", folder.display());
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(io)?;
    }
    let package = folder.join("package");
    fs::create_dir_all(&package).map_err(io)?;
    bind(&workspace().join("target").join(TARGET).join("web/lanternfish_web.wasm"), &package)?;
    let source = workspace().join("crates/lanternfish-web");
    let files = |folder: &Path| {
        let files = fs::read_dir(folder).map_err(io)?.map(|file| Ok(file.map_err(io)?.path()));
        let mut files = files.collect::<Result<Vec<_>, String>>()?;
        files.sort();
        Ok::<_, String>(files)
    };
    for file in files(&source.join("page"))?.into_iter().chain([source.join("README.md")]) {
        fs::copy(&file, package.join(file.file_name().expect("a file"))).map_err(io)?;
    }
    // All but the pages lies in a folder with a name of its own in every version, so that it may be stored for ever.
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for file in files(&package)? {
        fs::read(file)
            .map_err(io)?
            .iter()
            .for_each(|byte| hash = (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3));
    }
    let name = format!("lanternfish-{hash:016x}");
    for page in ["index.html", "example.html"] {
        let text = fs::read_to_string(package.join(page)).map_err(io)?;
        fs::write(folder.join(page), text.replace("./", &format!("./{name}/"))).map_err(io)?;
    }
    fs::rename(package, folder.join(name)).map_err(io)?;
    eprintln!("the page is in {}", folder.display());
    Ok(())
}

/// Writes the module and its JavaScript.
#[cfg(feature = "web")]
fn bind(module: &Path, folder: &Path) -> Result<(), String> {
    let mut tool = wasm_bindgen_cli_support::Bindgen::new();
    tool.omit_default_module_path(false).remove_name_section(true).remove_producers_section(true).typescript(true);
    let made = tool.web(true).and_then(|tool| tool.input_path(module).out_name("lanternfish").generate(folder));
    made.map_err(|error| format!("{}: {error:#}", module.display()))
}

#[cfg(not(feature = "web"))]
fn bind(_: &Path, _: &Path) -> Result<(), String> {
    unreachable!("`build` runs the program that has it")
}

/// Answers requests for the folder's files, until it is stopped.
fn serve(folder: &Path) -> Result<(), String> {
    let listener = TcpListener::bind("127.0.0.1:8080").map_err(|error| format!("127.0.0.1:8080: {error}"))?;
    eprintln!("http://localhost:8080 shows it; Ctrl+C ends");
    for stream in listener.incoming().flatten() {
        // A browser that leaves is no fault of the server.
        let _ = answer(stream, folder);
    }
    Ok(())
}

fn answer(mut stream: TcpStream, folder: &Path) -> std::io::Result<()> {
    let mut line = String::new();
    let mut reader = BufReader::new(stream.try_clone()?);
    reader.read_line(&mut line)?;
    let mut header = String::new();
    while reader.read_line(&mut header)? > 2 {
        header.clear();
    }
    let name = line.split(' ').nth(1).unwrap_or("/").trim_start_matches('/').split('?').next().unwrap_or_default();
    let name = if name.is_empty() { "index.html" } else { name };
    let is_inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    let content = is_inside.then(|| fs::read(folder.join(name)).ok()).flatten();
    let (status, content) = content.map_or(("404 Not Found", Vec::new()), |content| ("200 OK", content));
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        mime(name),
        content.len()
    )?;
    stream.write_all(&content)
}

fn mime(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("html") => "text/html",
        Some("js") => "text/javascript",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    }
}
