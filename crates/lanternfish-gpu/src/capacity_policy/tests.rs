use super::{Arrived, Counted, Growth, ListCapacity};
use crate::{Frame, Gpu, Pool, Profiler, primitives::Scan, read_back, testing};

/// Frames of one list.
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

    /// A frame in which two lists of one name have so many elements: their rooms, and whether the frame is whole, if it notes that.
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
        let whole = frame.whole();
        frame.submit();
        let read = |words: &wgpu::Buffer| read_back::<u32>(&gpu.device, &gpu.queue, words, 2).unwrap();
        (lists, whole.map(|words| read(&words)[1] == 1))
    }
}

#[test]
fn gpu_a_frame_that_waits_always_has_room() {
    let Some(gpu) = testing::gpu("gpu_a_frame_that_waits_always_has_room") else { return };
    let mut frames = Frames::new(gpu, Growth::Blocking);
    for (elements, capacities) in [([3, 4], [10, 10]), ([50, 20], [50, 50]), ([7, 60], [50, 60]), ([0, 0], [60, 60])] {
        let (lists, whole) = frames.next(elements);
        assert_eq!(lists.iter().map(|list| list.capacity).collect::<Vec<_>>(), capacities);
        assert_eq!(lists.iter().map(|list| list.elements).collect::<Vec<_>>(), elements.map(u64::from));
        assert!(lists.iter().all(|list| list.words[1..] == [5, 6, 7]) && whole.is_none());
    }
    assert_eq!(frames.pool.waits(), 8);
    // More than the limit is told, and no room is kept for it.
    let (lists, _) = frames.next([0, 1 << 21]);
    assert_eq!((lists[1].capacity, lists[1].elements), (60, 1 << 21));
}

#[test]
fn gpu_a_frame_that_does_not_wait_says_whether_it_had_room() {
    let Some(gpu) = testing::gpu("gpu_a_frame_that_does_not_wait_says_whether_it_had_room") else { return };
    let mut frames = Frames::new(gpu, Growth::Deferred);
    let (lists, whole) = frames.next([3, 4]);
    let least = lists[0].capacity;
    assert_eq!((lists[0].elements, whole), (0, Some(true)));
    // Either list of the frame may lack room; the next frame but one at the latest knows, since the test waits for each.
    for elements in [[0, least as u32 + 1], [4 * least as u32, 0]] {
        assert_eq!(frames.next(elements).1, Some(false), "{elements:?}");
        let (lists, whole) = frames.next(elements);
        assert_eq!(whole, Some(true), "{elements:?} in {lists:?}");
        // The longest of the frame.
        let most = u64::from(elements.into_iter().max().unwrap());
        assert_eq!((lists[0].elements, &lists[0].words[1..]), (most, &[5, 6, 7][..]));
        assert_eq!(lists[0].capacity, most * 3 / 2);
    }
    // What saturated is full, whatever the limit.
    assert_eq!(frames.next([u32::MAX, 0]).1, Some(false));
    // It is told once, even where the frame that is told of it is given up; the next one finds out whether it is so still.
    let (lists, _) = frames.next([1, 1]);
    assert_eq!([lists[0].elements, lists[1].elements], [u32::MAX.into(), 0]);
    let (lists, _) = frames.next([1, 1]);
    assert_eq!([lists[0].elements, lists[1].elements], [1, 1]);
    assert_eq!(frames.pool.arrived(), Arrived { frames: 7, held: 3 });
    assert_eq!(frames.pool.waits(), 0);
}

/// Totals that no word holds are the largest number where frames do not wait, and start over where they do.
#[test]
fn gpu_totals_saturate_where_nobody_would_see_them_start_over() {
    let Some(gpu) = testing::gpu("gpu_totals_saturate_where_nobody_would_see_them_start_over") else { return };
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
        let found = read_back::<u32>(&gpu.device, &gpu.queue, &list, values.len()).unwrap();
        assert_eq!(found, sums.collect::<Vec<_>>(), "{growth:?}");
        let found = read_back::<u32>(&gpu.device, &gpu.queue, &total, 1).unwrap()[0];
        assert_eq!(found, values.iter().fold(0, |sum, value| add(sum, *value)), "{growth:?}");
        assert_eq!(found == u32::MAX, growth == Growth::Deferred);
    }
}
