//! Rays whose ends are entries of the radiance cache.

use super::DECLARED;
use std::ops::Range;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame};

use super::{
    GLOSSY_RAYS, SampleSlots, Sampled, SampledParameters, diffuse_blur,
    sample_order::{place_count, workgroups_in_rows},
    targets::{in_parts, traced_together},
};
use crate::{
    common::workgroups,
    context::ViewContext,
    error::RenderError,
    indirect::{
        Counters,
        radiance_cache::{CacheOfFrame, CacheSettings, RadianceCache},
    },
    rays::Structure,
    rays::Tracer,
};

/// Bytes of a list of rays' entries at most: rounds whose rays are more are gone through in parts.
const MOST_BYTES: u64 = 96 << 20;

/// Bytes of `SampleHits` of `sample_hits.wesl` before its list.
const ENDS_BYTES: u64 = 24;

/// The cache, and the passes by which a pixel's rays find its entries and read them.
#[derive(Debug)]
pub(super) struct Entries {
    cache: RadianceCache,
    find: ComputeKernel,
    find_and_add: ComputeKernel,
    before_insert: ComputeKernel,
    insert: ComputeKernel,
    scatter: ComputeKernel,
    before_shade: ComputeKernel,
    gather: ComputeKernel,
    gather_missing: ComputeKernel,
}

impl Entries {
    /// Compiles the passes. `exact`: what traces rays to lights.
    pub fn new(
        device: &wgpu::Device,
        settings: &Sampled,
        exact: Tracer,
        structure: &Structure,
    ) -> Result<Self, RenderError> {
        let of_rays: &[Feature] = if settings.glossy_rays > 0 { &[GLOSSY_RAYS] } else { &[] };
        let kernel = |file: &str, features: &[Feature], entry: &str| {
            let shader = DECLARED.link(&format!("indirect/sampled/{file}"), features)?;
            let label = entry.strip_prefix("before_").map_or(entry, |_| "prepare");
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &format!("indirect/entries/{label}")))
        };
        let of_cache = CacheSettings {
            bounces: settings.bounces,
            most_entries: settings.cache_entries,
            first_samples: settings.cache_samples,
            tracer: settings.tracer.fixed(),
            blur: diffuse_blur(1, RadianceCache::MOST_SAMPLES),
        };
        Ok(Self {
            cache: RadianceCache::new(device, of_cache, exact, structure)?,
            find: kernel("find_entries", of_rays, "find")?,
            find_and_add: kernel("find_entries", of_rays, "find_and_add")?,
            before_insert: kernel("prepare_dispatches", &[], "before_insert")?,
            insert: kernel("insert_entries", &[], "insert")?,
            scatter: kernel("insert_entries", &[], "scatter")?,
            before_shade: kernel("prepare_dispatches", &[], "before_shade")?,
            gather: kernel("gather_entries", of_rays, "gather")?,
            gather_missing: kernel("gather_entries", of_rays, "gather_missing")?,
        })
    }

    /// Forgets what the entries have kept.
    pub fn forget(&mut self) {
        self.cache.forget();
    }

    /// The entries for the rays of a frame, from so many pixels across and down: `rounds` of them, or `first_samples` where all entries are new.
    pub fn begin<'a>(
        &'a mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        size: UVec2,
        rounds: u32,
        first_samples: u32,
    ) -> Result<FrameEntries<'a>, RenderError> {
        let of_frame = self.cache.begin(frame, view)?;
        let rounds = if of_frame.first_samples().is_some() { first_samples } else { rounds };
        let pixels = u64::from(place_count(size));
        let together = if of_frame.is_steady() {
            traced_together(frame.device, size, rounds)
        } else {
            in_parts(rounds, u32::try_from(MOST_BYTES / (4 * pixels).max(1)).unwrap_or(u32::MAX).max(1))
        };
        let slots = frame.scratch("indirect/entries/slots", 4 * pixels * u64::from(together))?;
        let ends = frame.scratch("indirect/entries/ends", ENDS_BYTES + 8 * pixels)?;
        frame.encoder().clear_buffer(&ends, 0, Some(ENDS_BYTES));
        let dispatches = [
            frame.indirect("indirect/entries/insert_workgroups")?,
            frame.indirect("indirect/entries/shade_workgroups")?,
            frame.indirect("indirect/entries/shadow_workgroups")?,
        ];
        let fraction = of_frame.fraction();
        let sky_is_dark = u32::from(view.scene.environment.is_none() && view.scene.sky == Vec3::ZERO);
        Ok(FrameEntries {
            entries: self,
            of_frame,
            size,
            slots,
            ends,
            dispatches,
            together,
            rounds,
            sky_is_dark,
            fraction,
        })
    }
}

/// Which entries rays ask for that are there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Voting {
    /// One of so many, less 1.
    mask: u32,
    /// 1: others in each round.
    step: u32,
}

impl Voting {
    /// All of them.
    const EACH: Self = Self { mask: 0, step: 0 };
    /// One entry in so many is requested, at most: as many rays may ask as one round has, or an eighth of all. Of a pixel's one does.
    const SAMPLES: u32 = 8;

    /// Where one of `fraction` entries gets another sample in this frame, rays ask for those whose turn it is; where more of them do, for each entry in a
    /// share of the rounds.
    fn of(fraction: u32, rounds: u32) -> Self {
        let one_of = 1 << rounds.clamp(1, Self::SAMPLES).ilog2();
        Self { mask: one_of - 1, step: u32::from(fraction < one_of) }
    }
}

#[cfg(test)]
#[test]
fn cells_are_asked_for_before_it_is_their_turn() {
    assert_eq!(Voting::of(8, 8), Voting { mask: 7, step: 0 });
    assert_eq!(Voting::of(8, 20), Voting { mask: 7, step: 0 });
    assert_eq!(Voting::of(1, 11), Voting { mask: 7, step: 1 });
    assert_eq!(Voting::of(8, 3), Voting { mask: 1, step: 0 });
    assert_eq!([Voting::of(8, 1), Voting::of(1, 1), Voting::of(1, 0)], [Voting::EACH; 3]);
}

/// The entries of one frame's rays.
pub(super) struct FrameEntries<'a> {
    entries: &'a mut Entries,
    of_frame: CacheOfFrame,
    /// Pixels that rays go from, across and down.
    size: UVec2,
    /// Slots of rays' entries: `ray_slots.wesl`.
    slots: wgpu::Buffer,
    /// What became of them in all, and which entries are missing: `sample_hits.wesl`.
    ends: wgpu::Buffer,
    /// Workgroups of passes for which rays may have left something: insert, shade, shadow.
    dispatches: [wgpu::Buffer; 3],
    /// Rounds whose ends are gathered together.
    together: u32,
    rounds: u32,
    sky_is_dark: u32,
    /// One of so many entries gets another sample in this frame.
    fraction: u32,
}

impl FrameEntries<'_> {
    /// True if all entries are new.
    pub fn is_first(&self) -> bool {
        self.of_frame.first_samples().is_some()
    }

    /// What the cache has counted.
    pub fn counters(&self) -> Counters {
        self.of_frame.counters.clone()
    }

    /// The rounds whose ends are gathered with those of this one.
    pub fn gathered_with(&self, round: u32) -> Range<u32> {
        let first = round / self.together * self.together;
        first..(first + self.together).min(self.rounds)
    }

    /// The parameters of the frame, as they are with entries.
    pub fn parameters(&self, parameters: SampledParameters) -> SampledParameters {
        let voting = if self.is_first() { Voting::EACH } else { Voting::of(self.fraction, self.rounds) };
        SampledParameters {
            has_entries: 1,
            voting_mask: voting.mask,
            voting_step: voting.step,
            sky_is_dark: self.sky_is_dark,
            adds_found: self.of_frame.is_steady().into(),
            ..parameters
        }
    }

    /// The round behind the last whose ends are looked up together, from this one on: where a share of the samples is taken behind each round, each.
    pub fn found_end(&self, rounds: &SampleSlots) -> u32 {
        if self.is_first() { rounds.round + 1 } else { rounds.traced_end }
    }

    /// Whether ends are looked up in this round; else they were in one before.
    pub fn looks_up(&self, rounds: &SampleSlots) -> bool {
        self.is_first() || rounds.round == rounds.traced_first
    }

    /// The workgroups by which what is not in entries is shaded, and by which lights are looked for from there.
    pub fn left_over(&self) -> [&wgpu::Buffer; 2] {
        let [_, shade, shadow] = &self.dispatches;
        [shade, shadow]
    }

    /// Looks up the entries of the rays of some rounds. Where nothing changes, adds what they send to the pixels' sums, if they have samples. `rays`:
    /// bindings of the first of the rounds, of what their rays met, of the sums and counters.
    pub fn find(&mut self, frame: &mut Frame<'_>, rays: &Bindings<'_>) {
        let of_frame = self.of_frame.bindings();
        let [insert, shade, shadow] = &self.dispatches;
        let finding = rays
            .clone()
            .with(&of_frame)
            .buffer("ray_slots", &self.slots)
            .buffer("sample_hits", &self.ends)
            .buffer("insert_dispatch", insert)
            .buffer("shade_dispatch", shade)
            .buffer("shadow_dispatch", shadow);
        let find = if self.of_frame.is_steady() { &self.entries.find_and_add } else { &self.entries.find };
        frame.dispatch(find, &finding, workgroups_in_rows(self.size));
        frame.dispatch(&self.entries.before_insert, &finding, [1; 3]);
        frame.dispatch_indirect(&self.entries.insert, &finding, insert);
        frame.dispatch(&self.entries.scatter, &finding, workgroups(self.of_frame.slots()));
        frame.dispatch(&self.entries.before_shade, &finding, [1; 3]);
    }

    /// In the frame that all entries are new in: takes a share of the samples behind this round, whose rays have asked, so that samples of one entry
    /// are not all in one place.
    pub fn sample(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>, round: u32) {
        let Some(samples) = self.of_frame.first_samples() else { return };
        // Behind the first round some: entries are counted then, too.
        let until = |round: u32| {
            (u64::from(samples) * u64::from(round.min(self.rounds))).div_ceil(u64::from(self.rounds)) as u32
        };
        let most = until(round + 1) - until(round);
        self.entries.cache.update(frame, view, &mut self.of_frame, most);
        let left = |round: u32| until(round).saturating_sub(1) / RadianceCache::LISTED;
        if left(round + 2) > left(round + 1) {
            // In the next round rays leave the lists, and what they bring then is kept.
            self.entries.cache.propagate(frame, &self.of_frame);
        }
    }

    /// Whether the frame has to start over from its first round, with a larger table that has no entries yet. Requested behind each round; behind the last
    /// one the number of entries is noted, so that there is room for them in the next frame.
    pub fn starts_over(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        round: u32,
    ) -> Result<bool, RenderError> {
        let evaluates = round + 1 == self.rounds || (round + 1).is_power_of_two();
        Ok(evaluates && self.entries.cache.starts_over(frame, view, &mut self.of_frame, round, self.rounds)?)
    }

    /// Brings the entries up to date, and adds what they send to the pixels' sums, if it was not added where they were found. `summing`: bindings of the
    /// round, the sums and counters.
    pub fn gather(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>, summing: &Bindings<'_>) {
        self.entries.cache.update(frame, view, &mut self.of_frame, u32::MAX);
        self.entries.cache.propagate(frame, &self.of_frame);
        let entries = self.of_frame.bindings();
        let gathering =
            summing.clone().with(&entries).buffer("ray_slots", &self.slots).buffer("sample_hits", &self.ends);
        if self.of_frame.is_steady() {
            // As many as were put into the table.
            let [missing, ..] = &self.dispatches;
            frame.dispatch_indirect(&self.entries.gather_missing, &gathering, missing);
        } else {
            frame.dispatch(&self.entries.gather, &gathering, workgroups_in_rows(self.size));
        }
    }
}

#[cfg(test)]
#[test]
fn the_list_of_missing_rays_begins_where_shaders_have_it() {
    let shader = DECLARED.link("indirect/sampled/find_entries", &[]).unwrap();
    let offset = shader.module.types.iter().find_map(|(_, ty)| match &ty.inner {
        wgpu::naga::TypeInner::Struct { members, .. } => {
            members.iter().find(|member| member.name.as_deref() == Some("missing")).map(|member| member.offset)
        }
        _ => None,
    });
    assert_eq!(offset, Some(ENDS_BYTES as u32));
}

#[cfg(test)]
#[test]
fn rounds_that_are_looked_up_together_have_a_bit_each() {
    let bits = crate::shaders::constant("indirect/sampled/hit_point", "SAMPLE_BITS") as u32;
    assert!(super::targets::MOST_SAMPLES <= 1 << bits && 1 << bits <= u32::BITS);
}
