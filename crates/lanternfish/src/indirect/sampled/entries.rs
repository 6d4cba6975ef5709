//! Rays whose hits are lit by the radiance cache.

use super::DECLARED;
use std::ops::Range;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame};

use super::{
    PROBES, SampleSlots, SampledParameters,
    passes::RayGrid,
    sample_order::{place_count, workgroups_in_rows},
    targets::{in_parts, traced_together},
};
use crate::{
    common::workgroups,
    context::ViewContext,
    error::RenderError,
    indirect::radiance_cache::{CacheOfFrame, FEWEST, RadianceCache},
    rays::Tracer,
};

/// Largest list of rays' entries, bytes: the sample indices of larger frames are processed in parts.
const MOST_BYTES: u64 = 96 << 20;

/// Size of `SampleHits` of `sample_hits.wesl` before its list, bytes.
const HITS_HEADER_BYTES: u64 = 24;

/// Offsets of the workgroups of passes in `SampleDispatches` of `sample_hits.wesl`, bytes.
const INSERT: u64 = 0;
const GATHER: u64 = 12;
pub(super) const SHADE: u64 = 24;
pub(super) const SHADOW: u64 = 36;

/// The passes that look up and read the entries that rays hit.
#[derive(Debug)]
pub(super) struct EntryPasses {
    find: ComputeKernel,
    find_and_add: ComputeKernel,
    insert: ComputeKernel,
    scatter: ComputeKernel,
    gather: ComputeKernel,
    gather_missing: ComputeKernel,
}

impl EntryPasses {
    /// Compiles the passes. `of_rays`: features of the shaders that read rays; `tracer`: of these rays; `folder`: the
    /// first part of their labels.
    pub fn new(device: &wgpu::Device, of_rays: &[Feature], tracer: Tracer, folder: &str) -> Result<Self, RenderError> {
        let kernel = |file: &str, features: &[Feature], entry: &str| {
            let shader = DECLARED.link(&format!("indirect/sampled/{file}"), features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &format!("{folder}/entries/{entry}")))
        };
        let of_probes: Vec<Feature> = of_rays.iter().copied().filter(|feature| *feature == PROBES).collect();
        let with_ids = |features: &[Feature]| [features, tracer.features_of_ids()].concat();
        Ok(Self {
            find: kernel("find_entries", &with_ids(of_rays), "find")?,
            find_and_add: kernel("find_entries", &with_ids(of_rays), "find_and_add")?,
            insert: kernel("insert_entries", &with_ids(&of_probes), "insert")?,
            scatter: kernel("insert_entries", &with_ids(&of_probes), "scatter")?,
            gather: kernel("gather_entries", of_rays, "gather")?,
            gather_missing: kernel("gather_entries", of_rays, "gather_missing")?,
        })
    }

    /// Prepares the entries for the rays of a grid.
    pub fn begin<'a>(
        &'a self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        CachedFrame { cache, of_frame, may_start_over }: CachedFrame<'a>,
        &RayGrid { size, sample_count, explores, .. }: &RayGrid<'_>,
    ) -> Result<FrameEntries<'a>, RenderError> {
        let pixels = u64::from(place_count(size));
        let together = if of_frame.is_accumulated() {
            traced_together(frame.device, size, sample_count)
        } else {
            in_parts(sample_count, u32::try_from(MOST_BYTES / (4 * pixels).max(1)).unwrap_or(u32::MAX).max(1))
        };
        let slots = frame.scratch("indirect/entries/slots", 4 * pixels * u64::from(together))?;
        let hits = frame.scratch("indirect/entries/ends", HITS_HEADER_BYTES + 8 * pixels)?;
        let dispatches = frame.zeroed("indirect/entries/dispatches", 48)?;
        frame.encoder().clear_buffer(&hits, 0, Some(HITS_HEADER_BYTES));
        let fraction = of_frame.fraction();
        let sky_is_dark = u32::from(view.scene.environment.is_none() && view.scene.sky == Vec3::ZERO);
        Ok(FrameEntries {
            passes: self,
            cache,
            of_frame,
            may_start_over,
            size,
            slots,
            hits,
            dispatches,
            together,
            sample_count,
            explores,
            sky_is_dark,
            fraction,
        })
    }
}

/// The radiance cache, and its state in one frame.
#[derive(Debug)]
pub(in crate::indirect) struct CachedFrame<'a> {
    pub cache: &'a mut RadianceCache,
    pub of_frame: &'a mut CacheOfFrame,
    /// The rays may start over with a larger table, which is empty: others of the frame have been lit, or do not need
    /// the same entries.
    pub may_start_over: bool,
}

/// Existing entries for which rays vote.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Voting {
    /// A power of two less 1: one of so many entries, plus 1.
    mask: u32,
    /// 1: a different subset for each sample index.
    step: u32,
}

impl Voting {
    /// All entries.
    const EACH: Self = Self { mask: 0, step: 0 };
    /// Largest divisor of the entries that are voted for: about as many rays may vote as there are pixels, or an eighth
    /// of all. At most one vote per pixel.
    const SAMPLES: u32 = 8;

    /// If one of `fraction` entries gets another sample in this frame, rays vote for the scheduled ones. If more
    /// entries do, each entry gets votes from a fraction of the sample indices.
    fn of(fraction: u32, sample_count: u32) -> Self {
        let one_of = 1 << sample_count.clamp(1, Self::SAMPLES).ilog2();
        Self { mask: one_of - 1, step: u32::from(fraction < one_of) }
    }
}

#[cfg(test)]
#[test]
fn scheduled_entries_get_votes() {
    assert_eq!(Voting::of(8, 8), Voting { mask: 7, step: 0 });
    assert_eq!(Voting::of(8, 20), Voting { mask: 7, step: 0 });
    assert_eq!(Voting::of(1, 11), Voting { mask: 7, step: 1 });
    assert_eq!(Voting::of(8, 3), Voting { mask: 1, step: 0 });
    assert_eq!([Voting::of(8, 1), Voting::of(1, 1), Voting::of(1, 0)], [Voting::EACH; 3]);
}

/// The entries of one frame's rays.
pub(super) struct FrameEntries<'a> {
    passes: &'a EntryPasses,
    cache: &'a mut RadianceCache,
    of_frame: &'a mut CacheOfFrame,
    may_start_over: bool,
    /// Pixels from which rays start, across and down.
    size: UVec2,
    /// Slots of rays' entries: `ray_slots.wesl`.
    slots: wgpu::Buffer,
    /// Outcome of all rays, and the list of missing entries: `sample_hits.wesl`.
    hits: wgpu::Buffer,
    /// Workgroups of the passes that process the remaining rays: `SampleDispatches` of `sample_hits.wesl`.
    pub dispatches: wgpu::Buffer,
    /// Sample indices whose hits are gathered together.
    together: u32,
    sample_count: u32,
    /// [`RayGrid::explores`].
    explores: u32,
    sky_is_dark: u32,
    /// Update stride of this frame; 0: no entry gets another sample.
    fraction: u32,
}

impl FrameEntries<'_> {
    /// Lets other rays of the frame reuse the buffers. All passes of these rays are recorded.
    pub fn release(&self, frame: &mut Frame<'_>) {
        frame.release(&self.slots);
        frame.release(&self.hits);
    }

    /// True if all entries are new.
    pub fn is_first(&self) -> bool {
        self.of_frame.first_samples().is_some()
    }

    /// The sample indices whose hits are gathered together with those of this one.
    pub fn gathered_with(&self, sample_index: u32) -> Range<u32> {
        let first = sample_index / self.together * self.together;
        first..(first + self.together).min(self.sample_count)
    }

    /// Completes the parameters of the frame with those of the cache.
    pub fn parameters(&self, parameters: SampledParameters) -> SampledParameters {
        let voting = if self.is_first() { Voting::EACH } else { Voting::of(self.fraction, self.sample_count) };
        SampledParameters {
            has_entries: 1,
            voting_mask: voting.mask,
            voting_step: voting.step,
            sky_is_dark: self.sky_is_dark,
            adds_found: self.of_frame.is_accumulated().into(),
            ..parameters
        }
    }

    /// End (exclusive) of the sample indices whose hits are looked up together, from this one on: one at a time if all
    /// entries are new, since entries are then sampled after each.
    pub fn found_end(&self, of_sample: &SampleSlots) -> u32 {
        if self.is_first() { of_sample.round + 1 } else { of_sample.traced_end }
    }

    /// True if hits are looked up at this sample index. Otherwise they were at an earlier one.
    pub fn looks_up(&self, of_sample: &SampleSlots) -> bool {
        self.is_first() || of_sample.round == of_sample.traced_first
    }

    /// Looks up the entries that the rays of some sample indices hit. In an unchanged scene, adds the radiance of
    /// entries with samples to the pixels' sums. `rays`: bindings of the first sample index, the hits, the sums and the
    /// counters.
    pub fn find(&mut self, frame: &mut Frame<'_>, rays: &Bindings<'_>) {
        let of_frame = self.of_frame.bindings();
        let finding = rays
            .clone()
            .with(&of_frame)
            .buffer("ray_slots", &self.slots)
            .buffer("sample_hits", &self.hits)
            .buffer("sample_dispatches", &self.dispatches);
        let find = if self.of_frame.is_accumulated() { &self.passes.find_and_add } else { &self.passes.find };
        frame.dispatch(find, &finding, workgroups_in_rows(self.size));
        frame.dispatch_indirect(&self.passes.insert, &finding, &self.dispatches, INSERT);
        frame.dispatch(&self.passes.scatter, &finding, workgroups(self.of_frame.slots()));
    }

    /// In a frame in which all entries are new: takes a fraction of their samples after this sample index, whose rays
    /// have voted. The samples of an entry are thereby spread over several hits.
    pub fn sample(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        sample_index: u32,
    ) -> Result<(), RenderError> {
        let Some(samples) = self.of_frame.first_samples() else { return Ok(()) };
        if self.explores > 0 {
            return self.cache.update(frame, view, self.of_frame, 1);
        }
        // At least one after the first sample index: entries are counted then, too.
        let until = |sample_index: u32| {
            (u64::from(samples) * u64::from(sample_index.min(self.sample_count))).div_ceil(u64::from(self.sample_count))
                as u32
        };
        let most = until(sample_index + 1) - until(sample_index);
        self.cache.update(frame, view, self.of_frame, most)?;
        let left = |sample_index: u32| until(sample_index).saturating_sub(1) / RadianceCache::LISTED;
        if left(sample_index + 2) > left(sample_index + 1) {
            // At the next sample index hits leave the lists, and their radiance of that moment is stored.
            self.cache.propagate(frame, self.of_frame)?;
        }
        Ok(())
    }

    /// True if the frame has to start over from its first sample index, with a larger, empty table. Called after each
    /// sample index; after the last one the number of entries is recorded, so that the next frame has capacity for
    /// them.
    pub fn starts_over(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        sample_index: u32,
    ) -> Result<bool, RenderError> {
        let evaluates = sample_index + 1 == self.sample_count || (sample_index + 1).is_power_of_two();
        let sample_count = if self.explores > 0 { self.explores } else { self.sample_count };
        Ok(evaluates
            && self.may_start_over
            && self.cache.starts_over(frame, view, self.of_frame, sample_index, sample_count)?)
    }

    /// Updates the entries, and adds their radiance to the pixels' sums if it was not added at lookup. `summing`:
    /// bindings of the sample index, the sums and the counters.
    pub fn gather(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        summing: &Bindings<'_>,
    ) -> Result<(), RenderError> {
        let most = if self.is_first() { u32::MAX } else { FEWEST };
        self.cache.update(frame, view, self.of_frame, most)?;
        self.cache.propagate(frame, self.of_frame)?;
        self.of_frame.has_propagated();
        let entries = self.of_frame.bindings();
        let gathering =
            summing.clone().with(&entries).buffer("ray_slots", &self.slots).buffer("sample_hits", &self.hits);
        if self.of_frame.is_accumulated() {
            frame.dispatch_indirect(&self.passes.gather_missing, &gathering, &self.dispatches, GATHER);
        } else {
            frame.dispatch(&self.passes.gather, &gathering, workgroups_in_rows(self.size));
        }
        Ok(())
    }
}

#[cfg(test)]
#[test]
fn missing_ray_list_has_the_offset_of_the_shader() {
    let shader = DECLARED.link("indirect/sampled/find_entries", &[]).unwrap();
    let offset = shader.module.types.iter().find_map(|(_, ty)| match &ty.inner {
        wgpu::naga::TypeInner::Struct { members, .. } => {
            members.iter().find(|member| member.name.as_deref() == Some("missing")).map(|member| member.offset)
        }
        _ => None,
    });
    assert_eq!(offset, Some(HITS_HEADER_BYTES as u32));
}

#[cfg(test)]
#[test]
fn sample_indices_of_a_lookup_fit_the_bit_mask() {
    let bits = crate::shaders::constant("indirect/sampled/hit_point", "SAMPLE_BITS") as u32;
    assert!(super::targets::MOST_SAMPLES <= 1 << bits && 1 << bits <= u32::BITS);
}
