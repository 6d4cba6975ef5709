//! The entries of one scene, as they are kept from frame to frame.

use super::DECLARED;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, gpu_constants, storage_buffer};

use super::{
    Bounces,
    parameters::{EntrySample, Link, RadianceCacheParameters},
};
use crate::{common::workgroups, error::RenderError, gpu_scene::GpuScene, indirect::history::RESET_FRAMES};

/// Entries along the diagonal of the scene's bounds: about as fine as the texels of the usual deep images.
const ENTRIES_ALONG: f32 = 128.0;

gpu_constants! {
    /// Hits that an entry lists, the last one first.
    pub(super) const HITS: u32 = 16;
}

/// The buffers of a table, an element a slot.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// A power of two.
    pub count: u32,
    /// Keys, and what entries send, packed: `table.wesl`. Bound as atomic numbers, as numbers, and as four each.
    words: wgpu::Buffer,
    hashes: wgpu::Buffer,
    winners: wgpu::Buffer,
    requested: wgpu::Buffer,
    samples: wgpu::Buffer,
    light: wgpu::Buffer,
    links: wgpu::Buffer,
    earlier: wgpu::Buffer,
}

impl Slots {
    fn new(device: &wgpu::Device, count: u32, bounces: Bounces) -> Result<Self, RenderError> {
        let buffer = |name: &str, bytes: usize| {
            storage_buffer(device, &format!("radiance_cache/{name}"), bytes as u64 * u64::from(count))
        };
        // One bounce needs neither.
        let earlier = (16 * u64::from(bounces.earlier_steps()) * u64::from(count)).max(16);
        let links = if bounces.needs_rays() { u64::from(HITS) * u64::from(count) } else { 1 };
        Ok(Self {
            count,
            words: buffer("words", 8)?,
            hashes: buffer("hashes", 4)?,
            winners: buffer("winners", 4)?,
            requested: buffer("requested", 4)?,
            samples: buffer("samples", size_of::<EntrySample>())?,
            light: buffer("light", 16 * (1 + bounces.levels() as usize))?,
            links: storage_buffer(device, "radiance_cache/links", links * size_of::<Link>() as u64)?,
            earlier: storage_buffer(device, "radiance_cache/earlier", earlier)?,
        })
    }

    /// No entries.
    fn clear(&self, frame: &mut Frame<'_>) {
        for buffer in [&self.words, &self.winners, &self.samples, &self.light] {
            frame.encoder().clear_buffer(buffer, 0, None);
        }
    }

    /// Bindings by which entries are looked up, put in, asked for and read.
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
            .buffer("entry_hits", &self.links)
            .buffer("earlier_hits", &self.earlier)
    }
}

/// The entries of a scene: one table in use, and one of the same size that entries move to now and then.
#[derive(Debug)]
pub(super) struct Table {
    /// [`GpuScene::triangle_order`] of the scene.
    order: u64,
    /// The last frame that has used it: its number.
    pub used_in: u64,
    /// Numbers of where things are, and of all that an update brings, when entries were last looked up.
    state: [u64; 2],
    /// Frames since that has changed; `u32::MAX`: it has not.
    since_change: u32,
    /// Edge of the smallest entries, m.
    pub edge: f32,
    pub slots: Slots,
    /// What each of them sends is packed (`rgbe.wesl`), as it is.
    pub is_packed: bool,
    /// Once they have moved.
    other: Option<Slots>,
    bounces: Bounces,
    /// The frame before which entries moved.
    moved_at: u32,
}

/// What has become of a scene since its entries were last looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    /// Nothing, for longer than the reset window.
    Long,
    /// Nothing, but a short time ago it has changed.
    Recent,
    /// It has changed, and had a short time ago.
    Ongoing,
    /// It has changed, after a long time.
    Alone,
}

impl Table {
    /// No entries, and so many slots.
    pub fn new(frame: &Frame<'_>, scene: &GpuScene, slots: u32, bounces: Bounces) -> Result<Self, RenderError> {
        Ok(Self {
            order: scene.triangle_order(),
            used_in: 0,
            state: [scene.generation(), scene.revision()],
            since_change: u32::MAX,
            edge: edge_in(scene),
            slots: Slots::new(frame.device, slots, bounces)?,
            is_packed: false,
            other: None,
            bounces,
            moved_at: 0,
        })
    }

    /// True if its entries are of this scene as it is.
    pub fn is_of(&self, scene: &GpuScene) -> bool {
        self.order == scene.triangle_order()
    }

    /// What has become of the scene; asked once a view. `is_first_view`: of its frame.
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

    /// No entries, for an image of this scene.
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

/// The passes that put entries into another table.
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

    /// Puts the entries into a table of as many slots as `parameters` say, if that is larger than theirs; or, once so many frames have passed as entries
    /// are kept for, into another one of the same size, without those for which nothing has asked for so long.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        table: &mut Table,
        parameters: &RadianceCacheParameters,
    ) -> Result<(), RenderError> {
        let count = parameters.slot_mask + 1;
        let grows = count != table.slots.count;
        let forgets = parameters.frame - table.moved_at >= parameters.kept;
        if !grows && !forgets {
            return Ok(());
        }
        // What a table forgets does not depend on when it grows.
        let kept = if forgets { parameters.kept } else { u32::MAX };
        if forgets {
            table.moved_at = parameters.frame;
        }
        let new = match table.other.take().filter(|other| other.count == count) {
            Some(other) => other,
            None => {
                // They hold what they bind.
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
            .buffer("old_hits", &old.links)
            .buffer("old_earlier", &old.earlier);
        frame.dispatch(&self.rehash, &bindings, workgroups(old.count));
        frame.dispatch(&self.migrate, &bindings, workgroups(old.count));
        frame.dispatch(&self.migrate_hits, &bindings, workgroups(old.count));
        table.other = (!grows).then_some(old);
        Ok(())
    }
}
