//! What the passes of a frame cost beside their time: dispatches and rays.

use lanternfish_gpu::PassCommands;
use serde::{Deserialize, Serialize};

/// Counts of a pass.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PassCost {
    /// The pass's label.
    pub name: String,
    /// Number of dispatches; 0 for a render pass.
    pub dispatches: u32,
    /// Number of those whose number of workgroups the device reads.
    pub indirect: u32,
    /// Number of rays, of passes whose rays are counted.
    pub rays: Option<u64>,
}

/// Passes that trace rays, and the counter of their rays. Entries of the radiance cache trace two rays a sample: one
/// for light and one for a hit.
pub const RAYS: [(&str, &str, u64); 8] = [
    ("shadows/trace", "shadows/rays", 1),
    ("shadows/trace_edges", "shadows/edge_rays", 1),
    ("direct_light/trace", "shadows/rays", 1),
    ("indirect/trace", "indirect/rays", 1),
    ("indirect/emitters", "indirect/emitter_rays", 1),
    ("radiance_cache/rays", "radiance_cache/samples", 2),
    ("radiance_cache/shadow", "radiance_cache/samples", 1),
    ("radiance_cache/trace", "radiance_cache/samples", 1),
];

/// A pass whose rays the counter of `indirect/trace` holds too: in a frame with both, neither has a count of its own.
const SHARED: &str = "indirect/probes/trace";

/// The counts of every pass of a frame. `counter`: the frame's counter of a name.
pub fn pass_costs(commands: &[PassCommands], counter: impl Fn(&str) -> Option<u64>) -> Vec<PassCost> {
    let is_shared = |pass: &str| pass == "indirect/trace" && commands.iter().any(|other| other.name == SHARED);
    let cost = |pass: &PassCommands| PassCost {
        name: pass.name.clone(),
        dispatches: pass.dispatches,
        indirect: pass.indirect,
        rays: (RAYS.iter().find(|(name, ..)| *name == pass.name && !is_shared(name)))
            .and_then(|(_, name, rays)| Some(rays * counter(name)?)),
    };
    commands.iter().map(cost).collect()
}

/// Dispatches of all passes, and those of them that are indirect: `420 (290 indirect)`.
pub fn dispatches<'c>(costs: impl Iterator<Item = &'c PassCost> + Clone) -> String {
    let all: u32 = costs.clone().map(|cost| cost.dispatches).sum();
    match costs.map(|cost| cost.indirect).sum::<u32>() {
        0 => all.to_string(),
        indirect => format!("{all} ({indirect} indirect)"),
    }
}

/// Columns of a pass that takes `ms`: dispatches, rays, millions of rays a second.
pub fn columns(cost: Option<&PassCost>, ms: f64) -> [String; 3] {
    let Some(cost) = cost else { return [const { String::new() }; 3] };
    let dispatched = if cost.dispatches > 0 { dispatches(std::iter::once(cost)) } else { String::new() };
    let rays = cost.rays.filter(|rays| *rays > 0);
    let rate = rays.filter(|_| ms > 0.0).map(|rays| format!("{:.0}", rays as f64 / ms / 1e3));
    [dispatched, rays.map(crate::report::grouped).unwrap_or_default(), rate.unwrap_or_default()]
}

#[cfg(test)]
mod tests {
    use lanternfish::{Renderer, Settings, techniques::SampledLights};
    use lanternfish_gpu::testing;
    use lanternfish_scene::generate::demo;

    use super::*;

    #[test]
    fn rates_are_rays_by_time() {
        let commands = [("shadows/trace", 2, 0), ("indirect/trace", 5, 4), ("prepass", 0, 0)]
            .map(|(name, dispatches, indirect)| PassCommands { name: name.to_owned(), dispatches, indirect });
        let costs = pass_costs(&commands, |name| (name == "shadows/rays").then_some(3_000_000));
        assert_eq!(columns(costs.first(), 1.5), ["2", "3,000,000", "2000"]);
        assert_eq!(columns(costs.get(1), 1.0), ["5 (4 indirect)", "", ""]);
        assert_eq!(columns(costs.get(2), 1.0), ["", "", ""]);
        assert_eq!(dispatches(costs.iter()), "7 (4 indirect)");
        let with_probes = [SHARED, "indirect/trace", "indirect/emitters"].map(|name| PassCommands {
            name: name.to_owned(),
            dispatches: 1,
            indirect: 0,
        });
        let rays: Vec<_> = pass_costs(&with_probes, |_| Some(7)).into_iter().map(|cost| cost.rays).collect();
        assert_eq!(rays, [None, None, Some(7)]);
    }

    /// A pass or a counter that has another name now would lose its rays.
    #[gpu_test(full)]
    fn gpu_every_pass_with_rays_has_its_counter(gpu: &Gpu) {
        let scene = demo("cornell").unwrap();
        let sampled = Settings::direct_light().with_direct(SampledLights::default());
        let mut found = Vec::new();
        for settings in [Settings::default(), sampled] {
            let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
            let uploaded = renderer.upload(&scene).unwrap();
            let report = renderer.render(&uploaded, &scene.default_camera(1.0), [16, 16]).unwrap().report;
            let counter = |name: &str| report.counters.iter().find(|(n, _)| n == name).map(|(_, count)| *count);
            let costs = pass_costs(&report.commands, counter);
            found.extend(costs.into_iter().filter(|cost| cost.rays.is_some_and(|rays| rays > 0)).map(|cost| cost.name));
        }
        // Graphics cards trace both rays of an entry in one dispatch, software adapters in two.
        let is_software = gpu.description.kind == wgpu::DeviceType::Cpu;
        let others = ["radiance_cache/shadow", "radiance_cache/trace"];
        let is_elsewhere =
            |pass: &str| if is_software { pass == "radiance_cache/rays" } else { others.contains(&pass) };
        for (pass, ..) in RAYS.into_iter().filter(|(pass, ..)| !is_elsewhere(pass)) {
            assert!(found.iter().any(|name| name == pass), "{pass} is not in {found:?}");
        }
    }
}
