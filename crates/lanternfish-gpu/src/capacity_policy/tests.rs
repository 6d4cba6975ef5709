use super::{Arrived, Counted, Growth, ListCapacity};
use crate::{Frame, Gpu, Pool, Profiler, primitives::Scan, read_back, testing};

/// Frames with lists of one name.
struct Frames<'g> {
    gpu: &'g Gpu,
    profiler: Profiler,
    pool: Pool,
}

impl<'g> Frames<'g> {
    fn new(gpu: &'g Gpu, growth: Growth) -> Self {
        let mut pool = Pool::new(&gpu.device);
        pool.set_growth(&gpu.device, growth).unwrap();
        Self { gpu, profiler: Profiler::new(&gpu.device, &gpu.queue), pool }
    }

    /// Runs a frame with two lists of these lengths. Returns their capacities, and with deferred readback whether the frame is complete.
    fn next(&mut self, elements: [u32; 2]) -> (Vec<ListCapacity>, Option<bool>) {
        let Self { gpu, profiler, pool } = self;
        let mut frame = Frame::pooled(&gpu.device, &gpu.queue, profiler, pool);
        let mut lists = Vec::new();
        for elements in elements {
            let words = frame.storage_of("words", &[elements, 5, 6, 7]).unwrap();
            let starts = frame.storage_of("starts", &[0, elements]).unwrap();
            let counted = Counted {
                list: "list",
                words: &words,
                starts: (&starts, 2),
                may_wrap: &|_| false,
                guess: 10,
                limit: 1 << 20,
            };
            lists.push(frame.capacity_for(&counted).unwrap());
        }
        let words = frame.completeness_buffer();
        frame.submit();
        let read = |words: &wgpu::Buffer| read_back::<u32>(&gpu.device, &gpu.queue, words, 2).unwrap();
        (lists, words.map(|words| read(&words)[1] == 1))
    }
}

#[gpu_test]
fn gpu_blocking_readback_always_gives_enough_capacity(gpu: &Gpu) {
    let mut frames = Frames::new(gpu, Growth::Blocking);
    for (elements, capacities) in [([3, 4], [10, 10]), ([50, 20], [50, 50]), ([7, 60], [50, 60]), ([0, 0], [60, 60])] {
        let (lists, is_complete) = frames.next(elements);
        assert_eq!(lists.iter().map(|list| list.capacity).collect::<Vec<_>>(), capacities);
        assert_eq!(lists.iter().map(|list| list.elements).collect::<Vec<_>>(), elements.map(u64::from));
        assert!(lists.iter().all(|list| list.words[1..] == [5, 6, 7]) && is_complete.is_none());
    }
    assert_eq!(frames.pool.waits(), 8);
    // A length above the limit is reported and does not change the capacity.
    let (lists, _) = frames.next([0, 1 << 21]);
    assert_eq!((lists[1].capacity, lists[1].elements), (60, 1 << 21));
}

#[gpu_test]
fn gpu_deferred_readback_reports_overflow(gpu: &Gpu) {
    let mut frames = Frames::new(gpu, Growth::Deferred);
    let (lists, is_complete) = frames.next([3, 4]);
    let least = lists[0].capacity;
    assert_eq!((lists[0].elements, is_complete), (0, Some(true)));
    // Either list may overflow. The test waits for each frame, so the next one has a sufficient capacity.
    for elements in [[0, least as u32 + 1], [4 * least as u32, 0]] {
        assert_eq!(frames.next(elements).1, Some(false), "{elements:?}");
        let (lists, is_complete) = frames.next(elements);
        assert_eq!(is_complete, Some(true), "{elements:?} in {lists:?}");
        // The elements and words are those of the frame's longest list.
        let most = u64::from(elements.into_iter().max().unwrap());
        assert_eq!((lists[0].elements, &lists[0].words[1..]), (most, &[5, 6, 7][..]));
        assert_eq!(lists[0].capacity, most * 3 / 2);
    }
    // A saturated count is an overflow, whatever the limit.
    assert_eq!(frames.next([u32::MAX, 0]).1, Some(false));
    // The count is reported once, even if the frame that reads it is discarded; the next frame counts again.
    let (lists, _) = frames.next([1, 1]);
    assert_eq!([lists[0].elements, lists[1].elements], [u32::MAX.into(), 0]);
    let (lists, _) = frames.next([1, 1]);
    assert_eq!([lists[0].elements, lists[1].elements], [1, 1]);
    assert_eq!(frames.pool.arrived(), Arrived { frames: 7, held: 3 });
    assert_eq!(frames.pool.waits(), 0);
}

/// Totals beyond 32 bits saturate with deferred readback, and wrap with blocking readback.
#[gpu_test]
fn gpu_totals_saturate_with_deferred_readback(gpu: &Gpu) {
    let scan = Scan::new(&gpu.device, "test").unwrap();
    let values: Vec<u32> = (0..5000).map(|i| if i % 1000 == 999 { 1 << 30 } else { i }).collect();
    for growth in [Growth::Blocking, Growth::Deferred] {
        let mut frames = Frames::new(gpu, growth);
        let Frames { profiler, pool, .. } = &mut frames;
        let mut frame = Frame::pooled(&gpu.device, &gpu.queue, profiler, pool);
        let list = frame.storage_of("values", &values).unwrap();
        let total = scan.record(&mut frame, &list, values.len() as u32).unwrap();
        frame.submit();
        let add = |sum: u32, value: u32| match growth {
            Growth::Blocking => sum.wrapping_add(value),
            Growth::Deferred => sum.saturating_add(value),
        };
        let sums = values.iter().scan(0, |sum, value| Some(std::mem::replace(sum, add(*sum, *value))));
        let actual = read_back::<u32>(&gpu.device, &gpu.queue, &list, values.len()).unwrap();
        assert_eq!(actual, sums.collect::<Vec<_>>(), "{growth:?}");
        let actual = read_back::<u32>(&gpu.device, &gpu.queue, &total, 1).unwrap()[0];
        assert_eq!(actual, values.iter().fold(0, |sum, value| add(sum, *value)), "{growth:?}");
        assert_eq!(actual == u32::MAX, growth == Growth::Deferred);
    }
}
