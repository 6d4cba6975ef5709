//! The browser's device.

use std::sync::{Arc, Mutex, PoisonError};

use lanternfish::Engine;
use lanternfish_gpu::Gpu;
use wasm_bindgen::JsValue;

use crate::failed;

/// A device, with all that was compiled for it, and the first error that it reported.
#[derive(Clone)]
pub struct Device {
    pub engine: Engine,
    pub instance: wgpu::Instance,
    fault: Arc<Mutex<Option<String>>>,
}

impl Device {
    pub async fn open() -> Result<Self, JsValue> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::BROWSER_WEBGPU;
        let wanted = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let instance = wgpu::Instance::new(descriptor);
        let adapter = instance.request_adapter(&wanted).await.map_err(|_| {
            failed("this browser has no WebGPU, or no adapter for it: use a current Chrome, Edge, Firefox or Safari")
        })?;
        let features = adapter.features() & Gpu::WANTED_FEATURES;
        let gpu = Gpu::request(&adapter, features).await.map_err(failed)?;
        let fault = Arc::new(Mutex::new(None));
        let first = fault.clone();
        let tell = move |what: String| {
            first.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
        };
        let tell_error = tell.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| tell_error(error.to_string())));
        gpu.device.set_device_lost_callback(move |_, what| tell(format!("the device is lost: {what}")));
        let engine = Engine::measured(&gpu.device, &gpu.queue).await.map_err(failed)?;
        Ok(Self { engine, instance, fault })
    }

    /// The first error that the device has reported so far. It is of no use after one.
    pub fn check(&self) -> Result<(), JsValue> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone().map_or(Ok(()), |what| Err(failed(what)))
    }
}
