//! World-space radiance cache: one entry per voxel and facing direction, with the mean outgoing radiance of the
//! surfaces there.
//!
//! 1. Passes that trace rays look up the entries that the rays hit (`hashing.wesl`, `table.wesl`). The rays vote for
//!    the hit at which the entry is sampled next (`vote.wesl`).
//! 2. Update: new entries and a fraction of the others, or all for some frames after a change, get another sample
//!    (`schedule.wesl`). The light of one light source, with a shadow ray, is added to a mean (`light.wesl`,
//!    `shadow.wesl`, `accumulate.wesl`). With more than one bounce, a further ray is traced and its hit is appended to
//!    the entry's hit list (`trace.wesl`, `rays.wesl`, `intersect.wesl`).
//! 3. Propagation, with more than one bounce: entries read the outgoing radiance of the entries in their hit lists
//!    (`propagate.wesl`).
//! 4. Passes that trace rays read the entries' outgoing radiance. If nothing has changed for long, they do so at
//!    lookup, for all entries with samples (`rgbe.wesl`).
//! 5. Entries that are no longer requested are evicted periodically (`rehash.wesl`).
//!
//! `reference/` is the CPU reference of the shaders; `tests/` compares both.

pub mod bounces;
mod follow;
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

use lanternfish_gpu::{AcrossFrames, Bindings, BufferPart, ComputeKernel, Feature, Frame, Growth, SharedStruct};

pub use self::bounces::Bounces;
#[cfg(any(test, feature = "testing"))]
pub(crate) use self::growth::FIRST_ENTRIES_IN_TESTS;
pub(crate) use self::parameters::{CacheUpdate, RadianceCacheParameters};
use self::{
    growth::{COUNTERS, ENTRIES_LIST, first_entries, slots_for},
    parameters::{CacheSweep, EntrySample, Link, SampledEntry, ScheduledEntry},
    planes::{Planes, TrianglePlane},
    reading::Readers,
    table::{Change, Rehash, Slots, Table},
};
use crate::denoise::{Counters, history::RESET_FRAMES};
use crate::{
    context::ViewContext,
    environment_light::ENVIRONMENT,
    error::RenderError,
    rays::Structure,
    rays::{self, SceneKernel, TracePass, Tracer},
    shaders::{Root, Shaders},
};

/// Outgoing radiance at a hit is averaged over all directions.
const EVENLY_SENT: Feature = Feature::new("evenly_sent");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::new("indirect/radiance_cache/planes"),
        Root::new("indirect/radiance_cache/schedule"),
        Root::of(
            "indirect/radiance_cache/light",
            &[&[&[EVENLY_SENT], &[EVENLY_SENT, ENVIRONMENT]], &[&[], &[rays::IN_LEVELS]]],
        ),
        Root::computed("indirect/radiance_cache/shadow", rays::exact_in_scenes),
        Root::computed("indirect/radiance_cache/trace", || rays::every_tracer(true)),
        Root::computed("indirect/radiance_cache/rays", rays::exact_in_scenes),
        Root::of("indirect/radiance_cache/intersect", &[&[&[], &[rays::IN_LEVELS]]]),
        Root::new("indirect/radiance_cache/accumulate"),
        Root::of("indirect/radiance_cache/follow", &[&[&[], &[rays::IN_LEVELS]]]),
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

/// Distance from the eye up to which voxels have the smallest edge, in units of that edge.
const NEAR_EDGES: f32 = 128.0;
/// Update stride: each frame updates 1/8 of the entries, and all of them in the reset window after a scene change. In
/// images with blocking readback and more than one bounce, each frame also updates all visible entries: light from
/// other entries is noisier than light from light sources. Of these, entries with a long history get a sample in every
/// second or fourth frame: `schedule.wesl`.
const FRACTION: u32 = 8;
const _: () = assert!(FRACTION.is_power_of_two());
/// Least number of samples of an entry of rank 0 in its first frame; most in a later frame.
pub const FEWEST: u32 = 4;
/// Least number of samples of an entry of rank 0 in its first frame, if the frame has a [`BUDGET`].
const FEWEST_IN_BUDGET: u32 = 2;
/// Longest history of an entry, samples: later samples all have the same weight.
const MOST: f32 = 128.0;
/// History length, samples, while the scene keeps changing. More: less noise, but light of lamps that come on, of moved
/// surfaces and of the environment lags longer.
const REMEMBERED: f32 = 5.0;
/// The same if entries do not know which lights light them: with a limited number of bounces.
const REMEMBERED_UNFOLLOWED: f32 = 3.0;
/// History length in an unchanged scene: not limited.
const ALL: f32 = f32::MAX;
/// History length after a single change: the history is discarded.
const NONE: f32 = 0.0;
/// Samples of a frame while the scene changes, and in the reset window after that.
const BUDGET: u32 = 32_000;
/// Size of `ScheduledEntries` of `bindings.wesl` before its entries, bytes.
const LIST_HEADER_BYTES: u64 = 64;
/// Frames after which an entry that is not requested is evicted. Rays vote for an entry in every eighth frame, with at
/// most one vote per pixel.
const KEPT: u32 = 128;

/// The entries, and the passes that update them.
#[derive(Debug)]
pub(crate) struct RadianceCache {
    bounces: Bounces,
    /// Slots of the table, a power of two: it grows.
    slots: u32,
    /// Largest capacity, entries.
    most_entries: u32,
    /// Samples of an entry of rank 0 in an image's first frame.
    first_samples: u32,
    /// See [`CacheSettings::blur`].
    blur: f32,
    kernels: Kernels,
    rehash: Rehash,
    planes: Planes,
    table: AcrossFrames<Option<Table>>,
    /// Updates and frames so far; each view counts as a frame.
    update: u32,
    frame: u32,
    /// Number of frames so far in which the history was cut.
    changes: u32,
}

#[derive(Debug)]
struct Kernels {
    classify: ComputeKernel,
    choose: ComputeKernel,
    choose_again: ComputeKernel,
    light: ComputeKernel,
    light_environment: ComputeKernel,
    rays: Rays,
    intersect: ComputeKernel,
    store_hits: ComputeKernel,
    accumulate: ComputeKernel,
    follow: ComputeKernel,
    propagate: ComputeKernel,
    propagate_scheduled: ComputeKernel,
    pack: ComputeKernel,
    pack_scheduled: ComputeKernel,
}

#[cfg(test)]
thread_local! {
    /// Replaces [`shares_dispatch`] in tests.
    static SHARES_DISPATCH_IN_TESTS: std::cell::Cell<Option<bool>> = const { std::cell::Cell::new(None) };
}

/// True if both rays of entries are traced in one dispatch. A graphics card waits less often for the longest ray;
/// Mesa's software adapter takes 1.4 times as long for the same rays.
fn shares_dispatch(device: &wgpu::Device) -> bool {
    #[cfg(test)]
    if let Some(shares) = SHARES_DISPATCH_IN_TESTS.get() {
        return shares;
    }
    device.adapter_info().device_type != wgpu::DeviceType::Cpu
}

/// The passes that trace the rays of scheduled entries.
#[derive(Debug)]
enum Rays {
    /// Shadow rays alone.
    Shadow(SceneKernel),
    /// Shadow rays, and rays towards other entries, through one tracer.
    Both(SceneKernel),
    /// The same through two tracers.
    Each(SceneKernel, TracePass),
}

/// Parameters of the cache.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CacheSettings {
    pub bounces: Bounces,
    /// Largest capacity, entries.
    pub most_entries: u32,
    /// Samples of an entry of rank 0 in an image's first frame.
    pub first_samples: u32,
    /// Tracer of the entries' rays.
    pub tracer: Tracer,
    /// Roughness whose lobe covers the solid angle that one of [`RadianceCache::MOST_SAMPLES`] samples represents; it
    /// prefilters the environment.
    pub blur: f32,
}

/// State of the cache for the rays of one frame.
#[derive(Debug)]
pub(crate) struct CacheOfFrame {
    parameters: RadianceCacheParameters,
    /// The next update.
    update: CacheUpdate,
    /// All entries are new.
    is_new: bool,
    /// Nothing has changed for long: the stored radiance is as good as that after the frame's update.
    is_accumulated: bool,
    /// The frame may start over with a larger table: its readback is blocking, and nothing has read the table before.
    may_start_over: bool,
    readers: Readers,
    /// Parameters of the frame, and of its first update.
    uniforms: [BufferPart; 2],
    slots: Slots,
    planes: wgpu::Buffer,
    /// The scheduled entries and the previously scheduled ones, which take turns; the next list to be built, the second
    /// one, is empty.
    lists: [wgpu::Buffer; 2],
    /// Samples of scheduled entries.
    sampled: wgpu::Buffer,
    /// Counters of the cache.
    pub counters: Counters,
}

impl CacheOfFrame {
    /// Samples of an entry of rank 0 in a frame in which all entries are new; `None` in other frames.
    pub fn first_samples(&self) -> Option<u32> {
        self.is_new.then_some(self.parameters.fewest)
    }

    /// True if an image starts with this view, without entries.
    pub fn starts_image(&self) -> bool {
        self.may_start_over
    }

    /// Update stride of the frame's first update: of the existing entries 1 in so many gets a sample; 0: none.
    pub fn fraction(&self) -> u32 {
        self.update.fraction
    }

    /// Slots of the table.
    pub fn slots(&self) -> u32 {
        self.slots.count
    }

    /// True if the stored radiance may be read before the frame's update, since nothing has changed for long.
    pub fn is_accumulated(&self) -> bool {
        self.is_accumulated
    }

    /// Bindings of the table and of the frame's parameters.
    fn frame_bindings(&self) -> Bindings<'_> {
        self.slots.bindings().part("radiance_cache", &self.uniforms[0])
    }

    /// Bindings to look up, insert, vote for, count and read entries.
    pub fn bindings(&self) -> Bindings<'_> {
        self.frame_bindings()
            .part("cache_update", &self.uniforms[1])
            .buffer("entry_counters", self.counters.buffer())
            .buffer("triangle_planes", &self.planes)
    }
}

/// Increment of the update number before the samples of a view. Each part of a view takes [`FEWEST`] updates, an even
/// number; with this increment, all views of a frame together take an odd number. The update number, modulo the update
/// stride of 2, 4 or 8, selects the existing entries that get a sample at the first sample index of each view (for 2
/// and 4: of the first view only). An odd increment per frame visits all residues.
fn first_updates(is_first_view: bool) -> u32 {
    if is_first_view { 1 } else { 2 }
}

#[cfg(test)]
#[test]
fn every_entry_is_scheduled() {
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
    /// Capacity of an entry's hit list.
    pub const LISTED: u32 = table::HITS;

    /// Longest history of an entry, samples: later samples all have the same weight.
    pub const MOST_SAMPLES: u32 = MOST as u32;

    /// Compiles the passes. `exact`: tracer of shadow rays.
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
        let of_shadows = exact.features(structure, true);
        let of_scene = |entry: &'static str| {
            let (module, label) = (format!("indirect/radiance_cache/{entry}"), format!("radiance_cache/{entry}"));
            SceneKernel::new(device, DECLARED, &module, &of_shadows, entry, &label)
        };
        let rays = match bounces.needs_rays() {
            false => Rays::Shadow(of_scene("shadow")?),
            true if tracer == exact && shares_dispatch(device) => Rays::Both(of_scene("rays")?),
            true => Rays::Each(
                of_scene("shadow")?,
                TracePass::new(tracer, structure, kernel("trace", &tracer.features(structure, true), "trace")?),
            ),
        };
        let of_ids = tracer.features_of_ids();
        let kernels = Kernels {
            classify: kernel("schedule", &[], "classify")?,
            choose: kernel("schedule", &[], "choose")?,
            choose_again: kernel("schedule", &[], "choose_again")?,
            light: kernel("light", &[&[EVENLY_SENT], of_ids].concat(), "light")?,
            light_environment: kernel("light", &[&[EVENLY_SENT, ENVIRONMENT], of_ids].concat(), "light")?,
            rays,
            intersect: kernel("intersect", of_ids, "intersect")?,
            store_hits: kernel("intersect", of_ids, "store_hits")?,
            accumulate: kernel("accumulate", &[], "accumulate")?,
            follow: kernel("follow", of_ids, "follow")?,
            propagate: kernel("propagate", &[], "propagate")?,
            propagate_scheduled: kernel("propagate", &[], "propagate_scheduled")?,
            pack: kernel("propagate", &[], "pack")?,
            pack_scheduled: kernel("propagate", &[], "pack_scheduled")?,
        };
        Ok(Self {
            bounces,
            slots: slots_for(most_entries.min(first_entries())),
            most_entries,
            blur,
            first_samples,
            kernels,
            rehash: Rehash::new(device)?,
            planes: Planes::new(device)?,
            table: AcrossFrames::default(),
            update: 0,
            frame: 0,
            changes: 0,
        })
    }

    /// Prepares the cache for the rays of this view. An image with blocking readback starts without entries, so that it
    /// does not depend on what was rendered before.
    pub fn begin(
        &mut self,
        frame: &mut Frame<'_>,
        view_context: &ViewContext<'_>,
    ) -> Result<CacheOfFrame, RenderError> {
        let ViewContext { scene, view, .. } = view_context;
        let (Rays::Shadow(shadow) | Rays::Both(shadow) | Rays::Each(shadow, _)) = &self.kernels.rays;
        shadow.prepare(frame.device, scene)?;
        let waits = frame.growth() == Growth::Blocking;
        let is_first = waits && view.random_index == 0;
        let number = frame.number();
        let capacity = frame.planned_capacity(ENTRIES_LIST, 0, slots_for(self.most_entries).into());
        self.slots = self.slots.max(slots_for((capacity as u32).min(self.most_entries)));
        let table = match self.table.get(frame) {
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
            // The history of entries is short.
            Change::Alone if self.frame <= RESET_FRAMES => Change::Ongoing,
            change => change,
        };
        let has_changed = matches!(change, Change::Ongoing | Change::Alone);
        self.changes += u32::from(has_changed);
        // Once per frame is enough: in the first view.
        let is_in_reset = change != Change::Long && is_first_view;
        let parameters = RadianceCacheParameters {
            slot_mask: self.slots - 1,
            edge: table.edge,
            near: NEAR_EDGES * table.edge,
            most_fraction: if is_in_reset { 1 } else { FRACTION },
            fewest: match (is_new, change) {
                (true, _) => self.first_samples,
                // A mean goes on sampling: what few samples found would remain in it.
                (false, Change::Long) if waits && view.frame_index > 0 => {
                    (FEWEST * view.frame_index + self.first_samples).clamp(FEWEST, MOST as u32)
                }
                (false, Change::Ongoing | Change::Recent) => FEWEST_IN_BUDGET,
                _ => FEWEST,
            },
            most: MOST,
            kept: KEPT,
            blur: self.blur,
            frame: self.frame,
            changes: self.changes,
            bounce_levels: self.bounces.levels(),
            first_level: self.bounces.first_level(),
            earlier_steps: self.bounces.earlier_steps(),
            known_lights: self.bounces.known_lights(),
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
                Change::Ongoing if self.bounces == Bounces::All => REMEMBERED,
                Change::Ongoing => REMEMBERED_UNFOLLOWED,
                Change::Recent | Change::Long => ALL,
            },
            ages: u32::from(!is_new),
            counts: 0,
            budget: if matches!(change, Change::Ongoing | Change::Recent) && !is_new { BUDGET } else { 0 },
        };
        self.rehash.record(frame, table, &parameters)?;
        let uniforms = [frame.uniform(&parameters), frame.uniform(&update)];
        let planes = self.planes.of(frame, scene)?;
        let keeps_history = change == Change::Ongoing && self.bounces == Bounces::All;
        let follow = keeps_history.then_some(&self.kernels.follow);
        table.follow_lights(frame, view_context, follow, &uniforms[0], &planes)?;
        let is_accumulated = change == Change::Long && !is_new;
        let was_packed = std::mem::replace(&mut table.is_packed, is_accumulated);
        if is_accumulated && !was_packed {
            let bindings = table.slots.bindings().part("radiance_cache", &uniforms[0]);
            self.kernels.pack(frame, self.bounces, self.slots, bindings);
        }
        let counters = Counters::new(frame, "radiance_cache/counters", 1, COUNTERS)?;
        let bytes = size_of::<SampledEntry>() as u64 * u64::from(self.slots);
        let bytes_scheduled = LIST_HEADER_BYTES + size_of::<ScheduledEntry>() as u64 * u64::from(self.slots);
        let lists = [
            frame.zeroed("radiance_cache/scheduled", bytes_scheduled)?,
            frame.zeroed("radiance_cache/scheduled", bytes_scheduled)?,
        ];
        Ok(CacheOfFrame {
            uniforms,
            parameters,
            update,
            is_new,
            is_accumulated,
            may_start_over: is_first && is_first_view,
            readers: Readers::of(is_new, is_first_view.then_some(change)),
            slots: table.slots.clone(),
            planes,
            lists,
            sampled: frame.scratch("radiance_cache/sampled", bytes)?,
            counters,
        })
    }
}
