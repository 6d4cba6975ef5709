//! Another sample for the scheduled entries.

use lanternfish_gpu::Frame;

use super::{ALL, CacheOfFrame, RadianceCache, Rays, parameters::CacheUpdate};
use crate::{common::workgroups, context::ViewContext, error::RenderError};

/// Offset of the workgroups for two rays of each entry in a list of scheduled entries, bytes.
const TWO_RAYS: u64 = 12;

impl RadianceCache {
    /// Takes more samples of requested entries: up to `most` of each entry with few samples.
    pub fn update(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        cache: &mut CacheOfFrame,
        most: u32,
    ) -> Result<(), RenderError> {
        let ViewContext { scene, buffer, .. } = view;
        let shared = scene.bindings().with(&buffer.bindings()).with(&cache.bindings());
        let environment = scene.environment.as_ref().map(|_| scene.environment_light().bindings());
        let kernels = &self.kernels;
        let light = if environment.is_some() { &kernels.light_environment } else { &kernels.light };
        let mut lists = cache.lists.clone();
        let sample_count = most.min(cache.parameters.fewest);
        for sample_index in 0..sample_count {
            // New entries, and the new entries that their rays hit, get several samples in sequence; other entries get
            // one at the first sample index.
            let is_first = sample_index == 0;
            // Rays have voted for the entries that this update number schedules.
            debug_assert!(!is_first || cache.update.fraction == 0 || self.update == cache.update.update);
            let of_sample = if is_first { CacheUpdate { counts: 1, ..cache.update } } else { CacheUpdate::NEW_ONES };
            let uniform = frame.uniform(&CacheUpdate { update: self.update, ..of_sample });
            self.update += 1;
            let bindings = shared.clone().part("cache_update", &uniform).buffer("sampled_entries", &cache.sampled);
            lists.swap(0, 1);
            let [scheduled, before] = &lists;
            let choosing = bindings.clone().buffer("found_scheduled", scheduled).buffer("scheduled", before);
            if is_first {
                if of_sample.budget != 0 {
                    frame.dispatch(&kernels.classify, &choosing, workgroups(self.slots));
                }
                frame.dispatch(&kernels.choose, &choosing, workgroups(self.slots));
            } else {
                frame.dispatch_indirect(&kernels.choose_again, &choosing, before, 0);
            }
            let mut sampling = bindings.buffer("scheduled", scheduled).buffer("list_to_empty", before);
            if let Some(environment) = &environment {
                sampling = sampling.with(environment);
            }
            frame.dispatch_indirect(light, &sampling, scheduled, 0);
            match &kernels.rays {
                Rays::Shadow(shadow) => frame.dispatch_indirect(shadow.of(scene), &sampling, scheduled, 0),
                Rays::Both(both) => frame.dispatch_indirect(both.of(scene), &sampling, scheduled, TWO_RAYS),
                Rays::Each(shadow, trace) => {
                    frame.dispatch_indirect(shadow.of(scene), &sampling, scheduled, 0);
                    trace.dispatch_indirect(frame, &view.structures, &sampling, scheduled, 0);
                }
            }
            if self.bounces.needs_rays() {
                frame.dispatch_indirect(&kernels.intersect, &sampling, scheduled, 0);
                frame.dispatch_indirect(&kernels.store_hits, &sampling, scheduled, 0);
            }
            frame.dispatch_indirect(&kernels.accumulate, &sampling, scheduled, 0);
            if self.bounces.needs_rays() && cache.readers.include_sampled(is_first) {
                self.propagate_scheduled(frame, cache, is_first, scheduled);
            }
            if self.bounces.needs_rays() && (sample_index + 1) % Self::LISTED == 0 && sample_index + 1 < sample_count {
                // At the next sample index hits leave the lists, and their radiance is stored: it has to be up to date.
                self.propagate(frame, cache)?;
            }
        }
        cache.lists = lists;
        // The stride, aging and the cut of the history apply once per frame.
        cache.update = CacheUpdate { update: cache.update.update, ..CacheUpdate::NEW_ONES };
        Ok(())
    }
}

impl CacheUpdate {
    /// An update in which new entries alone are scheduled.
    const NEW_ONES: Self = Self { update: 0, fraction: 0, remembered: ALL, ages: 0, counts: 0, budget: 0 };
}
