//! Device counters of indirect light.

use lanternfish_gpu::{Frame, GpuError, read_back};

/// Counts of one view of a frame: rows of as many words as there are names, which are added up.
#[derive(Clone, Debug)]
pub struct Counters {
    counts: wgpu::Buffer,
    rows: u32,
    names: &'static [&'static str],
    /// Whether those of blended surfaces are added: rays are, lights are the same ones.
    pub adds_up: bool,
}

impl Counters {
    /// All zero at first. Labels and names are paths.
    pub fn new(
        frame: &mut Frame<'_>,
        label: &str,
        rows: u32,
        names: &'static [&'static str],
    ) -> Result<Self, GpuError> {
        let bytes = 4 * names.len() as u64 * u64::from(rows);
        Ok(Self { counts: frame.zeroed(label, bytes)?, rows, names, adds_up: true })
    }

    /// The words, row by row.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.counts
    }

    /// Name and count of each, once the frame was handed to the device.
    pub fn read(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<(&'static str, u64)>, GpuError> {
        let words = read_back::<u32>(device, queue, &self.counts, self.rows as usize * self.names.len())?;
        let rows = words.chunks_exact(self.names.len());
        let sum = |column: usize| rows.clone().map(|row| u64::from(row[column])).sum();
        Ok(self.names.iter().enumerate().map(|(column, name)| (*name, sum(column))).collect())
    }
}
