//! `validate` detects broken images, and stores hold the fragments of any builder.

use glam::{Quat, Vec4};
use lanternfish::RenderError;
use lanternfish_gpu::{
    Bindings, Frame, Gpu, Profiler, read_back, storage_buffer, storage_buffer_of, uniform_buffer_of,
};

use super::{frame_of, lists, record, settings, upload};
use crate::{
    DeepBuilder, DeepImageSettings, DeepSort, DeepStore,
    deep_images::{
        Chunk, DeepCounts, DeepGrid, DeepImageBuilder, DeepImages, Fragment, ListFault, cpu_reference,
        directions::{DirectionSet, Directions},
        store::{MOST_SLOTS, Source, Store, put_features},
    },
    testing::{self, Random, probe},
};

const TRIANGLES: u32 = 1000;

/// Three images of 2 x 2 texels, with given fragments (list, depth, triangle).
fn images_of(gpu: &Gpu, settings: DeepImageSettings, put: &[Vec4]) -> DeepImages {
    let none = wgpu::BufferUsages::empty();
    let buffer = |label, content: &[Vec4]| storage_buffer_of(&gpu.device, label, content, none).unwrap();
    let groups = |fragments: &[Vec4]| [fragments.len().div_ceil(64) as u32, 1, 1];
    let (queries, groups) = (buffer("put", put), groups(put));
    let kernel = probe(gpu, "testing/put_fragments", &put_features(&settings), "put");
    let directions = Directions::new(settings.directions).unwrap();
    let grid = DeepGrid {
        radius: 1.0,
        texels_per_metre: 1.0,
        resolution: 2,
        image_count: 3,
        triangle_count: TRIANGLES,
        merge_distance: settings.merge_texels,
        ..DeepGrid::default()
    };
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let mut source = Source {
        bindings: Default::default(),
        gather: &mut |frame, _, bindings| {
            frame.dispatch(&kernel, &bindings.clone().buffer("queries", &queries), groups);
            Ok(())
        },
    };
    let chunk = Store::new(&gpu.device, &settings).unwrap().record(&mut frame, grid, &mut source).unwrap();
    frame.submit();
    let mut images = DeepImages {
        settings,
        direction_cells: storage_buffer_of(&gpu.device, "direction_cells", directions.cells(), none).unwrap(),
        directions,
        frames: storage_buffer(&gpu.device, "frames", 16).unwrap(),
        counts: DeepCounts { drawn: chunk.drawn, kept: chunk.fragments, bytes: 0 },
        chunks: vec![chunk],
    };
    let frames: Vec<_> = (0..3).map(|image| frame_of(&images, image)).collect();
    images.frames = storage_buffer_of(&gpu.device, "frames", &frames, none).unwrap();
    images
}

fn by_hand(store: DeepStore, merge_texels: f32) -> DeepImageSettings {
    let directions = DirectionSet::Cube { k: 1 };
    DeepImageSettings { directions, resolution: 2, store, merge_texels, ..DeepImageSettings::default() }
}

/// Lists of every length around the sort's bounds, some depths equal, some zero, some at the sphere's ends.
fn fragments() -> Vec<Vec4> {
    let mut random = Random::new(9);
    let lengths = [3, 0, 1, 2, 47, 48, 49, 50, 0, 300, 1000, 1];
    let mut all = Vec::new();
    for (list, length) in lengths.into_iter().enumerate() {
        for i in 0..length {
            let depth = match i % 7 {
                0 => 0.0,
                1 => 0.25,
                2 => -1.0,
                3 => 1.0,
                _ => random.between(-1.0, 1.0),
            };
            // No two fragments of a list have the same triangle, so fragments of one depth have an order.
            all.push(Vec4::new(list as f32, depth, ((i * 617) % TRIANGLES) as f32, 0.0));
        }
    }
    all
}

/// For any number of fragments, the counter of slots saturates and does not wrap to zero.
#[gpu_test]
fn gpu_the_counter_of_slots_saturates(gpu: &Gpu) {
    let none = wgpu::BufferUsages::empty();
    let settings = by_hand(DeepStore::LinearArray, 0.0);
    let kernel = probe(gpu, "testing/put_fragments", &put_features(&settings), "put");
    let grid = DeepGrid { resolution: 2, image_count: 1, capacity: 4, ..DeepGrid::default() };
    // Four lists, an unused word, and the number of taken slots.
    let counters = [0, 0, 0, 0, 0, MOST_SLOTS - 100];
    let counters = storage_buffer_of(&gpu.device, "counters", &counters, none).unwrap();
    let queries = storage_buffer_of(&gpu.device, "put", &[Vec4::ZERO; 640], none).unwrap();
    let slots = |label| storage_buffer(&gpu.device, label, 16).unwrap();
    let (depths, triangles, links) = (slots("depths"), slots("triangles"), slots("links"));
    let grid = uniform_buffer_of(&gpu.device, "grid", &grid);
    let bindings = Bindings::new().buffer("queries", &queries).buffer("list_counters", &counters);
    let bindings = bindings.buffer("deep_grid", &grid).buffer("put_depths", &depths);
    let bindings = bindings.buffer("put_triangles", &triangles).buffer("put_links", &links);
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    frame.dispatch(&kernel, &bindings, [10, 1, 1]);
    frame.submit();
    let actual = read_back::<u32>(&gpu.device, &gpu.queue, &counters, 6).unwrap();
    assert_eq!(actual[5], MOST_SLOTS + 1);
    // A list holds only fragments that took a slot.
    assert_eq!(actual[0], 101);
}

#[gpu_test]
fn gpu_stores_hold_their_fragments(gpu: &Gpu) {
    let put = fragments();
    let ascending = |list: &mut Vec<Fragment>| {
        list.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.triangle.cmp(&b.triangle)));
    };
    for store in DeepStore::ALL.iter().copied() {
        let mut choices = vec![(true, 0.02, DeepSort::Selection), (false, 0.0, DeepSort::Selection)];
        // Only arrays are sorted by a pass that has a choice.
        choices.extend((store == DeepStore::LinearArray).then_some((true, 0.02, DeepSort::Blocks)));
        for (payload, merge_texels, sort) in choices {
            let settings = DeepImageSettings { payload, sort, ..by_hand(store, merge_texels) };
            let images = images_of(gpu, settings, &put);
            images.validate(&gpu.device, &gpu.queue).unwrap();
            let actual = lists(gpu, &images, &images.chunks[0]);
            for (list, mut actual) in actual.into_iter().enumerate() {
                let of_list = put.iter().filter(|fragment| fragment.x as usize == list);
                let mut expected: Vec<Fragment> = of_list
                    .map(|fragment| Fragment {
                        // A depth of 0 is stored as LEAST_DEPTH of put_fragment.wesl.
                        depth: if fragment.y == 0.0 { 1e-30 } else { fragment.y },
                        triangle: Some(fragment.z as u32),
                    })
                    .collect();
                ascending(&mut expected);
                if store == DeepStore::LinearArray {
                    expected = cpu_reference::merge(&expected, merge_texels);
                }
                if store == DeepStore::LinkedList {
                    ascending(&mut actual);
                }
                expected.iter_mut().for_each(|fragment| fragment.triangle = fragment.triangle.filter(|_| payload));
                assert_eq!(actual, expected, "{settings:?}, list {list}");
            }
        }
    }
}

/// The fault that `validate` reports.
fn fault(gpu: &Gpu, images: &DeepImages) -> Option<ListFault> {
    match images.validate(&gpu.device, &gpu.queue) {
        Ok(()) => None,
        Err(RenderError::Check { fault, .. }) => Some(*fault.downcast().expect("a fault of the lists")),
        Err(other) => panic!("{other}"),
    }
}

/// A way to break images, and the resulting fault.
struct Break {
    store: DeepStore,
    what: &'static str,
    break_images: fn(&Gpu, &mut DeepImages),
    is_expected: fn(&ListFault) -> bool,
}

fn write(gpu: &Gpu, buffer: &wgpu::Buffer, index: usize, word: u32) {
    gpu.queue.write_buffer(buffer, 4 * index as u64, &word.to_le_bytes());
}

fn next(chunk: &Chunk) -> &wgpu::Buffer {
    chunk.next.as_ref().unwrap()
}

macro_rules! breaks {
    ($($store:ident $what:literal: |$gpu:pat_param, $images:ident| $how:expr => $fault:pat,)+) => {
        [$(Break {
            store: DeepStore::$store,
            what: $what,
            break_images: |$gpu, $images| $how,
            is_expected: |fault| matches!(fault, $fault),
        }),+]
    };
}

#[gpu_test]
fn gpu_validation_notices_every_fault(gpu: &Gpu) {
    use ListFault::*;
    let scene = upload(gpu, &lanternfish_scene::generate::demo("cornell").unwrap());
    let breaks = breaks! {
        LinearArray "the first list starts late":
            |gpu, i| write(gpu, &i.chunks[0].list_starts, 1, 1) => Start { list: 0, .. },
        LinearArray "a list starts far on":
            |gpu, i| write(gpu, &i.chunks[0].list_starts, 5, 1 << 30) => Start { .. },
        LinearArray "a fragment behind the last list":
            |_, i| i.chunks[0].fragments += 1 => End { .. } | Unwritten { .. },
        LinearArray "fewer fragments than lists hold": |_, i| i.chunks[0].fragments -= 1 => End { .. },
        LinearArray "more kept than drawn": |_, i| i.counts.drawn -= 1 => Lost { .. },
        LinearArray "fewer kept than drawn": |_, i| i.counts.drawn += 1 => Lost { .. },
        LinearArray "a hole": |gpu, i| write(gpu, &i.chunks[0].depths, 100, 0) => Unwritten { index: 100 },
        LinearArray "a depth past the scene":
            |gpu, i| write(gpu, &i.chunks[0].depths, 7, 1e6_f32.to_bits()) => Depth { index: 7, .. },
        LinearArray "no number": |gpu, i| write(gpu, &i.chunks[0].depths, 7, f32::NAN.to_bits()) => Unwritten { .. },
        LinearArray "no such triangle":
            |gpu, i| write(gpu, i.chunks[0].triangles.as_ref().unwrap(), 3, 1 << 20) => Triangle { index: 3, .. },
        LinearArray "two lists out of order": |gpu, i| swap_first_two(gpu, i) => Unsorted { .. },
        LinearArray "an image twice": |_, i| i.chunks[0].grid.first_image = 1 => Images { .. },
        LinearArray "a chunk is missing": |_, i| i.chunks.clear() => Images { .. },
        LinearArray "axes of another set":
            |_, i| i.directions = i.directions.rotated(Quat::from_rotation_x(0.1)) => Direction { image: 0 },
        LinearArray "an image the other way round":
            |gpu, i| gpu.queue.write_buffer(&i.frames, 48 * 2, &[0; 48]) => Direction { image: 2 },
        LinkedList "slots that were not taken": |gpu, i| write(gpu, &i.chunks[0].list_starts, 0, 9) => End { .. },
        LinkedList "a link to nowhere": |gpu, i| write(gpu, next(&i.chunks[0]), 4, 1 << 30) => Link { .. },
        LinkedList "a cycle": |gpu, i| write(gpu, next(&i.chunks[0]), 4, 5) => Twice { index: 4, .. },
        LinkedList "a list is lost": |gpu, i| lose_a_list(gpu, i) => Unlisted { .. },
        LinkedList "a hole": |gpu, i| write(gpu, &i.chunks[0].depths, 100, 0) => Unwritten { index: 100 },
        SortedLinkedList "a list out of order": |gpu, i| swap_first_two(gpu, i) => Unsorted { .. },
        SortedLinkedList "a fragment that was never linked":
            |gpu, i| write(gpu, next(&i.chunks[0]), 4, 0x8000_0000) => Link { .. },
        SortedLinkedList "fewer kept than drawn": |_, i| i.counts.drawn += 1 => Lost { .. },
    };
    for store in DeepStore::ALL.iter().copied() {
        let (directions, usual) = (DirectionSet::Cube { k: 1 }, settings(DeepBuilder::SinglePass));
        let settings = DeepImageSettings { store, directions, resolution: 24, merge_texels: 0.0, ..usual };
        let mut builder = DeepImageBuilder::new(&gpu.device, settings).unwrap();
        for Break { what, break_images, is_expected, .. } in breaks.iter().filter(|it| it.store == store) {
            let mut images = record(gpu, &mut builder, &scene);
            assert_eq!(fault(gpu, &images), None, "{what}");
            break_images(gpu, &mut images);
            let actual = fault(gpu, &images);
            assert!(actual.as_ref().is_some_and(is_expected), "{store} {what}: {actual:?}");
        }
    }
}

/// Makes the first fragment of a list with several fragments the farthest.
fn swap_first_two(gpu: &Gpu, images: &DeepImages) {
    let chunk = &images.chunks[0];
    let all = lists(gpu, images, chunk);
    let list = all.iter().position(|list| list.len() > 1 && list[0].depth < list[1].depth).unwrap();
    let first = match &chunk.next {
        None => all[..list].iter().map(Vec::len).sum(),
        Some(_) => {
            let heads =
                lanternfish_gpu::read_back::<u32>(&gpu.device, &gpu.queue, &chunk.list_starts, list + 2).unwrap();
            heads[list + 1] as usize - 1
        }
    };
    write(gpu, &chunk.depths, first, chunk.grid.radius.to_bits());
}

/// Empties a list that has fragments.
fn lose_a_list(gpu: &Gpu, images: &DeepImages) {
    let chunk = &images.chunks[0];
    let list = lists(gpu, images, chunk).iter().position(|list| !list.is_empty()).unwrap();
    write(gpu, &chunk.list_starts, list + 1, 0);
}
