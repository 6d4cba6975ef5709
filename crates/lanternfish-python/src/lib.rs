//! The Python module `lanternfish._lanternfish`: what the package's Python code needs of the library.
//!
//! The interface that users see, its checks of shapes and types and its documentation are Python:
//! `python/lanternfish/`. This module takes and returns numpy arrays and the objects of that interface (`objects.rs`).
//! Work runs without the interpreter's lock.

mod device;
mod log;
mod objects;
mod outputs;
mod reference;
mod renderer;
mod scene;
mod settings;

use std::{ffi::OsString, fmt, io, process, sync::OnceLock};

use lanternfish::RenderError;
use lanternfish_scene::SceneError;
use pyo3::{
    create_exception,
    exceptions::{PyFileNotFoundError, PyMemoryError, PyRuntimeError, PyValueError},
    prelude::*,
};

create_exception!(lanternfish, Error, PyRuntimeError, "What Lanternfish cannot do, with the remedy.");
create_exception!(lanternfish, NoAdapter, Error, "There is no adapter to render with.");

/// An error of the library as an exception.
fn failed(error: impl fmt::Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// What a caller may correct is a `ValueError`.
fn render_failed(error: impl Into<RenderError>) -> PyErr {
    let error = error.into();
    let text = error.to_string();
    match error {
        RenderError::InvalidScene(_) | RenderError::Camera { .. } | RenderError::Size { .. } => {
            PyValueError::new_err(text)
        }
        RenderError::TooMuch(_) | RenderError::ImageTooLarge(_) => PyMemoryError::new_err(text),
        _ => failed(text),
    }
}

fn load_failed(error: SceneError) -> PyErr {
    let text = error.to_string();
    match error {
        SceneError::Io { source, .. } if source.kind() == io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        _ => failed(text),
    }
}

/// Begins a use of the library. An error in a process that was forked after the first use: it has none of the threads
/// that work, nor the driver's.
#[pyfunction]
fn check_process() -> PyResult<()> {
    static USER: OnceLock<u32> = OnceLock::new();
    let user = USER.get_or_init(|| {
        log::install();
        process::id()
    });
    match *user == process::id() {
        true => Ok(()),
        false => Err(failed(
            "this process was forked from one that had used lanternfish: start processes with \
             multiprocessing.get_context(\"spawn\"), or use lanternfish in them only",
        )),
    }
}

/// Handles pending signals, and tells `progress` what is done; an exception ends the work.
fn step(progress: Option<&Py<PyAny>>, done: usize, all: usize) -> PyResult<()> {
    Python::attach(|py| {
        py.check_signals()?;
        log::tell(py)?;
        progress.map_or(Ok(()), |progress| progress.call1(py, (done, all)).map(|_| ()))
    })
}

/// Runs the program `lanternfish` and returns its exit code. `program` starts it in another process.
#[pyfunction]
fn command(py: Python<'_>, program: Vec<OsString>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| lanternfish_cli::main_of(program, arguments))
}

#[pymodule]
fn _lanternfish(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("NoAdapter", module.py().get_type::<NoAdapter>())?;
    module.add("OUTPUTS", outputs::NAMES)?;
    module.add_class::<device::Device>()?;
    module.add_class::<scene::SceneData>()?;
    module.add_class::<renderer::RendererData>()?;
    module.add_class::<renderer::Moment>()?;
    module.add_function(wrap_pyfunction!(reference::reference, module)?)?;
    module.add_function(wrap_pyfunction!(reference::compare, module)?)?;
    module.add_function(wrap_pyfunction!(settings::settings, module)?)?;
    module.add_function(wrap_pyfunction!(device::has_adapter, module)?)?;
    module.add_function(wrap_pyfunction!(check_process, module)?)?;
    module.add_function(wrap_pyfunction!(command, module)?)
}
