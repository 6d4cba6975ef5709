//! What Mesa's compiler for AMD's graphics cards, RADV, makes of linked shaders, on a machine without such a card.
//!
//! `lanternfish-shader-stats FOLDER` compiles every entry point of the folder's `.wgsl` files, whose first line is `// `
//! and the shader's label. `cargo xtask shader-stats` runs it with:
//!
//! - `RADV_FORCE_FAMILY`: the card, such as `navi21`. RADV then compiles with its null device. wgpu cannot open that one,
//!   which has no memory.
//! - `VK_LOADER_DRIVERS_SELECT`, so that no other driver answers.
//!
//! Standard output: the driver's description, then a line of tab-separated [`COLUMNS`] and [`STATISTICS`] for each entry
//! point. Without FOLDER, the description alone.

mod shader;
mod vulkan;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use shader::Shader;
use vulkan::Device;

type Error = Box<dyn std::error::Error + Send + Sync>;

/// Columns before the driver's statistics: the shader, its entry point, lanes of a wave.
const COLUMNS: [&str; 3] = ["shader", "entry", "wave"];

/// The driver's statistics, by its names.
const STATISTICS: [&str; 6] =
    ["VGPRs", "Scratch size", "LDS size", "Subgroups per SIMD", "Instructions", "Inverse Throughput"];

fn main() {
    let result = run(&std::env::args().skip(1).collect::<Vec<_>>());
    if let Err(error) = &result {
        eprintln!("error: {error}");
    }
    // RADV's null device need not survive its destruction.
    std::process::exit(i32::from(result.is_err()));
}

fn run(words: &[String]) -> Result<(), Error> {
    let device = Device::open()?;
    println!("{}", device.driver);
    let Some(folder) = words.first() else { return Ok(()) };
    println!("{}", COLUMNS.iter().chain(&STATISTICS).copied().collect::<Vec<_>>().join("\t"));
    for line in compile_all(&device, &files(Path::new(folder))?)? {
        println!("{line}");
    }
    Ok(())
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, std::io::Error>>()?;
    files.retain(|path| path.extension().is_some_and(|extension| extension == "wgsl"));
    files.sort();
    Ok(files)
}

/// Compiles on all cores. Returns sorted lines.
fn compile_all(device: &Device, files: &[PathBuf]) -> Result<Vec<String>, Error> {
    let (next, lines, failure) = (AtomicUsize::new(0), Mutex::new(Vec::new()), Mutex::new(None));
    let work = || {
        while let Some(path) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            match compile(device, path) {
                Ok(new) => lines.lock().unwrap_or_else(PoisonError::into_inner).extend(new),
                Err(error) => {
                    next.store(files.len(), Ordering::Relaxed);
                    let failed = format!("{}: {error}", path.display());
                    *failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(failed);
                }
            }
        }
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(work);
        }
    });
    if let Some(failed) = failure.into_inner()? {
        return Err(failed.into());
    }
    let mut lines = lines.into_inner()?;
    lines.sort();
    Ok(lines)
}

fn compile(device: &Device, path: &Path) -> Result<Vec<String>, Error> {
    let text = fs::read_to_string(path)?;
    let label = text.lines().next().and_then(|line| line.strip_prefix("// ")).ok_or("its first line is no label")?;
    let shader = Shader::parse(label, &text)?;
    let mut lines = Vec::new();
    for entries in shader.pipelines() {
        let result = device.compile(&shader, &entries);
        for stage in result.map_err(|error| format!("{label} {entries:?}: {error}"))? {
            let entry = shader.entry(entries.iter().find(|e| shader.entry(e).stage == stage.stage).ok_or("stage")?);
            let statistics = STATISTICS.map(|name| stage.statistics.get(name).map_or(String::new(), u64::to_string));
            let words = [label, &entry.name, &stage.wave.to_string()];
            lines.push(words.map(str::to_owned).into_iter().chain(statistics).collect::<Vec<_>>().join("\t"));
        }
    }
    // Fragment entry points may share a vertex entry point.
    lines.sort();
    lines.dedup();
    Ok(lines)
}
