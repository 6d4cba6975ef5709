//! World-space radiance cache: entries for voxels of space, each with the mean radiance that the surfaces there send.
//!
//! 1. Whoever has traced rays looks up the entries that they hit (`hashing.wesl`, `table.wesl`), and votes for one of the rays that hit each to say
//!    where the entry is sampled next (`vote.wesl`).
//! 2. Update: entries that are new, and a share of the others, or all for some frames after a change, get another sample (`schedule.wesl`): one light
//!    and the ray to it (`light.wesl`, `shadow.wesl`), which is added to a mean (`accumulate.wesl`); and, for more than one bounce, a ray whose hit is
//!    put into the entry's list (`trace.wesl`, `intersect.wesl`, `accumulate.wesl`).
//! 3. For more than one bounce entries read along their hit lists what others send (`propagate.wesl`).
//! 4. Whoever has traced rays reads what the entries send: where nothing has changed for long, when they are looked up, of all that have samples
//!    (`rgbe.wesl`).
//! 5. Entries that nothing requests any more are evicted now and then (`rehash.wesl`).
//!
//! `reference/` says in plain Rust what the shaders decide; `tests/` compares them.

mod bounces;
mod growth;
mod parameters;
mod planes;
mod reading;
#[cfg(test)]
mod reference;
mod table;
#[cfg(test)]
mod tests;
mod update;

use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Feature, Frame, Growth, SharedStruct};

pub use self::bounces::Bounces;
#[cfg(any(test, feature = "testing"))]
pub(crate) use self::growth::FIRST_ENTRIES_IN_TESTS;
pub(crate) use self::parameters::{CacheUpdate, RadianceCacheParameters};
use self::{
    growth::{CELLS, COUNTERS, first_entries, slots_for},
    parameters::{CacheSweep, EntrySample, Link, SampledEntry, ScheduledEntry},
    planes::{Planes, TrianglePlane},
    reading::Readers,
    table::{Change, Rehash, Slots, Table},
};
use super::{Counters, history::RESET_FRAMES};
use crate::{
    common::workgroups,
    context::ViewContext,
    environment_light::ENVIRONMENT,
    error::RenderError,
    rays::Structure,
    rays::{self, TracePass, Tracer},
    shaders::{Root, Shaders},
};

/// What a hit sends is wanted for all sides together.
const EVENLY_SENT: Feature = Feature::new("evenly_sent");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::new("indirect/radiance_cache/planes"),
        Root::new("indirect/radiance_cache/schedule"),
        Root::of("indirect/radiance_cache/light", &[&[&[EVENLY_SENT], &[EVENLY_SENT, ENVIRONMENT]]]),
        Root::computed("indirect/radiance_cache/shadow", rays::exact_tracers),
        Root::computed("indirect/radiance_cache/trace", || rays::every_tracer(true)),
        Root::new("indirect/radiance_cache/intersect"),
        Root::new("indirect/radiance_cache/accumulate"),
        Root::new("indirect/radiance_cache/propagate"),
        Root::new("indirect/radiance_cache/rehash"),
    ],
    &[
        SharedStruct::of::<RadianceCacheParameters>(),
        SharedStruct::of::<CacheUpdate>(),
        SharedStruct::of::<CacheSweep>(),
        SharedStruct::of::<TrianglePlane>(),
        SharedStruct::of::<EntrySample>(),
        SharedStruct::of::<SampledEntry>(),
        SharedStruct::of::<ScheduledEntry>(),
        SharedStruct::of::<Link>(),
    ],
);

/// Smallest entries' edges up to which entries are as small.
const NEAR_EDGES: f32 = 128.0;
/// One of so many entries gets another sample in a frame, but within the reset window all do. In images that are waited for, so do
/// those that pixels see, where there is more than one bounce: what their rays find is noisier than what lights send them. Those of which much is
/// known get one in every second or fourth frame then: `schedule.wesl`.
const FRACTION: u32 = 8;
const _: () = assert!(FRACTION.is_power_of_two());
/// Samples that an entry of generation 0 gets at least in the frame that it is new in.
const FEWEST: u32 = 4;
/// From this sample on each counts as much as that one.
const MOST: f32 = 128.0;
/// Samples that what is known counts for while the scene changes again and again: an entry is the mean of three or four.
const REMEMBERED: f32 = 3.0;
/// Where nothing changes it counts for as many as there were.
const ALL: f32 = f32::MAX;
/// After a change that comes alone it counts for nothing.
const NONE: f32 = 0.0;
/// Frames that an entry is kept for which nothing asks: in every eighth rays ask for it, one of each pixel.
const KEPT: u32 = 128;
/// The entries, and the passes that update them.
#[derive(Debug)]
pub(crate) struct RadianceCache {
    bounces: Bounces,
    /// Slots of the table, a power of two: it grows.
    slots: u32,
    /// Entries that it has room for at most.
    most_entries: u32,
    /// A frame has ended with a table of so many.
    was_large_enough: bool,
    /// Samples of an entry of rank 0 in an image's first frame.
    first_samples: u32,
    /// See [`CacheSettings::blur`].
    blur: f32,
    kernels: Kernels,
    rehash: Rehash,
    planes: Planes,
    table: Option<Table>,
    /// Updates so far, and frames: a view each.
    update: u32,
    frame: u32,
    /// Frames so far in which what was known counted for few samples.
    changes: u32,
}

#[derive(Debug)]
struct Kernels {
    clear: ComputeKernel,
    choose: ComputeKernel,
    choose_again: ComputeKernel,
    measure: ComputeKernel,
    light: ComputeKernel,
    light_environment: ComputeKernel,
    shadow: ComputeKernel,
    trace: TracePass,
    intersect: ComputeKernel,
    scatter: ComputeKernel,
    store_hits: ComputeKernel,
    accumulate: ComputeKernel,
    propagate: ComputeKernel,
    propagate_scheduled: ComputeKernel,
    copy_back: ComputeKernel,
    pack: ComputeKernel,
    pack_scheduled: ComputeKernel,
}

/// What the cache is made for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CacheSettings {
    pub bounces: Bounces,
    /// Entries that there is room for at most.
    pub most_entries: u32,
    /// Samples of an entry of rank 0 in an image's first frame.
    pub first_samples: u32,
    /// Of entries' rays.
    pub tracer: Tracer,
    /// Roughness of the surface that would see as much of the environment at once as one of [`RadianceCache::MOST_SAMPLES`] stands for.
    pub blur: f32,
}

/// What one frame needs of the cache, for its rays.
#[derive(Debug)]
pub(crate) struct CacheOfFrame {
    parameters: RadianceCacheParameters,
    /// The next update.
    update: CacheUpdate,
    /// All entries are.
    is_new: bool,
    /// Nothing has changed for long: what entries have kept so far is as good as what a frame adds.
    is_steady: bool,
    /// The frame may start over with a larger table: it waits, and nothing has read the table before.
    may_start_over: bool,
    readers: Readers,
    /// What passes are told of the frame, and of its first update.
    uniforms: [BufferPart; 2],
    slots: Slots,
    planes: wgpu::Buffer,
    /// Of an update: which entries are due, and were before; what is found of each, workgroups for all of them.
    scratch: [wgpu::Buffer; 4],
    /// What is counted.
    pub counters: Counters,
}

impl CacheOfFrame {
    /// Samples that an entry of generation 0 gets in the frame that all entries are new in; `None` in others.
    pub fn first_samples(&self) -> Option<u32> {
        self.is_new.then_some(self.parameters.fewest)
    }

    /// One of so many entries gets another sample in the frame's first update, whatever it has; 0: none.
    pub fn fraction(&self) -> u32 {
        self.update.fraction
    }

    /// Slots of the table.
    pub fn slots(&self) -> u32 {
        self.slots.count
    }

    /// Whether what entries have kept so far may be read before the frame's update: nothing has changed for long.
    pub fn is_steady(&self) -> bool {
        self.is_steady
    }

    /// Bindings of the table, and of what passes are told of the frame.
    fn told(&self) -> Bindings<'_> {
        self.slots.bindings().part("radiance_cache", &self.uniforms[0])
    }

    /// Bindings by which entries are looked up, put in, asked for, counted and read.
    pub fn bindings(&self) -> Bindings<'_> {
        self.told()
            .part("cache_update", &self.uniforms[1])
            .buffer("entry_counters", self.counters.buffer())
            .buffer("triangle_planes", &self.planes)
    }
}

/// Updates that are counted before the rounds of a view, of which there are [`FEWEST`], an even number, in each of its parts. So that all views of a
/// frame, however many, count for an odd number of updates: the number of the update, modulo 2, 4 or 8, says which entries get a sample without being
/// new, in the first round of each view, by 2 and 4 of the first view alone, and moves through all of these from frame to frame.
fn first_updates(is_first_view: bool) -> u32 {
    if is_first_view { 1 } else { 2 }
}

#[cfg(test)]
#[test]
fn every_cell_gets_its_turn() {
    for (views, parts) in [(1, 1), (1, 3), (2, 1), (2, 2), (3, 1), (4, 5)] {
        let of_frame: u32 = (0..views).map(|view| first_updates(view == 0) + parts * FEWEST).sum();
        for fraction in [2, 4, FRACTION, 128] {
            let mut sweeps: Vec<u32> = (0..fraction).map(|frame| frame * of_frame % fraction).collect();
            sweeps.sort_unstable();
            assert_eq!(sweeps, (0..fraction).collect::<Vec<_>>(), "{views} views in {parts} parts");
        }
    }
}

impl RadianceCache {
    /// Hits that an entry lists.
    pub const LISTED: u32 = table::HITS;

    /// From this sample on each counts as much as that one.
    pub const MOST_SAMPLES: u32 = MOST as u32;

    /// Compiles the passes. `exact`: of rays to lights.
    pub fn new(
        device: &wgpu::Device,
        settings: CacheSettings,
        exact: Tracer,
        structure: &Structure,
    ) -> Result<Self, RenderError> {
        let CacheSettings { bounces, most_entries, first_samples, tracer, blur } = settings;
        let kernel = |file: &str, features: &[Feature], entry: &str| {
            let shader = DECLARED.link(&format!("indirect/radiance_cache/{file}"), features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &format!("radiance_cache/{entry}")))
        };
        let kernels = Kernels {
            clear: kernel("schedule", &[], "clear")?,
            choose: kernel("schedule", &[], "choose")?,
            choose_again: kernel("schedule", &[], "choose_again")?,
            measure: kernel("schedule", &[], "measure")?,
            light: kernel("light", &[EVENLY_SENT], "light")?,
            light_environment: kernel("light", &[EVENLY_SENT, ENVIRONMENT], "light")?,
            shadow: kernel("shadow", &exact.features(structure, true), "shadow")?,
            trace: TracePass::new(tracer, kernel("trace", &tracer.features(structure, true), "trace")?),
            intersect: kernel("intersect", &[], "intersect")?,
            scatter: kernel("intersect", &[], "scatter")?,
            store_hits: kernel("accumulate", &[], "store_hits")?,
            accumulate: kernel("accumulate", &[], "accumulate")?,
            propagate: kernel("propagate", &[], "propagate")?,
            propagate_scheduled: kernel("propagate", &[], "propagate_scheduled")?,
            copy_back: kernel("propagate", &[], "copy_back")?,
            pack: kernel("propagate", &[], "pack")?,
            pack_scheduled: kernel("propagate", &[], "pack_scheduled")?,
        };
        Ok(Self {
            bounces,
            slots: slots_for(most_entries.min(first_entries())),
            most_entries,
            blur,
            was_large_enough: false,
            first_samples,
            kernels,
            rehash: Rehash::new(device)?,
            planes: Planes::new(device)?,
            table: None,
            update: 0,
            frame: 0,
            changes: 0,
        })
    }

    /// Forgets all entries.
    pub fn forget(&mut self) {
        self.table = None;
        self.planes.forget();
        self.was_large_enough = false;
    }

    /// The entries as this view's rays find them. An image for which frames wait starts without any, so that it is the same whatever was
    /// rendered before it.
    pub fn begin(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, view, .. }: &ViewContext<'_>,
    ) -> Result<CacheOfFrame, RenderError> {
        let waits = frame.growth() == Growth::Blocking;
        let is_first = waits && view.random_index == 0;
        let number = frame.number();
        let room = frame.planned_capacity(CELLS, 0, slots_for(self.most_entries).into());
        self.slots = self.slots.max(slots_for((room as u32).min(self.most_entries)));
        let table = match &mut self.table {
            Some(table) => table,
            none => {
                frame.forget_bind_groups();
                (self.update, self.frame, self.changes) = (0, 0, 0);
                none.insert(Table::new(frame, scene, self.slots, self.bounces)?)
            }
        };
        let is_first_view = std::mem::replace(&mut table.used_in, number) != number;
        if !table.is_of(scene) || (is_first && is_first_view) {
            table.begin(frame, scene);
            (self.update, self.frame, self.changes) = (0, 0, 0);
        }
        let is_new = is_first || self.frame == 0;
        self.update += first_updates(is_first_view);
        self.frame += 1;
        let change = match table.follow(scene, is_first_view) {
            // Entries know little yet.
            Change::Alone if self.frame <= RESET_FRAMES => Change::Ongoing,
            change => change,
        };
        let has_changed = matches!(change, Change::Ongoing | Change::Alone);
        self.changes += u32::from(has_changed);
        // One view of a frame will do.
        let is_in_reset = change != Change::Long && is_first_view;
        let parameters = RadianceCacheParameters {
            slot_mask: self.slots - 1,
            edge: table.edge,
            near: NEAR_EDGES * table.edge,
            most_fraction: if is_in_reset { 1 } else { FRACTION },
            fewest: if is_new { self.first_samples } else { FEWEST },
            most: MOST,
            kept: KEPT,
            blur: self.blur,
            frame: self.frame,
            changes: self.changes,
            bounce_levels: self.bounces.levels(),
            first_level: self.bounces.first_level(),
            earlier_steps: self.bounces.earlier_steps(),
            ..Default::default()
        };
        let update = CacheUpdate {
            update: self.update,
            fraction: if is_new {
                0
            } else if is_in_reset || (waits && is_first_view && self.bounces.needs_rays()) {
                1
            } else {
                FRACTION
            },
            remembered: match change {
                Change::Alone => NONE,
                Change::Ongoing => REMEMBERED,
                Change::Recent | Change::Long => ALL,
            },
            ages: u32::from(!is_new),
            ..Default::default()
        };
        self.rehash.record(frame, table, &parameters)?;
        let uniforms = [frame.uniform(&parameters), frame.uniform(&update)];
        let is_steady = change == Change::Long && !is_new;
        let was_packed = std::mem::replace(&mut table.is_packed, is_steady);
        if is_steady && !was_packed {
            let bindings = table.slots.bindings().part("radiance_cache", &uniforms[0]);
            frame.dispatch(&self.kernels.pack, &bindings, workgroups(self.slots));
        }
        let counters = Counters::new(frame, "radiance_cache/counters", 1, COUNTERS)?;
        let bytes = size_of::<SampledEntry>() as u64 * u64::from(self.slots);
        let bytes_scheduled = 4 + size_of::<ScheduledEntry>() as u64 * u64::from(self.slots);
        let scratch = [
            frame.scratch("radiance_cache/scheduled", bytes_scheduled)?,
            frame.scratch("radiance_cache/scheduled_before", bytes_scheduled)?,
            frame.scratch("radiance_cache/sampled", bytes)?,
            frame.indirect("radiance_cache/workgroups")?,
        ];
        Ok(CacheOfFrame {
            uniforms,
            parameters,
            update,
            is_new,
            is_steady,
            may_start_over: is_first && is_first_view,
            readers: Readers::of(is_new, is_first_view.then_some(change)),
            slots: table.slots.clone(),
            planes: self.planes.of(frame, scene)?,
            scratch,
            counters,
        })
    }
}
