//! The tree that the device builds, read back and compared with the lights in double precision.

use glam::DVec3;
use lanternfish_gpu::read_back;
use lanternfish_scene::shading::UNBOUNDED;

use super::*;

/// The nodes of a tree on the device, and how they are laid out.
pub fn nodes_of(gpu: &Gpu, trees: &SceneLightTrees) -> Vec<LightNode> {
    let layout = trees.layout;
    let count = (layout.first_sun + layout.sun_count) as usize;
    let nodes: Vec<LightNode> = read_back(&gpu.device, &gpu.queue, &trees.nodes, count).unwrap();
    nodes[layout.first_light as usize..layout.first_sun as usize].to_vec()
}

pub fn bound_of(node: &LightNode) -> Bound {
    let low = |bits: u32| f32::from_bits(bits << 16);
    let high = |bits: u32| f32::from_bits(bits & 0xffff_0000);
    let [x, y, z, w] = node.cone.to_le_bytes().map(|byte| f32::from(byte as i8) / 127.0);
    Bound {
        center: node.center,
        half: Vec3::new(low(node.half_xy), high(node.half_xy), low(node.half_z_and_spread)),
        power: low(node.power_and_range),
        inverse_range: high(node.power_and_range),
        axis: Vec3::new(x, y, z),
        cos_reach: w,
        sin_spread: high(node.half_z_and_spread),
    }
}

/// Probability of each leaf of a tree; 0 also of leaves without a light.
pub fn chances(bounds: &[Bound], receiver: &Receiver) -> Vec<f64> {
    let inner = bounds.len() / 2;
    let mut chances = vec![1.0; bounds.len()];
    for i in 0..inner {
        let of = |child: usize| f64::from(bounds[child].importance(receiver));
        let (first, second) = (of(2 * i + 1), of(2 * i + 2));
        let sum = first + second;
        let fraction = if sum > 0.0 { [first / sum, second / sum] } else { [0.0; 2] };
        chances[2 * i + 1] = chances[i] * fraction[0];
        chances[2 * i + 2] = chances[i] * fraction[1];
    }
    let leaf = |i: usize| if bounds[i].power > 0.0 { chances[i] } else { 0.0 };
    (inner..bounds.len()).map(leaf).collect()
}

/// Half the size of a light's box, m.
fn half_of(light: &Light) -> DVec3 {
    let normal = light.direction.as_dvec3();
    match light.kind {
        LightKind::Disk { radius } => {
            f64::from(radius) * DVec3::new(normal.y.hypot(normal.z), normal.z.hypot(normal.x), normal.x.hypot(normal.y))
        }
        LightKind::Rectangle { half_width, half_height, right } => {
            let right = right.as_dvec3();
            f64::from(half_width) * right.abs() + f64::from(half_height) * right.cross(normal).abs()
        }
        _ => DVec3::ZERO,
    }
}

/// What is wrong with a tree: each light is in one leaf, and in the bounds of all nodes above.
fn fault(lights: &[Light], nodes: &[LightNode]) -> Result<(), String> {
    let bounds: Vec<Bound> = nodes.iter().map(bound_of).collect();
    let leaf_count = nodes.len().div_ceil(2);
    let first_leaf = nodes.len() - leaf_count;
    let leaves = (first_leaf..nodes.len()).filter(|i| bounds[*i].power > 0.0);
    let mut listed: Vec<u32> = leaves.clone().map(|i| nodes[i].link).collect();
    listed.sort_unstable();
    let expected = lights.iter().zip(0..).filter(|(light, _)| is_in_tree(light)).map(|(_, i)| i);
    if !listed.iter().copied().eq(expected) {
        return Err(format!("{} leaves do not list every light once", listed.len()));
    }
    let (mut powers, mut counts) = (vec![0.0f64; nodes.len()], vec![0u32; nodes.len()]);
    for leaf in leaves {
        let light = &lights[nodes[leaf].link as usize];
        let emitter = Emitter::of_light(light, light.range.unwrap(), 0.0);
        let (center, half) = (light.position.as_dvec3(), half_of(light));
        let mut index = leaf;
        loop {
            let (bound, node) = (&bounds[index], index);
            let about = |what: &str| Err(format!("{what} of node {node}: {bound:?}, {light:?}"));
            powers[index] += f64::from(emitter.power);
            counts[index] += 1;
            // Corners are floats: half a unit in the last place.
            let rounding = 6e-8 * (center.abs() + half) * f64::from(u8::from(half != DVec3::ZERO));
            let beyond = (bound.center.as_dvec3() - center).abs() + half - rounding - bound.half.as_dvec3();
            if beyond.max_element() > 0.0 {
                return about("box");
            }
            if f64::from(bound.inverse_range) * f64::from(emitter.range) > 1.0 + 1e-6 {
                return about("range");
            }
            if bound.cos_reach > emitter.cone.cos_reach.max(0.0) + 1e-6 {
                return about("reach");
            }
            let is_cone = emitter.cone.cos_spread > 0.0;
            let axis = bound.axis.as_dvec3();
            let aside = axis.cross(light.direction.as_dvec3()).length() - f64::from(bound.sin_spread);
            let is_aside = is_cone && (aside > 1e-7 || axis.dot(light.direction.as_dvec3()) <= 0.0);
            if bound.sin_spread < 1.0 && (!is_cone || is_aside) {
                return about("cone");
            }
            if index == 0 {
                break;
            }
            index = (index - 1) / 2;
        }
    }
    for (i, bound) in bounds.iter().enumerate() {
        if f64::from(bound.power) < powers[i].min(1e20) {
            return Err(format!("power of node {i}: {bound:?} for {}", powers[i]));
        }
        if counts[i] == 0 && (bound.power, bound.half, bound.sin_spread) != (0.0, Vec3::ZERO, 1.0) {
            return Err(format!("padding {i}: {bound:?}"));
        }
        for child in [2 * i + 1, 2 * i + 2] {
            let Some(below) = bounds.get(child) else { continue };
            let holds = bound.power >= below.power;
            let reaches = bound.inverse_range <= below.inverse_range && bound.cos_reach <= below.cos_reach;
            let spreads = bound.sin_spread >= below.sin_spread;
            // Halves are rounded up by one part in 128 at most.
            let out = (bound.center - below.center).abs() + below.half * (1.0 - 1.0 / 127.0) - bound.half;
            let is_held = out.max_element() <= 1e-6 * bound.center.abs().max_element();
            if counts[child] > 0 && !(holds && reaches && spreads && is_held) {
                return Err(format!("node {i} {bound:?} does not hold {child} {below:?}"));
            }
        }
    }
    Ok(())
}

/// All kinds of lights; some do not shine, some point the same way, and some are very bright or have no end.
pub fn mixed(random: &mut Random, count: usize) -> Vec<Light> {
    let light = |i: usize| {
        let position = 40.0 * random.point() * Vec3::new(1.0, 0.1, 0.6);
        let aligned = (Vec3::NEG_Y + 0.3 * random.point()).normalize();
        let direction = if i.is_multiple_of(3) { random.direction() } else { aligned };
        let kind = match i % 5 {
            0 | 1 => LightKind::Spot { inner_angle: 0.1, outer_angle: random.between(0.2, 1.5) },
            2 => LightKind::Disk { radius: random.between(0.1, 1.0) },
            3 => {
                let right = direction.any_orthonormal_vector();
                LightKind::Rectangle { half_width: random.between(0.1, 2.0), half_height: 0.3, right }
            }
            _ if i % 50 == 4 => LightKind::Directional,
            _ => LightKind::Point,
        };
        let power = match i {
            _ if i % 17 == 3 => Vec3::ZERO,
            77 => Vec3::splat(1e25),
            _ => random.point() + 1.5,
        };
        let range = if i == 90 { f32::INFINITY } else { random.between(2.0, 9.0) };
        Light { kind, direction, range: Some(range), ..Light::point(position, power) }
    };
    (0..count).map(light).collect()
}

/// True if light of the centre arrives.
fn arrives(light: &Light, receiver: &Receiver) -> bool {
    let towards = (light.position - receiver.p).as_dvec3();
    let wi = towards.normalize();
    let forwards = -wi.dot(light.direction.as_dvec3());
    let leaves = match light.kind {
        LightKind::Spot { outer_angle, .. } => forwards > f64::from(outer_angle.cos()),
        LightKind::Disk { .. } | LightKind::Rectangle { .. } => forwards > 0.0,
        _ => true,
    };
    is_in_tree(light)
        && leaves
        && wi.dot(receiver.normal.as_dvec3()) > 0.0
        && towards.length() < f64::from(light.range.unwrap())
}

#[gpu_test]
fn gpu_the_tree_holds_every_light(gpu: &Gpu) {
    let mut random = Random::new(31);
    for count in [0, 1, 2, 3, 5, 257, 1000, 65_537] {
        let lights = mixed(&mut random, count);
        let trees = trees_of(gpu, &lights, Vec::new());
        let nodes = nodes_of(gpu, &trees);
        let placed = lights.iter().filter(|light| is_in_tree(light)).count();
        assert_eq!(trees.layout.light_count as usize, placed);
        assert!(placed > 0 && nodes.len() < (8 * placed).max(2) || nodes.is_empty(), "{placed}: {} nodes", nodes.len());
        fault(&lights, &nodes).unwrap_or_else(|what| panic!("{count}: {what}"));
        // Leaves of points and spots are the host's to the bit.
        for node in &nodes[nodes.len() / 2..] {
            let light = &lights[node.link as usize];
            if !is_in_tree(light) || light.area().is_some() || bound_of(node).power == 0.0 {
                continue;
            }
            let alone = LightTree::new(&[Emitter::of_light(light, light.range.unwrap(), 0.0)]);
            assert_eq!(*node, packed(&alone, |_| node.link)[0], "{count}: {light:?}");
        }
        // A light that reaches a point has a probability.
        let bounds: Vec<Bound> = nodes.iter().map(bound_of).collect();
        let mut reached = 0;
        for _ in 0..if count > 1000 { 8 } else { 200 } {
            let p = 40.0 * random.point() * Vec3::new(1.0, 0.1, 0.6);
            let receiver = Receiver { p, normal: random.direction(), is_transmitting: false };
            let chances = if placed == 0 { Vec::new() } else { chances(&bounds, &receiver) };
            assert!(chances.iter().sum::<f64>() < 1.0 + 1e-9);
            for (chance, node) in chances.iter().zip(&nodes[nodes.len() / 2..]) {
                let light = &lights[node.link as usize];
                let is_reached = bound_of(node).power > 0.0 && arrives(light, &receiver);
                assert!(!is_reached || *chance > 0.0, "{count}: {light:?} at {receiver:?}");
                reached += usize::from(is_reached);
            }
        }
        assert!(count < 257 || reached > 50, "{count}: {reached} reach");
    }
}

#[gpu_test]
fn gpu_the_chances_of_lights_without_end_sum_to_one(gpu: &Gpu) {
    let mut random = Random::new(32);
    for count in [1, 2, 3, 300] {
        let mut light = || Light { range: Some(UNBOUNDED), ..Light::point(random.point(), Vec3::ONE) };
        let lights: Vec<Light> = (0..count).map(|_| light()).collect();
        let bounds: Vec<Bound> = nodes_of(gpu, &trees_of(gpu, &lights, Vec::new())).iter().map(bound_of).collect();
        for _ in 0..20 {
            let receiver = Receiver { p: 2.0 * random.point(), normal: random.direction(), is_transmitting: true };
            let sum: f64 = chances(&bounds, &receiver).iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "{count}: {sum}");
        }
    }
}

/// Lights in one place keep their order; the list of directional lights and the triangles stay where they are.
#[gpu_test]
fn gpu_moved_lights_give_the_tree_of_a_new_upload(gpu: &Gpu) {
    let mut random = Random::new(33);
    let all = |trees: &SceneLightTrees| {
        let count = (trees.layout.first_sun + trees.layout.sun_count) as usize;
        (trees.layout, read_back::<LightNode>(&gpu.device, &gpu.queue, &trees.nodes, count).unwrap())
    };
    let triangles = triangles(&mut random);
    let before = mixed(&mut random, 700);
    let mut moved = before.clone();
    moved.iter_mut().for_each(|light| light.position += random.point());
    let fewer = mixed(&mut random, 90);
    let one_place: Vec<Light> = vec![Light { range: Some(2.0), ..Light::point(Vec3::ONE, Vec3::ONE) }; 300];
    let mut trees = trees_of(gpu, &before, triangles.clone());
    let first = all(&trees);
    for lights in [&moved, &fewer, &one_place, &Vec::new(), &before] {
        trees.update_lights(&gpu.device, &gpu.queue, &set_of(gpu, lights)).unwrap();
        let (now, fresh) = (all(&trees), all(&trees_of(gpu, lights, triangles.clone())));
        assert_eq!(now, fresh, "{} lights", lights.len());
        assert_eq!(now.1[..511], first.1[..511], "triangles");
        let suns: Vec<u32> = now.1[now.0.first_sun as usize..].iter().map(|node| node.link).collect();
        let expected = lights
            .iter()
            .zip(0..)
            .filter(|(light, _)| crate::lights::Light::new(light, &Settings::default().light_storage()).is_sun());
        assert!(suns.iter().copied().eq(expected.map(|(_, i)| i)), "{suns:?}");
        assert!(now != first || *lights == before);
    }
    assert_eq!(all(&trees), first, "the same lights give the same bytes");
    trees.update_lights(&gpu.device, &gpu.queue, &set_of(gpu, &one_place)).unwrap();
    let nodes = nodes_of(gpu, &trees);
    fault(&one_place, &nodes).unwrap();
    let links = nodes[nodes.len() / 2..].iter().filter(|node| bound_of(node).power > 0.0).map(|node| node.link);
    assert!(links.eq(0..300), "equal keys keep the order of the lights");
}

/// Bounds that are one unit in the last place too small, and a light in two leaves, are found.
#[gpu_test]
fn gpu_the_checks_of_the_tree_can_fail(gpu: &Gpu) {
    let lights = mixed(&mut Random::new(34), 60);
    let nodes = nodes_of(gpu, &trees_of(gpu, &lights, Vec::new()));
    type Edit = fn(&mut [LightNode]);
    let edits: [(&str, Edit); 6] = [
        ("box", |nodes| nodes[0].half_xy -= 1),
        ("power", |nodes| nodes[0].power_and_range -= 1),
        ("range", |nodes| nodes[0].power_and_range += 1 << 16),
        ("cone", |nodes| nodes[0].half_z_and_spread -= 1 << 16),
        ("reach", |nodes| nodes[0].cone += 1 << 24),
        ("list", |nodes| nodes[nodes.len() / 2].link = nodes[nodes.len() / 2 + 1].link),
    ];
    for (what, edit) in edits {
        let mut edited = nodes.clone();
        edit(&mut edited);
        let found = fault(&lights, &edited);
        println!("{what}: {found:?}");
        assert!(found.is_err(), "{what}");
    }
}
