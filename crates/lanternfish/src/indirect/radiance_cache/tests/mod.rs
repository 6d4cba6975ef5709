//! Comparison of the cache's shaders with the CPU reference, up to the assignment of slots and the rounding of floats; in two orders of invocations.

mod accumulate;
mod hashing;
mod mutations;
mod propagate;
mod schedule;
mod table;
mod vote;

use std::{cell::RefCell, collections::BTreeMap, fmt::Debug};

use glam::{Vec3, Vec4};
use lanternfish_gpu::{
    ComputeKernel, Gpu, ShaderLibrary,
    testing::{self, Memory},
};

use super::{
    CacheUpdate, RadianceCacheParameters, SHARES_DISPATCH_IN_TESTS,
    parameters::{CacheSweep, EntrySample, Link, SampledEntry, ScheduledEntry},
    reference::{Entry, LISTED, Table, vote::with_rank},
};
use crate::{
    Renderer, Settings,
    common::workgroups,
    settings::{Indirect, Shadows, Tracer},
    techniques::Sampled,
    testing::{Random, edited_library, library, probe_of},
    view::View,
};

/// Result of a comparison; an error describes the first difference.
type Compared = Result<(), String>;

/// A comparison of one part of the cache.
type Comparison = fn(&Bench) -> Compared;

/// The shaders and the device that runs them.
struct Bench {
    library: ShaderLibrary,
    gpu: &'static Gpu,
    kernels: RefCell<BTreeMap<String, ComputeKernel>>,
}

/// Largest relative error of floats: on a device some operations are not rounded as in IEEE 754.
const TOLERANCE: f32 = 1e-5;

impl Bench {
    fn new(gpu: &'static Gpu, library: ShaderLibrary) -> Self {
        Self { library, gpu, kernels: RefCell::default() }
    }

    fn run(&self, memory: &mut Memory, module: &str, entry: &str, workgroups: [u32; 3]) {
        let module = if module.starts_with("testing/") {
            module.to_owned()
        } else {
            format!("indirect/radiance_cache/{module}")
        };
        let compile = || probe_of(&self.library, self.gpu, &module, &[], entry);
        let kernel = self.kernels.borrow_mut().entry(format!("{module}:{entry}")).or_insert_with(compile).clone();
        memory.run(self.gpu, &kernel, workgroups);
    }

    /// Runs a probe over these queries, `each` vectors per query.
    fn evaluate(
        &self,
        memory: &mut Memory,
        module: &str,
        entry: &str,
        queries: &[[u32; 4]],
        each: usize,
    ) -> Vec<[u32; 4]> {
        let count = queries.len() / each;
        memory.bind(&["queries"], queries);
        memory.bind(&["answers"], &vec![[0u32; 4]; count]);
        self.run(memory, module, entry, [count.div_ceil(64) as u32, 1, 1]);
        memory.get("answers")
    }
}

/// Compares, then compares again with invocations in reverse order within each workgroup.
fn check(gpu: &'static Gpu, comparison: Comparison) {
    comparison(&Bench::new(gpu, library())).unwrap();
    let index = "id.y * WIDTH * WORKGROUP + id.x";
    let reversed = edited_library("indirect/radiance_cache/bindings", index, &format!("({index}) ^ (WORKGROUP - 1u)"));
    comparison(&Bench::new(gpu, reversed)).unwrap_or_else(|difference| panic!("in reverse order: {difference}"));
}

/// Returns an error that describes the first difference of two lists.
fn same<T: PartialEq + Debug>(what: &str, actual: &[T], expected: &[T]) -> Compared {
    let at = actual.iter().zip(expected).position(|(actual, expected)| actual != expected);
    let at = at.or((actual.len() != expected.len()).then_some(actual.len().min(expected.len())));
    at.map_or(Ok(()), |at| {
        Err(format!("{what} {at} of {}: {:?} for {:?}", expected.len(), actual.get(at), expected.get(at)))
    })
}

fn bits<const N: usize>(floats: [f32; N]) -> [u32; N] {
    floats.map(f32::to_bits)
}

/// A random number below `end`.
fn below(random: &mut Random, end: u32) -> u32 {
    ((random.unit() * end as f32) as u32).min(end - 1)
}

/// A random number of 32 bits.
fn word(random: &mut Random) -> u32 {
    below(random, 1 << 16) | (below(random, 1 << 16) << 16)
}

fn one_of<T: Copy>(random: &mut Random, all: &[T]) -> T {
    all[below(random, all.len() as u32) as usize]
}

/// Different random keys with hashes that select one of the first `homes` buckets.
fn random_entries(random: &mut Random, count: usize, homes: u32) -> Vec<Entry> {
    let mut keys = std::collections::BTreeSet::new();
    while keys.len() < count {
        keys.insert(word(random).max(1));
    }
    let hash = |random: &mut Random| (word(random) & !0xffff) | (4 * below(random, homes) + below(random, 4));
    let mut entries: Vec<_> = keys.into_iter().map(|key| Entry { key, hash: hash(random) }).collect();
    // Shuffles them.
    entries.sort_by_key(|entry| entry.key.wrapping_mul(0x9e37_79b9));
    entries
}

/// Parameters of a frame, for a cache with all bounces.
fn parameters(slots: u32) -> RadianceCacheParameters {
    RadianceCacheParameters {
        slot_mask: slots - 1,
        edge: 0.25,
        near: 32.0,
        frame: 1000,
        kept: 128,
        fewest: 4,
        most: 128.0,
        most_fraction: 8,
        changes: 5,
        bounce_levels: 2,
        earlier_steps: 1,
        known_lights: 4,
        ..Default::default()
    }
}

/// Parameters of an update in an unchanged scene.
const UPDATE: CacheUpdate =
    CacheUpdate { update: 1_000_003, fraction: 8, remembered: f32::MAX, ages: 1, counts: 1, budget: 0 };

/// A table with so many entries of random state, requested up to 200 frames ago.
fn random_table(random: &mut Random, slots: u32, entries: usize, parameters: &RadianceCacheParameters) -> Table {
    let known = 1 + parameters.bounce_levels as usize;
    let levels = known + parameters.known_lights as usize;
    let has_two_totals = parameters.bounce_levels == 2 && parameters.first_level == 0;
    let mut table = Table::new(slots, levels, parameters.earlier_steps as usize);
    for entry in random_entries(random, entries, slots / 4) {
        let slot = table.insert(entry).expect("the table is full") as usize;
        table.votes[slot] = if random.unit() < 0.3 { word(random).max(1) } else { 0 };
        table.requested[slot] = parameters.frame - one_of(random, &[0, 1, 2, 50, 127, 128, 129, 130, 200]);
        let triangle = below(random, 1 << 20) | (below(random, 2) << 31);
        table.samples[slot] =
            with_rank(EntrySample { p_world: random.point(), triangle }, one_of(random, &[0, 0, 1, 1, 2, 3, 5, 6, 7]));
        let samples =
            one_of(random, &[0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 23, 24, 31, 32, 127, 128, 129, 300]);
        for (level, light) in table.light.iter_mut().enumerate() {
            // Direct light may count as fewer samples than there are hits; numbers of known lights are different ones.
            let w = match level {
                1 if has_two_totals => 0.5 * samples as f32,
                _ if level >= known => (samples % 5 + level) as f32,
                _ => samples as f32,
            };
            light[slot] = (Vec3::ONE + random.point()).extend(w);
        }
        for earlier in &mut table.earlier {
            // Not read if no hit has left the list.
            let mean = if samples <= LISTED { Vec3::INFINITY } else { Vec3::ONE + random.point() };
            earlier[slot] = mean.extend(0.0);
        }
    }
    let taken: Vec<usize> = table.taken().collect();
    for slot in taken.iter().copied() {
        for hit in 0..LISTED {
            let to = if random.unit() < 0.1 { slot } else { one_of(random, &taken) };
            let reflectance = if random.unit() < 0.1 { 0 } else { word(random) & 0x3fff_ffff };
            table.hits[slot][hit] = Link { slot: to as u32, reflectance };
        }
    }
    table
}

/// Samples of the entries of a list, whose rays have hit entries of the table, surfaces without a slot, or nothing.
fn random_samples(random: &mut Random, table: &Table, list: &[ScheduledEntry]) -> Vec<SampledEntry> {
    let taken: Vec<usize> = table.taken().collect();
    let mut samples = Vec::new();
    for entry in list {
        let hit = if random.unit() < 0.2 { u32::MAX } else { one_of(random, &taken) as u32 };
        let color = |random: &mut Random| 0.5 * (Vec3::ONE + random.point());
        samples.push(SampledEntry {
            slot: entry.of_slot(),
            reflected: color(random),
            sent: color(random),
            reflectance: color(random),
            triangle: if hit == u32::MAX && random.unit() < 0.5 { u32::MAX } else { below(random, 16) },
            slot_hit: hit,
            rank: below(random, 8) | (below(random, 9) << 3),
            vote: u32::from(hit != u32::MAX && random.unit() < 0.5),
            ..Default::default()
        });
    }
    samples
}

/// A list of different entries of a table: about this fraction of them.
fn random_list(random: &mut Random, table: &Table, fraction: f32) -> Vec<ScheduledEntry> {
    let taken: Vec<usize> = table.taken().collect();
    let mut list = Vec::new();
    for slot in taken {
        if random.unit() < fraction {
            let hit_bit = if random.unit() < 0.5 { ScheduledEntry::IS_HIT } else { 0 };
            list.push(ScheduledEntry { slot: slot as u32 | hit_bit, sample: word(random) });
        }
    }
    list
}

/// Words of a list before its entries: the workgroups for it, its length, and the number of entries of the table.
const LIST_HEADER: usize = super::LIST_HEADER_BYTES as usize / 4;

/// A list as passes read it: with capacity for as many entries as the table has slots.
fn scheduled_words(list: &[ScheduledEntry], slots: u32) -> Vec<u32> {
    let mut words = vec![0, 0, 0, 0, 0, 0, list.len() as u32, TAKEN];
    words.resize(LIST_HEADER, 0);
    words.extend(list.iter().flat_map(|entry| [entry.slot, entry.sample]));
    words.resize(LIST_HEADER + 2 * slots as usize, 0);
    words
}

/// Number of the table's entries in such a list.
const TAKEN: u32 = 55;

fn list_of(words: &[u32]) -> Vec<ScheduledEntry> {
    let pairs = words[LIST_HEADER..].chunks_exact(2).take(words[6] as usize);
    pairs.map(|pair| ScheduledEntry { slot: pair[0], sample: pair[1] }).collect()
}

/// Memory with a table and the parameters of the passes.
fn memory_of(table: &Table, parameters: &RadianceCacheParameters) -> Memory {
    let mut memory = Memory::new();
    memory.bind(&["view"], &[View { eye: EYE, ..Default::default() }]);
    memory.bind(&["radiance_cache"], &[*parameters]);
    memory.bind(&["cache_update"], &[UPDATE]);
    memory.bind(&["cache_sweep"], &[CacheSweep::default()]);
    memory.bind(&["entry_counters"], &[0u32; 4]);
    memory.bind(&["traced_levels"], &[crate::gpu_scene::TracedLevels::ONE]);
    bind_table(&mut memory, table, "entry_", "earlier_hits");
    memory
}

/// Position of the eye, m.
const EYE: Vec3 = Vec3::new(3.0, -2.0, 0.5);

fn bind_table(memory: &mut Memory, table: &Table, prefix: &str, earlier: &str) {
    let name = |what: &str| format!("{prefix}{what}");
    let words: Vec<u32> =
        table.keys.chunks(4).zip(table.rgbe.chunks(4)).flat_map(|(keys, rgbe)| [keys, rgbe].concat()).collect();
    memory.bind(&[&name("words"), "read_words", "found_words"], &words);
    memory.bind(&[&name("hashes")], &table.hashes);
    memory.bind(&[&name("winners")], &table.votes);
    memory.bind(&[&name("votes")], &table.requested);
    memory.bind(&[&name("samples")], &table.samples);
    memory.bind(&[&name("light")], &table.light.concat());
    memory.bind(&[&name("hits")], &table.hits);
    memory.bind(&[earlier], &if table.earlier.is_empty() { vec![Vec4::ZERO] } else { table.earlier.concat() });
}

/// The table in memory, with as many levels and steps as `like`.
fn table_of(memory: &Memory, like: &Table) -> Table {
    let words: Vec<u32> = memory.get("entry_words");
    let half =
        |first: usize| words.chunks(8).flat_map(|bucket| bucket[first..first + 4].to_vec()).collect::<Vec<u32>>();
    let slots = words.len() / 2;
    let parts = |name: &str, count: usize| {
        let all: Vec<Vec4> = memory.get(name);
        all.chunks(slots).take(count).map(<[Vec4]>::to_vec).collect()
    };
    Table {
        keys: half(0),
        rgbe: half(4),
        hashes: memory.get("entry_hashes"),
        votes: memory.get("entry_winners"),
        requested: memory.get("entry_votes"),
        samples: memory.get("entry_samples"),
        light: parts("entry_light", like.light.len()),
        hits: memory.get("entry_hits"),
        earlier: parts("earlier_hits", like.earlier.len()),
    }
}

/// Data of an entry, independent of its slot.
#[derive(Debug, PartialEq)]
struct StoredEntry {
    hash: u32,
    rgbe: u32,
    vote: u32,
    requested: u32,
    sample: [u32; 4],
    /// Number of samples of each level.
    counts: Vec<f32>,
    /// Keys of the entries that it has hit, and reflectances.
    hits: Vec<[u32; 2]>,
}

/// The data of each key. An error if a lookup does not find a key in its slot.
fn kept(table: &Table) -> Result<BTreeMap<u32, (StoredEntry, Vec<Vec3>)>, String> {
    let mut all = BTreeMap::new();
    for slot in table.taken() {
        let (key, hash) = (table.keys[slot], table.hashes[slot]);
        if table.find(Entry { key, hash }) != Some(slot as u32) {
            return Err(format!("a lookup does not find the entry in slot {slot}"));
        }
        let EntrySample { p_world, triangle } = table.samples[slot];
        let [x, y, z] = bits(p_world.to_array());
        // One per sample; none with one bounce.
        let listed = if table.earlier.is_empty() { 0 } else { (table.light[0][slot].w as usize).min(LISTED) };
        // An edited shader may write any slot.
        let key_of = |slot: u32| table.keys.get(slot as usize).copied().unwrap_or(0);
        let hits = table.hits[slot][..listed].iter().map(|hit| [key_of(hit.slot), hit.reflectance]);
        let kept = StoredEntry {
            hash,
            rgbe: table.rgbe[slot],
            vote: table.votes[slot],
            requested: table.requested[slot],
            sample: [x, y, z, triangle],
            counts: table.light.iter().map(|light| light[slot].w).collect(),
            hits: hits.collect(),
        };
        let floats = table.light.iter().chain(&table.earlier).map(|light| light[slot].truncate()).collect();
        if all.insert(key, (kept, floats)).is_some() {
            return Err(format!("key {key} is there twice"));
        }
    }
    Ok(all)
}

/// Returns an error that names the first entry that differs.
fn same_tables(actual: &Table, expected: &Table) -> Compared {
    let (actual, expected) = (kept(actual)?, kept(expected)?);
    same("key", &actual.keys().collect::<Vec<_>>(), &expected.keys().collect::<Vec<_>>())?;
    for ((key, (actual, floats)), (expected, expected_floats)) in actual.iter().zip(expected.values()) {
        let is_close = |(actual, expected): (&Vec3, &Vec3)| {
            let is_close = |i: usize| (actual[i] - expected[i]).abs() <= TOLERANCE * expected[i].abs();
            actual == expected || (0..3).all(is_close)
        };
        if actual != expected || !floats.iter().zip(expected_floats).all(is_close) {
            return Err(format!("{key}: {actual:?}, {floats:?}, for {expected:?}, {expected_floats:?}"));
        }
    }
    Ok(())
}

/// Graphics cards trace both rays of an entry in one dispatch, and software adapters in two. Images are the same to the bit.
#[gpu_test]
fn gpu_rays_in_one_dispatch_are_those_in_two(gpu: &Gpu) {
    let scene = lanternfish_scene::generate::demo("cornell").unwrap();
    let [two, one] = [false, true].map(|shares| {
        SHARES_DISPATCH_IN_TESTS.set(Some(shares));
        let settings = Settings::direct_light().with_indirect(few_rays(Tracer::BVH)).with_shadows(Shadows::BVH);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let image = renderer.render(&uploaded, &scene.cameras[0], [32, 24]).unwrap();
        SHARES_DISPATCH_IN_TESTS.set(None);
        let labels: Vec<_> = image.report.passes.iter().map(|pass| pass.name.to_string()).collect();
        assert_eq!(labels.iter().any(|label| label == "radiance_cache/rays"), shares, "{labels:?}");
        image.radiance
    });
    assert!(one == two && one.iter().any(|texel| texel[1] > 0.1));
}

/// Few rays of every bounce, through this tracer.
fn few_rays(tracer: Tracer) -> Indirect {
    Sampled { diffuse_rays: 2, glossy_rays: 1, cache_samples: 4, tracer: tracer.into(), ..Sampled::default() }.into()
}
