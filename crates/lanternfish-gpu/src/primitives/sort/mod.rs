//! Stable radix sort of keys and values.

use super::Scan;
use crate::{Bindings, ComputeKernel, Frame, GpuError, gpu_struct};

/// Pairs per invocation; the shader's `BLOCK`.
const BLOCK: u32 = 128;
/// Number of values of a digit; the shader's `DIGITS`.
const DIGITS: u32 = 16;
const DIGIT_BITS: u32 = 4;
/// Pairs up to which one workgroup sorts them.
const FEW: u32 = 4096;
/// `DIGIT_BITS` of `sort_few.wesl`.
const DIGIT_BITS_OF_FEW: u32 = 3;

gpu_struct! {
    /// Parameters of a pass, which sorts by one digit.
    struct SortParameters {
        /// Number of pairs.
        count: u32,
        /// Index of the digit's lowest bit in a key.
        shift: u32,
        /// Number of blocks of pairs.
        blocks: u32,
    }
}

gpu_struct! {
    /// Parameters of the sort of few pairs.
    struct SortFewParameters {
        /// Number of pairs.
        count: u32,
        /// Number of digits, which is even.
        passes: u32,
    }
}

/// Stable, deterministic radix sort of pairs of a u32 key and a u32 value by key. One workgroup sorts up to 4,096 pairs in one dispatch. More
/// pairs are sorted by 4 bits in each pass, with one invocation per block of 128 pairs.
#[derive(Debug)]
pub struct RadixSort {
    few: ComputeKernel,
    count_digits: ComputeKernel,
    scatter: ComputeKernel,
    scan: Scan,
    label: String,
}

impl RadixSort {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, label: &str) -> Result<Self, GpuError> {
        let shader = super::SHADERS.link("primitives/sort/sort", &[])?;
        let kernel = |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("{label}/{entry}"));
        let few = super::SHADERS.link("primitives/sort/sort_few", &[])?;
        Ok(Self {
            few: ComputeKernel::new(device, &few, "sort_few", &format!("{label}/few")),
            count_digits: kernel("count_digits"),
            scatter: kernel("scatter"),
            scan: Scan::new(device, label)?,
            label: label.to_owned(),
        })
    }

    /// Sorts the first `count` pairs by the lowest `bits` of their keys, in place. Both buffers must hold at least `count` u32.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        keys: &wgpu::Buffer,
        values: &wgpu::Buffer,
        count: u32,
        bits: u32,
    ) -> Result<(), GpuError> {
        if count < 2 {
            return Ok(());
        }
        let blocks = count.div_ceil(BLOCK);
        // Output of every second pass, and the start of each block's pairs of each digit.
        let mut buffer = |name: &str, length: u64| frame.scratch(&format!("{}/{name}", self.label), 4 * length);
        let length = u64::from(count);
        let (other_keys, other_values) = (buffer("keys", length)?, buffer("values", length)?);
        if count <= FEW {
            let passes = bits.div_ceil(DIGIT_BITS_OF_FEW).next_multiple_of(2);
            let parameters = frame.uniform(&SortFewParameters { count, passes });
            let bindings = Bindings::new()
                .part("sort_few_parameters", &parameters)
                .buffer("sorted_keys", keys)
                .buffer("sorted_values", values)
                .buffer("other_keys", &other_keys)
                .buffer("other_values", &other_values);
            frame.dispatch(&self.few, &bindings, [1; 3]);
            return Ok(());
        }
        let starts = buffer("digit_places", u64::from(DIGITS) * u64::from(blocks))?;
        // An even number of passes leaves the result in the caller's buffers.
        let passes = bits.div_ceil(DIGIT_BITS).next_multiple_of(2);
        for pass in 0..passes {
            let parameters = SortParameters { count, shift: (DIGIT_BITS * pass).min(28), blocks };
            let parameters = frame.uniform(&parameters);
            let lists = if pass % 2 == 0 {
                [keys, values, &other_keys, &other_values]
            } else {
                [&other_keys, &other_values, keys, values]
            };
            let bindings = Bindings::new()
                .part("sort_parameters", &parameters)
                .buffer("keys_in", lists[0])
                .buffer("values_in", lists[1])
                .buffer("keys_out", lists[2])
                .buffer("values_out", lists[3])
                .buffer("digit_places", &starts);
            let workgroups = [blocks.div_ceil(self.count_digits.workgroup_size()[0]), 1, 1];
            frame.dispatch(&self.count_digits, &bindings, workgroups);
            self.scan.record(frame, &starts, DIGITS * blocks)?;
            frame.dispatch(&self.scatter, &bindings, workgroups);
        }
        Ok(())
    }
}

#[cfg(all(test, feature = "testing"))]
mod tests {
    use super::*;
    use crate::{Profiler, check_layout, read_back, storage_buffer_of, testing};

    #[test]
    fn parameters_have_the_shaders_layout() {
        let shader = crate::primitives::SHADERS.link("primitives/sort/sort", &[]).unwrap();
        check_layout::<SortParameters>(&shader).unwrap();
        let few = crate::primitives::SHADERS.link("primitives/sort/sort_few", &[]).unwrap();
        check_layout::<SortFewParameters>(&few).unwrap();
    }

    #[gpu_test]
    fn gpu_sort_equals_its_cpu_reference_around_block_sizes(gpu: &Gpu) {
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let sort = RadixSort::new(&gpu.device, "test").unwrap();
        for (count, bits, mask) in [
            (0u32, 30, u32::MAX >> 2),
            (1, 30, u32::MAX >> 2),
            (2, 32, u32::MAX),
            (127, 4, 0xf),
            (128, 8, 0xff),
            (129, 12, 0xfff),
            (255, 30, u32::MAX >> 2),
            (257, 32, u32::MAX),
            (1_000, 2, 0x3),
            (4_095, 32, u32::MAX),
            // Many equal keys: the order of the values shows whether the sort is stable.
            (4_096, 30, 0x7),
            (4_097, 30, 0x7),
            (5_000, 30, 0x7),
            (64 * 128 + 1, 30, u32::MAX >> 2),
            (150_000, 32, u32::MAX),
        ] {
            let keys: Vec<u32> = (0..count).map(|i| (i.wrapping_mul(2_654_435_761) ^ (i >> 3)) & mask).collect();
            let values: Vec<u32> = (0..count).collect();
            let none = wgpu::BufferUsages::empty();
            let key_buffer = storage_buffer_of(&gpu.device, "keys", &keys, none).unwrap();
            let value_buffer = storage_buffer_of(&gpu.device, "values", &values, none).unwrap();
            let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
            sort.record(&mut frame, &key_buffer, &value_buffer, count, bits).unwrap();
            frame.submit();
            let mut expected: Vec<(u32, u32)> = keys.into_iter().zip(values).collect();
            expected.sort_by_key(|(key, _)| *key);
            let read = |buffer| read_back::<u32>(&gpu.device, &gpu.queue, buffer, count as usize).unwrap();
            let actual: Vec<(u32, u32)> = read(&key_buffer).into_iter().zip(read(&value_buffer)).collect();
            assert_eq!(actual, expected, "{count} pairs by {bits} bits");
        }
    }
}
