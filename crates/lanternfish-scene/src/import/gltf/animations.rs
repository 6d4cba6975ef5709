//! Animations: channels and their keyframes.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use lanternfish_limits::memory::Budget;

use super::accessor::Accessors;
use super::fault::{Place, Result, invalid, item};
use super::hierarchy::Placed;
use super::motion::target_count;
use super::notes::Notes;
use super::pointer::{self, Target};
use super::schema;
use crate::motion::{Animation, Channel, Interpolation, Property, Sampler};

/// Upper bound of the memory of a light's channel at one node, bytes: in a list that doubles as it grows, with two
/// constant channels and their samplers.
const BYTES_PER_LIGHT_CHANNEL: u64 = 512;

/// Reads the file's animations. `nodes`: the scene's; `node_indices`: the index into `nodes` of each of the file's
/// nodes.
pub(super) fn read(
    accessors: &Accessors,
    nodes: &[Placed],
    node_indices: &HashMap<usize, usize>,
    budget: &Budget,
    notes: &mut Notes,
) -> Result<Vec<Animation>> {
    let root = accessors.root;
    let nodes_of_lights = nodes_of_lights(nodes);
    let mut animations = Vec::new();
    // Samplers of the same keyframes, which many channels may name.
    let mut shared: HashMap<_, Arc<Sampler>> = HashMap::new();
    for (i, source) in root.animations.iter().enumerate() {
        let mut channels = Vec::new();
        let mut lights = BTreeMap::new();
        for (c, channel) in source.channels.iter().enumerate() {
            let at = || format!("animations[{i}].channels[{c}]");
            let (targets, property) = match pointer::resolve(&channel.target) {
                Ok(Target::Node(node, property)) => {
                    item(&root.nodes, node, "nodes").place(at)?;
                    (node_indices.get(&node).map(std::slice::from_ref), property)
                }
                Ok(Target::Light(light, property)) => {
                    let list = root.extensions.lights.as_ref().map_or(&[][..], |extension| &extension.lights);
                    let animated = item(list, light, "lights").place(at)?;
                    let targets = nodes_of_lights.get(&light).map(Vec::as_slice);
                    if property != Property::LightRange && targets.is_some() {
                        lights.insert(light, animated);
                    }
                    (targets, property)
                }
                Err(kind) => {
                    notes.add(kind);
                    continue;
                }
            };
            // Nodes of other scenes are not shown.
            let Some(targets) = targets else { continue };
            let width = property.width().unwrap_or_else(|| target_count(root, nodes[targets[0]].node));
            if width == 0 {
                notes.add("animated weights of nodes without morph targets");
                continue;
            }
            let sampler = item(&source.samplers, channel.sampler, "samplers").place(at)?;
            let sources = accessors.source(sampler.input).zip(accessors.source(sampler.output));
            let key = sources.map(|sources| (sources, sampler.interpolation.as_str(), width));
            let existing = key.as_ref().and_then(|key| shared.get(key).cloned());
            let sampler = match existing {
                Some(sampler) => sampler,
                None => Arc::new(sampler_of(accessors, sampler, width, budget).place(at)?),
            };
            if let Some(key) = key {
                shared.insert(key, sampler.clone());
            }
            if matches!(property, Property::LightColor | Property::LightIntensity | Property::LightRange) {
                let need = BYTES_PER_LIGHT_CHANNEL * targets.len() as u64;
                budget.take(need, || format!("channels of {} lights need", targets.len()))?;
            }
            channels.extend(targets.iter().map(|node| Channel { node: *node, property, sampler: sampler.clone() }));
        }
        let constants = lights.into_iter().flat_map(|(index, light)| {
            let (color, intensity) = (light.color.unwrap_or([1.0; 3]), light.intensity.unwrap_or(1.0));
            let constant = |node: &usize, property, values: &[f32]| {
                let sampler = Sampler { interpolation: Interpolation::Step, times: vec![0.0], values: values.to_vec() };
                Channel { node: *node, property, sampler: Arc::new(sampler) }
            };
            nodes_of_lights[&index].iter().flat_map(move |node| {
                [constant(node, Property::LightColor, &color), constant(node, Property::LightIntensity, &[intensity])]
            })
        });
        // A light's intensity is the product of the two. Later channels of a property take precedence.
        channels.splice(0..0, constants.collect::<Vec<_>>());
        animations.push(Animation { name: source.name.clone(), channels });
    }
    Ok(animations)
}

/// The indices into `nodes` of the nodes with each light of `KHR_lights_punctual`.
fn nodes_of_lights(nodes: &[Placed]) -> HashMap<usize, Vec<usize>> {
    let mut nodes_of_lights: HashMap<usize, Vec<usize>> = HashMap::new();
    for (node, at) in nodes.iter().enumerate().filter(|(_, at)| at.is_visible) {
        if let Some(light) = &at.node.extensions.light {
            nodes_of_lights.entry(light.light).or_default().push(node);
        }
    }
    nodes_of_lights
}

fn sampler_of(
    accessors: &Accessors,
    source: &schema::AnimationSampler,
    width: usize,
    budget: &Budget,
) -> Result<Sampler> {
    let interpolation = match source.interpolation.as_str() {
        "STEP" => Interpolation::Step,
        "LINEAR" => Interpolation::Linear,
        "CUBICSPLINE" => Interpolation::CubicSpline,
        other => return Err(invalid(format!("interpolation {other:?} is not one of the format's"))),
    };
    for accessor in [source.input, source.output] {
        let count = item(&accessors.root.accessors, accessor, "accessors")?.count as u64;
        budget.take(count.saturating_mul(16), || format!("{count} keyframes need"))?;
    }
    let times: Vec<f32> = accessors.vectors::<1>(source.input).place(|| "input".into())?.concat();
    let values = match item(&accessors.root.accessors, source.output, "accessors")?.shape.as_str() {
        "SCALAR" => accessors.vectors::<1>(source.output).map(|list| list.concat()),
        "VEC3" => accessors.vectors::<3>(source.output).map(|list| list.concat()),
        _ => accessors.vectors::<4>(source.output).map(|list| list.concat()),
    };
    let values = values.place(|| "output".into())?;
    if times.is_empty() || !times.iter().all(|time| time.is_finite()) || !times.is_sorted() {
        return Err(invalid("input: times must be finite and ascending, and there must be at least one"));
    }
    let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let needed = times.len().saturating_mul(parts * width);
    if values.len() != needed || !values.iter().all(|value| value.is_finite()) {
        let count = values.len();
        return Err(invalid(format!("output: {count} numbers where {needed} are needed, or one is not finite")));
    }
    Ok(Sampler { interpolation, times, values })
}
