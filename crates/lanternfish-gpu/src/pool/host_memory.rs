//! The memory budget of frames on a software adapter, whose memory is the process's.

use lanternfish_limits::memory::{Budget, TooMuch};

use crate::GpuError;

/// Counts the resources that a frame creates, before it runs. A graphics card has memory of its own, and nothing is counted.
#[derive(Debug)]
pub(crate) struct HostMemory {
    is_counted: bool,
    /// The budget of this frame, from its first new resource on.
    budget: Option<Budget>,
    refused: Option<TooMuch>,
}

impl HostMemory {
    pub fn new(device: &wgpu::Device) -> Self {
        let is_counted = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
        Self { is_counted, budget: None, refused: None }
    }

    /// A count that starts with this budget, on any adapter.
    #[cfg(test)]
    pub fn within(budget: Budget) -> Self {
        Self { is_counted: true, budget: Some(budget), refused: None }
    }

    pub fn begin(&mut self) {
        (self.budget, self.refused) = (None, None);
    }

    /// Counts a new resource. After an error nothing of the frame may run.
    pub fn take(&mut self, label: &str, bytes: u64) -> Result<(), GpuError> {
        if self.is_counted && self.refused.is_none() {
            let budget = self.budget.get_or_insert_with(Budget::of_process);
            self.refused = budget.take(bytes, || format!("{label}, of a frame, needs")).err();
        }
        self.check()
    }

    /// The first error of this frame.
    pub fn check(&self) -> Result<(), GpuError> {
        self.refused.clone().map_or(Ok(()), |need| Err(GpuError::TooMuch(need)))
    }
}

#[cfg(test)]
#[test]
fn a_frame_beyond_its_budget_fails_as_a_whole() {
    let mut memory = HostMemory::within(Budget::of(10_000_000));
    assert!(memory.take("depth", 4_000_000).is_ok() && memory.check().is_ok());
    let error = memory.take("radiance", 8_000_000).unwrap_err().to_string();
    assert!(error.starts_with("radiance, of a frame, needs 8.0 MB of memory"), "{error}");
    let later = memory.take("display", 1).unwrap_err().to_string();
    assert_eq!((later, memory.check().unwrap_err().to_string()), (error.clone(), error));
    memory.begin();
    assert!(memory.check().is_ok());
}
