//! The adapter that renders, with what was compiled for it.

use std::{
    mem,
    ops::{Deref, DerefMut},
    process,
};

use lanternfish_gpu::{AdapterChoice, Engine, Gpu, GpuError, driver_warning};
use pyo3::prelude::*;

use crate::{NoAdapter, check_process, failed, log};

/// What a forked process must not free: it lacks the threads of the driver, which may wait for them.
pub struct OfProcess<T> {
    value: Option<T>,
    process: u32,
}

impl<T> OfProcess<T> {
    pub fn new(value: T) -> Self {
        Self { value: Some(value), process: process::id() }
    }
}

impl<T> Deref for OfProcess<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.value.as_ref().expect("it is there until it is dropped")
    }
}

impl<T> DerefMut for OfProcess<T> {
    fn deref_mut(&mut self) -> &mut T {
        self.value.as_mut().expect("it is there until it is dropped")
    }
}

impl<T> Drop for OfProcess<T> {
    fn drop(&mut self) {
        if self.process != process::id() {
            mem::forget(self.value.take());
        }
    }
}

/// True if this machine has an adapter that can render.
#[pyfunction]
pub fn has_adapter(py: Python<'_>) -> bool {
    py.detach(|| !lanternfish_gpu::adapters().is_empty())
}

/// An open device. All renderers of a process share it.
#[pyclass(frozen)]
pub struct Device(OfProcess<(Engine, Gpu)>);

impl Device {
    pub fn engine(&self) -> &Engine {
        &self.0.0
    }
}

#[pymethods]
impl Device {
    /// Opens an adapter: `auto`, `cpu`, `gpu`, or a part of a name. `NoAdapter` if there is none, or no software one
    /// for `cpu`.
    #[new]
    fn new(py: Python<'_>, adapter: &str) -> PyResult<Self> {
        check_process()?;
        let choice = match adapter {
            "auto" => AdapterChoice::Auto,
            "cpu" => AdapterChoice::Cpu,
            "gpu" => AdapterChoice::Hardware,
            name => AdapterChoice::Name(name.to_owned()),
        };
        let opened = py.detach(|| Gpu::open(&choice).map(|gpu| (Engine::new(&gpu.device, &gpu.queue), gpu)));
        let (engine, gpu) = opened.map_err(|error| match error {
            GpuError::NoAdapter => NoAdapter::new_err(error.to_string()),
            GpuError::UnknownAdapter { .. } if choice == AdapterChoice::Cpu => NoAdapter::new_err(error.to_string()),
            _ => failed(error),
        })?;
        driver_warning(&gpu.device.adapter_info()).into_iter().for_each(|text| log::note(log::WARNING, text));
        log::note(log::INFO, format!("adapter: {}, {}", gpu.description.name, gpu.description.driver));
        log::tell(py)?;
        Ok(Self(OfProcess::new((engine, gpu))))
    }

    /// Name and driver of the adapter.
    #[getter]
    fn name(&self) -> String {
        let Gpu { description, .. } = &self.0.1;
        format!("{}, {}", description.name, description.driver)
    }
}
