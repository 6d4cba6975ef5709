//! The adapter that renders, with what was compiled for it.

use lanternfish_gpu::{AdapterChoice, Engine, Gpu, GpuError, driver_warning};
use pyo3::prelude::*;

use crate::{NoAdapter, check_process, failed, log};

/// An open device. All renderers of a process share it.
#[pyclass(frozen)]
pub struct Device {
    gpu: Gpu,
    pub engine: Engine,
}

#[pymethods]
impl Device {
    /// Opens an adapter: `auto`, `cpu`, `gpu`, or a part of a name. `NoAdapter` if there is none, or no software one for `cpu`.
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
        Ok(Self { gpu, engine })
    }

    /// Name and driver of the adapter.
    #[getter]
    fn name(&self) -> String {
        format!("{}, {}", self.gpu.description.name, self.gpu.description.driver)
    }
}
