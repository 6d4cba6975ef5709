//! Device counters of indirect light.

use lanternfish_gpu::{Frame, GpuError, read_back};

/// Counts of one view of a frame: rows with one 32-bit word per name. A count is the sum of its column.
#[derive(Clone, Debug)]
pub struct Counters {
    counts: wgpu::Buffer,
    rows: u32,
    names: &'static [&'static str],
    /// True if the counts of transparent surfaces are added to those of opaque ones. Ray counts are; light counts are not, as both use the same
    /// lights.
    pub adds_up: bool,
}

impl Counters {
    /// Creates counters that are all zero. Labels and names are paths.
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

    /// Reads back the name and count of each counter, after the frame was submitted.
    pub fn read(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<(&'static str, u64)>, GpuError> {
        let words = read_back::<u32>(device, queue, &self.counts, self.rows as usize * self.names.len())?;
        let rows = words.chunks_exact(self.names.len());
        let sum = |column: usize| rows.clone().map(|row| u64::from(row[column])).sum();
        Ok(self.names.iter().enumerate().map(|(column, name)| (*name, sum(column))).collect())
    }
}
