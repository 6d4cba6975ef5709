//! The hash table of entries of one scene, kept from frame to frame.

use super::DECLARED;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, gpu_constants, storage_buffer};

use super::{
    Bounces,
    parameters::{EntrySample, Link, RadianceCacheParameters},
};
use crate::{common::workgroups, denoise::history::RESET_FRAMES, error::RenderError, gpu_scene::GpuScene};

/// Entries along the diagonal of the scene's bounds: about the resolution of deep images at default settings.
const ENTRIES_ALONG: f32 = 128.0;

gpu_constants! {
    /// Capacity of an entry's hit list, newest first.
    pub(super) const HITS: u32 = 16;
}

/// The buffers of a table, one element per slot.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// Number of slots, a power of two.
    pub count: u32,
    /// Keys and packed outgoing radiance: `table.wesl`. Bound as atomics, as words, and as vectors of four words.
    words: wgpu::Buffer,
    hashes: wgpu::Buffer,
    winners: wgpu::Buffer,
    requested: wgpu::Buffer,
    samples: wgpu::Buffer,
    light: wgpu::Buffer,
    hits: wgpu::Buffer,
    earlier: wgpu::Buffer,
}

impl Slots {
    fn new(device: &wgpu::Device, count: u32, bounces: Bounces) -> Result<Self, RenderError> {
        let buffer = |name: &str, bytes: usize| {
            storage_buffer(device, &format!("radiance_cache/{name}"), bytes as u64 * u64::from(count))
        };
        // One bounce needs neither hit lists nor means of earlier hits.
        let earlier = (16 * u64::from(bounces.earlier_steps()) * u64::from(count)).max(16);
        let hits = if bounces.needs_rays() { u64::from(HITS) * u64::from(count) } else { 1 };
        Ok(Self {
            count,
            words: buffer("words", 8)?,
            hashes: buffer("hashes", 4)?,
            winners: buffer("winners", 4)?,
            requested: buffer("requested", 4)?,
            samples: buffer("samples", size_of::<EntrySample>())?,
            light: buffer("light", 16 * (1 + bounces.levels() + bounces.known_lights()) as usize)?,
            hits: storage_buffer(device, "radiance_cache/links", hits * size_of::<Link>() as u64)?,
            earlier: storage_buffer(device, "radiance_cache/earlier", earlier)?,
        })
    }

    /// Removes all entries.
    fn clear(&self, frame: &mut Frame<'_>) {
        for buffer in [&self.words, &self.winners, &self.samples, &self.light] {
            frame.encoder().clear_buffer(buffer, 0, None);
        }
    }

    /// Bindings to look up, insert, vote for and read entries.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .buffer("entry_words", &self.words)
            .buffer("read_words", &self.words)
            .buffer("found_words", &self.words)
            .buffer("entry_hashes", &self.hashes)
            .buffer("entry_winners", &self.winners)
            .buffer("entry_votes", &self.requested)
            .buffer("entry_samples", &self.samples)
            .buffer("entry_light", &self.light)
            .buffer("entry_hits", &self.hits)
            .buffer("earlier_hits", &self.earlier)
    }
}

/// The entries of a scene: the table in use, and one of the same size to which entries migrate periodically.
#[derive(Debug)]
pub(super) struct Table {
    /// [`GpuScene::triangle_order`] of the scene.
    order: u64,
    /// Number of the last frame that used it.
    pub used_in: u64,
    /// [`GpuScene::generation`] and [`GpuScene::revision`] at the last lookup.
    state: [u64; 2],
    /// Frames since the last change of `state`; `u32::MAX`: none.
    since_change: u32,
    /// Edge of the smallest entries, m.
    pub edge: f32,
    pub slots: Slots,
    /// A frame has been completed with so many slots.
    pub was_large_enough: bool,
    /// The lights as they were at a [`GpuScene::revision`], and space for them as they are: `follow.wesl`.
    pub lights: Option<(wgpu::Buffer, u64)>,
    /// The packed outgoing radiance (`rgbe.wesl`) is up to date.
    pub is_packed: bool,
    /// The other table, after the first migration.
    other: Option<Slots>,
    bounces: Bounces,
    /// The frame before which entries last migrated.
    moved_at: u32,
}

/// Change of a scene since the last lookup of its entries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    /// No change, and the reset window is over.
    Long,
    /// No change, but within the reset window of an earlier one.
    Recent,
    /// A change within the reset window of an earlier one.
    Ongoing,
    /// A single change, outside of a reset window.
    Alone,
}

impl Table {
    /// Creates an empty table with so many slots.
    pub fn new(frame: &Frame<'_>, scene: &GpuScene, slots: u32, bounces: Bounces) -> Result<Self, RenderError> {
        Ok(Self {
            order: scene.triangle_order(),
            used_in: 0,
            state: [scene.generation(), scene.revision()],
            since_change: u32::MAX,
            edge: edge_in(scene),
            slots: Slots::new(frame.device, slots, bounces)?,
            was_large_enough: false,
            lights: None,
            is_packed: false,
            other: None,
            bounces,
            moved_at: 0,
        })
    }

    /// True if its entries belong to this scene.
    pub fn is_of(&self, scene: &GpuScene) -> bool {
        self.order == scene.triangle_order()
    }

    /// The change of the scene. Called once per view. `is_first_view`: it is the first view of its frame.
    pub fn follow(&mut self, scene: &GpuScene, is_first_view: bool) -> Change {
        let state = [scene.generation(), scene.revision()];
        if std::mem::replace(&mut self.state, state) != state {
            let before = std::mem::replace(&mut self.since_change, 0);
            return if before < RESET_FRAMES { Change::Ongoing } else { Change::Alone };
        }
        if is_first_view {
            self.since_change = self.since_change.saturating_add(1);
        }
        if self.since_change < RESET_FRAMES { Change::Recent } else { Change::Long }
    }

    /// Removes all entries, for a new image of this scene.
    pub fn begin(&mut self, frame: &mut Frame<'_>, scene: &GpuScene) {
        self.slots.clear(frame);
        self.order = scene.triangle_order();
        self.state = [scene.generation(), scene.revision()];
        self.since_change = u32::MAX;
        self.edge = edge_in(scene);
        self.moved_at = 0;
        self.is_packed = false;
    }
}

/// Edge of the smallest entries, m.
fn edge_in(scene: &GpuScene) -> f32 {
    (scene.bounds.size().length() / ENTRIES_ALONG).max(1e-6)
}

/// The passes that migrate entries to another table.
#[derive(Debug)]
pub(super) struct Rehash {
    rehash: ComputeKernel,
    migrate: ComputeKernel,
    migrate_hits: ComputeKernel,
}

impl Rehash {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let none: &[Feature] = &[];
        let shader = DECLARED.link("indirect/radiance_cache/rehash", none)?;
        let kernel = |entry: &str| ComputeKernel::new(device, &shader, entry, &format!("radiance_cache/{entry}"));
        Ok(Self { rehash: kernel("rehash"), migrate: kernel("migrate"), migrate_hits: kernel("migrate_hits") })
    }

    /// Migrates the entries to a larger table if `parameters` have more slots. Every `kept` frames, migrates them to
    /// another table of the same size and evicts those that were not requested for that long.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        table: &mut Table,
        parameters: &RadianceCacheParameters,
    ) -> Result<(), RenderError> {
        let count = parameters.slot_mask + 1;
        let grows = count != table.slots.count;
        let evicts = parameters.frame - table.moved_at >= parameters.kept;
        if !grows && !evicts {
            return Ok(());
        }
        // Growth alone evicts no entries, so that eviction does not depend on when the table grows.
        let kept = if evicts { parameters.kept } else { u32::MAX };
        if evicts {
            table.moved_at = parameters.frame;
        }
        let new = match table.other.take().filter(|other| other.count == count) {
            Some(other) => other,
            None => {
                // Bind groups keep the old buffers alive.
                frame.forget_bind_groups();
                Slots::new(frame.device, count, table.bounces)?
            }
        };
        new.clear(frame);
        let old = std::mem::replace(&mut table.slots, new);
        table.is_packed = false;
        let moved_to = frame.scratch("radiance_cache/moved_to", 4 * u64::from(old.count))?;
        let uniform = frame.uniform(&RadianceCacheParameters { kept, ..*parameters });
        let bindings = table
            .slots
            .bindings()
            .part("radiance_cache", &uniform)
            .buffer("moved_to", &moved_to)
            .buffer("old_words", &old.words)
            .buffer("old_hashes", &old.hashes)
            .buffer("old_votes", &old.requested)
            .buffer("old_samples", &old.samples)
            .buffer("old_light", &old.light)
            .buffer("old_hits", &old.hits)
            .buffer("old_earlier", &old.earlier);
        frame.dispatch(&self.rehash, &bindings, workgroups(old.count));
        frame.dispatch(&self.migrate, &bindings, workgroups(old.count));
        frame.dispatch(&self.migrate_hits, &bindings, workgroups(old.count));
        table.other = (!grows).then_some(old);
        Ok(())
    }
}
