//! For tests: the software adapter, a record of what had to be left out, and an interpreter of compute shaders.

mod interpreter;
mod memory;

use std::{
    io::Write,
    sync::{Mutex, OnceLock, PoisonError},
};

pub use self::{interpreter::Order, memory::Memory};
use crate::{AdapterChoice, Engine, Gpu, GpuError, is_same_device};

/// The adapter for tests: a software one unless `LANTERNFISH_TEST_ADAPTER` names another (`auto` is the best there
/// is, `gpu` the best that is not software). `None` when there is no adapter; the test is then left out and says so.
pub fn gpu(test: &str) -> Option<&'static Gpu> {
    static GPU: OnceLock<Option<Gpu>> = OnceLock::new();
    let gpu = GPU.get_or_init(|| {
        let choice = match std::env::var("LANTERNFISH_TEST_ADAPTER").as_deref() {
            Ok("auto") => AdapterChoice::Auto,
            Ok("gpu") => AdapterChoice::Hardware,
            Ok(name) => AdapterChoice::Name(name.to_owned()),
            Err(_) => AdapterChoice::Cpu,
        };
        match Gpu::open(&choice) {
            Ok(gpu) => Some(gpu),
            Err(GpuError::NoAdapter) => None,
            // A graphics card alone.
            Err(GpuError::UnknownAdapter { .. }) if choice == AdapterChoice::Cpu => None,
            Err(GpuError::NoHardware { .. }) => None,
            Err(error) => panic!("{error}"),
        }
    });
    if gpu.is_none() {
        left_out(test, "no software adapter; LANTERNFISH_TEST_ADAPTER=auto takes any other");
    }
    gpu.as_ref()
}

/// What tests of this process have compiled for a device: on a software adapter they spend most of their time compiling, and those that render
/// with several renderers would compile the same for each. Not for those that count what is compiled.
pub fn engine(gpu: &Gpu) -> Engine {
    static ENGINES: Mutex<Vec<Engine>> = Mutex::new(Vec::new());
    let mut engines = ENGINES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = engines.iter().find(|engine| is_same_device(&engine.device, &gpu.device)) {
        return known.clone();
    }
    let engine = Engine::new(&gpu.device, &gpu.queue);
    engines.push(engine.clone());
    engine
}

/// Says that a test is left out, on stderr and in the file that `LANTERNFISH_LEFT_OUT` names.
pub fn left_out(test: &str, reason: &str) {
    write_line(&format!("LEFT OUT: {test}: {reason}"));
}

/// A file of the shared scenes and references, looked for under `LANTERNFISH_SHARED` (default: `../shared` beside the
/// checkout). `None` when it is not there; the test is then left out and says so.
pub fn shared(test: &str, path: &str) -> Option<std::path::PathBuf> {
    let root = std::env::var_os("LANTERNFISH_SHARED").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        std::path::PathBuf::from,
    );
    let file = root.join(path);
    if file.exists() {
        return Some(file);
    }
    write_line(&format!("LEFT OUT (shared): {test}: no {path}"));
    None
}

fn write_line(line: &str) {
    eprintln!("{line}");
    let Some(file) = std::env::var_os("LANTERNFISH_LEFT_OUT") else { return };
    let open = std::fs::OpenOptions::new().append(true).create(true).open(&file);
    let written = open.and_then(|mut file| writeln!(file, "{line}"));
    written.unwrap_or_else(|error| panic!("{}: {error}", file.display()));
}
