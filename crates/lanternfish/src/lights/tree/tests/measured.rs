//! How good the device's tree is beside the host's.

use super::{
    built::{bound_of, chances, nodes_of},
    *,
};

/// Mean over nine tenths of the receivers of the variance of one choice, f / p, relative to the square of the light that arrives; f is the cosine over the
/// squared distance.
fn variance(lights: &[Light], nodes: &[LightNode], receivers: &[Receiver]) -> f64 {
    let bounds: Vec<Bound> = nodes.iter().map(bound_of).collect();
    let of = |receiver: &Receiver| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for (chance, node) in chances(&bounds, receiver).iter().zip(&nodes[nodes.len() / 2..]) {
            let towards = (lights[node.link as usize].position - receiver.p).as_dvec3();
            let f = towards.normalize().dot(receiver.normal.as_dvec3()).max(0.0) / towards.length_squared();
            if *chance > 0.0 {
                sum += f;
                squares += f * f / chance;
            }
        }
        (sum > 0.0).then(|| squares / (sum * sum) - 1.0)
    };
    let mut variances: Vec<f64> = receivers.iter().filter_map(of).collect();
    // Few receivers at the border that face away from nearly all lights would make up the mean.
    variances.sort_by(f64::total_cmp);
    variances.truncate(variances.len() * 9 / 10);
    variances.iter().sum::<f64>() / variances.len() as f64
}

fn host_nodes(lights: &[Light]) -> Vec<LightNode> {
    let emitters: Vec<Emitter> = lights.iter().map(|l| Emitter::of_light(l, l.range.unwrap(), 0.0)).collect();
    packed(&LightTree::new(&emitters), |i| i)
}

/// A cube, a street, groups, and a line with one light far away.
fn clouds(random: &mut Random) -> [(&'static str, Vec<Vec3>); 4] {
    let count = 0..3000;
    let cube = count.clone().map(|_| 10.0 * random.point()).collect();
    let street = count.clone().map(|_| random.point() * Vec3::new(100.0, 2.0, 8.0)).collect();
    let centers: Vec<Vec3> = (0..12).map(|_| 20.0 * random.point()).collect();
    let groups = count.clone().map(|i| centers[i % 12] + random.point()).collect();
    let line = count.map(|i| if i == 9 { Vec3::splat(500.0) } else { random.point() * Vec3::new(40.0, 1.0, 1.0) });
    [("cube", cube), ("street", street), ("groups", groups), ("line", line.collect())]
}

#[gpu_test]
fn gpu_the_tree_is_nearly_as_good_as_the_hosts(gpu: &Gpu) {
    let mut random = Random::new(35);
    for (name, positions) in clouds(&mut random) {
        let receivers: Vec<Receiver> = (0..200)
            .map(|i| Receiver {
                p: positions[i] + 0.5 * random.point(),
                normal: random.direction(),
                is_transmitting: false,
            })
            .collect();
        let light = |p: &Vec3| Light { range: Some(1e4), ..Light::point(*p, Vec3::ONE) };
        let lights: Vec<Light> = positions.iter().map(light).collect();
        let device = variance(&lights, &nodes_of(gpu, &trees_of(gpu, &lights, Vec::new())), &receivers);
        let host = variance(&lights, &host_nodes(&lights), &receivers);
        println!("{name}: variance {device:.3} of the device's tree, {host:.3} of the host's: {:.2}", device / host);
        assert!(device < 1.33 * host, "{name}: {device} and {host}");
    }
}
