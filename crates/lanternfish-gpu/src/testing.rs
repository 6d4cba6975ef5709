//! Test support: the software adapter, a record of skipped tests, and passes over named buffers.

mod memory;

use std::{
    io::Write,
    sync::{Mutex, OnceLock, PoisonError},
};

pub use self::memory::Memory;
use crate::{AdapterChoice, Engine, Gpu, GpuError, is_same_device};

/// The adapter for tests: a software one unless `LANTERNFISH_TEST_ADAPTER` names another (`auto`: the best one, `gpu`: the best one that is
/// not software). `None` if there is no such adapter; the test must then return, and is recorded as left out.
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
            // There are adapters, but no software one.
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

/// Waits for a device when it is dropped.
pub struct Idle<'a>(&'a Gpu);

impl Gpu {
    /// Waits for all submitted work when the result is dropped. A process that exits while a software adapter works for a device
    /// that is never dropped, as that of the tests, may crash: the exit frees what the adapter's threads use.
    pub fn idle_at_end(&self) -> Idle<'_> {
        Idle(self)
    }
}

impl Drop for Idle<'_> {
    fn drop(&mut self) {
        // Fails on a lost device, which has nothing to wait for.
        let _ = self.0.device.poll(wgpu::PollType::wait_indefinitely());
    }
}

/// The engine that all tests of this process share for a device. It avoids compiling the same shaders again for each renderer, which takes
/// most of a test's time on a software adapter. Tests that count compilations must not use it.
pub fn engine(gpu: &Gpu) -> Engine {
    static ENGINES: Mutex<Vec<Engine>> = Mutex::new(Vec::new());
    let mut engines = ENGINES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(shared) = engines.iter().find(|engine| is_same_device(&engine.device, &gpu.device)) {
        return shared.clone();
    }
    let engine = Engine::new(&gpu.device, &gpu.queue);
    engines.push(engine.clone());
    engine
}

/// Records that a test is left out, on stderr and in the file that `LANTERNFISH_LEFT_OUT` names.
pub fn left_out(test: &str, reason: &str) {
    write_line(&format!("LEFT OUT: {test}: {reason}"));
}

/// True under `cargo xtask test --full`, which sets `LANTERNFISH_FULL`: checks of combinations take all of them.
pub fn is_full() -> bool {
    std::env::var_os("LANTERNFISH_FULL").is_some_and(|value| value == "1")
}

/// Path of a file of the shared scenes and references, in the folder `LANTERNFISH_SHARED` (default: `../shared` beside the
/// checkout). `None` if it does not exist; the test must then return, and is recorded as left out.
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
