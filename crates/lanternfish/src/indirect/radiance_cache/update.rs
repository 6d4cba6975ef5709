//! Another sample for the scheduled entries.

use lanternfish_gpu::Frame;

use super::{ALL, CacheOfFrame, Kernels, RadianceCache, parameters::CacheUpdate};
use crate::{common::workgroups, context::ViewContext};

impl RadianceCache {
    /// Takes more samples of requested entries: up to `most` of each entry with few samples.
    pub fn update(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>, cache: &mut CacheOfFrame, most: u32) {
        let ViewContext { scene, buffer, .. } = view;
        let [mut scheduled, mut scheduled_before, sampled, workgroups_scheduled] = cache.scratch.clone();
        let shared = scene.bindings().with(&buffer.bindings()).with(&cache.bindings());
        let environment = scene.environment.as_ref().map(|_| scene.environment_light().bindings());
        let Kernels {
            clear,
            choose,
            choose_again,
            measure,
            light,
            light_environment,
            shadow,
            trace,
            intersect,
            scatter,
            store_hits,
            accumulate,
            pack_scheduled,
            ..
        } = &self.kernels;
        let light = if environment.is_some() { light_environment } else { light };
        let sample_count = most.min(cache.parameters.fewest);
        for sample_index in 0..sample_count {
            // New entries, and the new entries that their rays hit, get several samples in sequence; other entries get one at the first sample index.
            let is_first = sample_index == 0;
            // Rays have voted for the entries that this update number schedules.
            debug_assert!(!is_first || cache.update.fraction == 0 || self.update == cache.update.update);
            let of_sample = if is_first { CacheUpdate { counts: 1, ..cache.update } } else { CacheUpdate::NEW_ONES };
            let uniform = frame.uniform(&CacheUpdate { update: self.update, ..of_sample });
            self.update += 1;
            let bindings = shared.clone().part("cache_update", &uniform);
            std::mem::swap(&mut scheduled, &mut scheduled_before);
            let choosing = bindings
                .clone()
                .buffer("found_scheduled", &scheduled)
                .buffer("scheduled", &scheduled_before)
                .buffer("sampled_entries", &sampled)
                .buffer("scheduled_dispatch", &workgroups_scheduled);
            frame.dispatch(clear, &choosing, [1; 3]);
            if is_first {
                frame.dispatch(choose, &choosing, workgroups(self.slots));
            } else {
                frame.dispatch_indirect(choose_again, &choosing, &workgroups_scheduled);
            }
            frame.dispatch(measure, &choosing, [1; 3]);
            let mut sampling = bindings.buffer("scheduled", &scheduled).buffer("sampled_entries", &sampled);
            if let Some(environment) = &environment {
                sampling = sampling.with(environment);
            }
            frame.dispatch_indirect(light, &sampling, &workgroups_scheduled);
            frame.dispatch_indirect(shadow, &sampling, &workgroups_scheduled);
            if self.bounces.needs_rays() {
                trace.dispatch_indirect(frame, view, &sampling, &workgroups_scheduled);
                frame.dispatch_indirect(intersect, &sampling, &workgroups_scheduled);
                frame.dispatch_indirect(scatter, &sampling, &workgroups_scheduled);
                frame.dispatch_indirect(store_hits, &sampling, &workgroups_scheduled);
            }
            frame.dispatch_indirect(accumulate, &sampling, &workgroups_scheduled);
            if cache.readers.include_sampled(is_first) {
                self.propagate_scheduled(frame, cache, is_first, &scheduled, &workgroups_scheduled);
            }
            if cache.is_accumulated && self.bounces.needs_rays() {
                frame.dispatch_indirect(pack_scheduled, &sampling, &workgroups_scheduled);
            }
            if self.bounces.needs_rays() && (sample_index + 1) % Self::LISTED == 0 && sample_index + 1 < sample_count {
                // At the next sample index hits leave the lists, and their radiance is stored: it has to be up to date.
                self.propagate(frame, cache);
            }
        }
        // The stride, aging and the cut of the history apply once per frame.
        cache.update = CacheUpdate { update: cache.update.update, ..CacheUpdate::NEW_ONES };
    }
}

impl CacheUpdate {
    /// An update in which new entries alone are scheduled.
    const NEW_ONES: Self = Self { update: 0, fraction: 0, remembered: ALL, ages: 0, counts: 0, _pad: 0 };
}
