//! Exclusive prefix sum of u32 lists.

use crate::{Bindings, BufferPart, ComputeKernel, Frame, GpuError, Growth, gpu_struct};

/// Values per workgroup; the shader's `BLOCK`.
const BLOCK: u32 = 1024;

gpu_struct! {
    /// Parameters of a level.
    struct ScanParameters {
        /// Values in this level.
        count: u32,
        /// Workgroups along x.
        width: u32,
        /// 1: sums saturate at `u32::MAX`; 0: they wrap.
        saturates: u32,
    }
}

/// Exclusive prefix sum of a u32 list in place, with the total of all values. It turns counts into starts.
#[derive(Debug)]
pub struct Scan {
    blocks: ComputeKernel,
    add: ComputeKernel,
    label: String,
}

/// A level of the scan: its parameters, and its blocks' totals, which the next level scans.
struct Level {
    parameters: BufferPart,
    totals: wgpu::Buffer,
    count: u32,
}

impl Scan {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, label: &str) -> Result<Self, GpuError> {
        let shader = super::SHADERS.link("primitives/scan/scan", &[])?;
        Ok(Self {
            blocks: ComputeKernel::new(device, &shader, "scan_blocks", &format!("{label}/scan")),
            add: ComputeKernel::new(device, &shader, "add_block_starts", &format!("{label}/scan_add")),
            label: format!("{label}/totals"),
        })
    }

    /// The levels for `count` values.
    fn levels(&self, frame: &mut Frame<'_>, count: u32) -> Result<Vec<Level>, GpuError> {
        let saturates = u32::from(frame.growth() == Growth::Deferred);
        let mut levels = Vec::new();
        let mut level_count = count;
        loop {
            let blocks = level_count.div_ceil(BLOCK).max(1);
            let parameters = ScanParameters { count: level_count, width: grid(blocks)[0], saturates };
            levels.push(Level {
                parameters: frame.uniform(&parameters),
                totals: frame.scratch(&self.label, 4 * u64::from(blocks))?,
                count: level_count,
            });
            if blocks == 1 {
                return Ok(levels);
            }
            level_count = blocks;
        }
    }

    /// Replaces each of the first `count` values by the sum of all values before it. Returns a buffer with the total, one u32. Sums wrap
    /// at 2³²; with deferred readback they saturate, because the host could not detect that they wrapped.
    pub fn record(&self, frame: &mut Frame<'_>, values: &wgpu::Buffer, count: u32) -> Result<wgpu::Buffer, GpuError> {
        let levels = self.levels(frame, count)?;
        let list = |level: usize| if level == 0 { values } else { &levels[level - 1].totals };
        let bindings = |level: usize| {
            Bindings::new()
                .part("scan_parameters", &levels[level].parameters)
                .buffer("scan_values", list(level))
                .buffer("scan_totals", &levels[level].totals)
        };
        for (level, l) in levels.iter().enumerate() {
            frame.dispatch(&self.blocks, &bindings(level), grid(l.count.div_ceil(BLOCK).max(1)));
        }
        // The last level has a single block. The other levels' values still lack the start of their block.
        for (level, l) in levels.iter().enumerate().rev().skip(1) {
            frame.dispatch(&self.add, &bindings(level), grid(l.count.div_ceil(BLOCK).max(1)));
        }
        Ok(levels.last().expect("there is at least one level").totals.clone())
    }
}

/// Number of workgroups for `blocks`, within the limit of 65,535 per axis.
fn grid(blocks: u32) -> [u32; 3] {
    let width = blocks.min(32768);
    [width, blocks.div_ceil(width), 1]
}

#[cfg(all(test, feature = "testing"))]
mod tests {
    use super::*;
    use crate::{Profiler, check_layout, read_back, storage_buffer_of, testing};

    /// CPU reference: starts and total.
    fn cpu_reference(values: &[u32]) -> (Vec<u32>, u32) {
        let mut sum = 0u32;
        let starts = values
            .iter()
            .map(|v| {
                let start = sum;
                sum = sum.wrapping_add(*v);
                start
            })
            .collect();
        (starts, sum)
    }

    #[test]
    fn parameters_have_the_shaders_layout() {
        let shader = crate::primitives::SHADERS.link("primitives/scan/scan", &[]).unwrap();
        check_layout::<ScanParameters>(&shader).unwrap();
        assert_eq!(shader.workgroup_size("scan_blocks")[0] * 4, BLOCK);
    }

    #[gpu_test]
    fn gpu_scan_equals_its_cpu_reference_around_block_sizes(gpu: &Gpu) {
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let scan = Scan::new(&gpu.device, "test").unwrap();
        for count in [0, 1, 1023, 1024, 1025, 1024 * 1024 - 1, 1024 * 1024 + 1, 1_500_000] {
            let values: Vec<u32> = (0..count).map(|i: u32| i.wrapping_mul(2_654_435_761) >> 20).collect();
            let buffer = storage_buffer_of(&gpu.device, "values", &values, wgpu::BufferUsages::empty()).unwrap();
            let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
            let actual_total = scan.record(&mut frame, &buffer, count).unwrap();
            frame.submit();
            let (starts, total) = cpu_reference(&values);
            assert_eq!(read_back::<u32>(&gpu.device, &gpu.queue, &buffer, count as usize).unwrap(), starts, "{count}");
            assert_eq!(read_back::<u32>(&gpu.device, &gpu.queue, &actual_total, 1).unwrap(), [total], "{count}");
        }
    }
}
