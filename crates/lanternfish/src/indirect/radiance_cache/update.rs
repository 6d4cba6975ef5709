//! Cells that are due get another sample.

use lanternfish_gpu::Frame;

use super::{ALL, CacheOfFrame, Kernels, RadianceCache, parameters::RadianceCacheParameters};
use crate::{common::workgroups, context::ViewContext};

impl RadianceCache {
    /// Takes more samples of cells that rays have asked for: up to so many of each that has few.
    pub fn update(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>, cache: &mut CacheOfFrame, most: u32) {
        let ViewContext { scene, buffer, .. } = view;
        let [mut due, mut due_before, sampled, workgroups_due] = cache.scratch.clone();
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
            meet,
            place,
            keep,
            commit,
            pack_due,
            ..
        } = &self.kernels;
        let light = if environment.is_some() { light_environment } else { light };
        let rounds = most.min(cache.parameters.fewest);
        for round in 0..rounds {
            // New cells get one sample after the other, and those that their rays meet; the others one in the first round.
            let is_first = round == 0;
            let parameters = cache.parameters;
            // Rays have asked for cells whose turn it is by that number.
            debug_assert!(!is_first || parameters.share == 0 || self.update == parameters.update);
            let uniform = frame.uniform(&RadianceCacheParameters {
                update: self.update,
                share: if is_first { parameters.share } else { 0 },
                remembered: if is_first { parameters.remembered } else { ALL },
                fades: if is_first { parameters.fades } else { 0 },
                counts: is_first.into(),
                ..parameters
            });
            self.update += 1;
            let bindings = shared.clone().part("radiance_cache", &uniform);
            std::mem::swap(&mut due, &mut due_before);
            let choosing = bindings
                .clone()
                .buffer("found_due", &due)
                .buffer("due", &due_before)
                .buffer("sampled_cells", &sampled)
                .buffer("due_dispatch", &workgroups_due);
            frame.dispatch(clear, &choosing, [1; 3]);
            if is_first {
                frame.dispatch(choose, &choosing, workgroups(self.slots));
            } else {
                frame.dispatch_indirect(choose_again, &choosing, &workgroups_due);
            }
            frame.dispatch(measure, &choosing, [1; 3]);
            let mut sampling = bindings.buffer("due", &due).buffer("sampled_cells", &sampled);
            if let Some(environment) = &environment {
                sampling = sampling.with(environment);
            }
            frame.dispatch_indirect(light, &sampling, &workgroups_due);
            frame.dispatch_indirect(shadow, &sampling, &workgroups_due);
            if self.bounces.needs_rays() {
                trace.dispatch_indirect(frame, view, &sampling, &workgroups_due);
                frame.dispatch_indirect(meet, &sampling, &workgroups_due);
                frame.dispatch_indirect(place, &sampling, &workgroups_due);
                frame.dispatch_indirect(keep, &sampling, &workgroups_due);
            }
            frame.dispatch_indirect(commit, &sampling, &workgroups_due);
            if cache.readers.include_sampled(is_first) {
                self.relax_due(frame, cache, is_first, [&due, &workgroups_due]);
            }
            if cache.is_steady && self.bounces.needs_rays() {
                frame.dispatch_indirect(pack_due, &sampling, &workgroups_due);
            }
            if self.bounces.needs_rays() && (round + 1) % Self::LISTED == 0 && round + 1 < rounds {
                // In the next round rays leave the list, and what they bring is kept: it has to be known.
                self.relax(frame, cache);
            }
        }
        // Once a frame it is all cells' turn, they fade, and what was known counts for little.
        cache.parameters = RadianceCacheParameters { share: 0, remembered: ALL, fades: 0, ..cache.parameters };
    }
}
