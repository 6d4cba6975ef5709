//! Spherical harmonics, their kernels, and the rays of a probe, against integrals in double precision.

use glam::DVec3;
use lanternfish_gpu::{Gpu, ShaderLibrary, testing::Memory};
use lanternfish_reference::reflector;

use crate::{
    indirect::sampled::{PROBES, SampledParameters},
    testing::{edited_library, library},
    view::View,
};

use super::*;

/// A device and the shaders that it runs.
type On<'a> = (&'a Gpu, &'a ShaderLibrary);

/// Runs an entry point of `testing/screen_probes`; `each`: vectors of a query and of its answer.
fn evaluate(on: On, entry: &str, rays: u32, queries: &[Vec4], each: [usize; 2]) -> Vec<Vec4> {
    evaluate_at(on, entry, (rays, &[]), queries, each)
}

/// The same with bright spots: the middle and the radius of each, and its light, nit m²; beside a mean of 1 nit.
fn evaluate_at(
    (gpu, library): On,
    entry: &str,
    (rays, spots): (u32, &[[Vec4; 2]]),
    queries: &[Vec4],
    each: [usize; 2],
) -> Vec<Vec4> {
    let shader = library.link("testing/screen_probes", &[PROBES]).unwrap_or_else(|error| panic!("{error}"));
    let count = queries.len() / each[0];
    let mut memory = Memory::new();
    memory.bind(&["queries"], queries);
    memory.bind(&["answers"], &vec![Vec4::ZERO; count * each[1]]);
    memory.bind(&["sampled"], &[SampledParameters { diffuse_rays: rays, ..Default::default() }]);
    memory.bind(&["view"], &[View::default()]);
    let head = [Vec4::new(f32::from_bits(spots.len() as u32), 1.0, 0.0, 0.0)];
    let listed: Vec<Vec4> = head.into_iter().chain(spots.iter().flatten().copied()).collect();
    memory.bind(&["bright_spots"], &[listed, vec![Vec4::ZERO; 64]].concat()[..65]);
    memory.run_on(gpu, &shader, entry, [count.div_ceil(64) as u32, 1, 1]);
    memory.get("answers")
}

/// Real spherical harmonics up to order 2, from their definition.
fn basis(d: DVec3) -> [f64; 9] {
    let pi = std::f64::consts::PI;
    let [first, second] = [(0.75 / pi).sqrt(), 0.5 * (15.0 / pi).sqrt()];
    [
        0.5 / pi.sqrt(),
        first * d.y,
        first * d.z,
        first * d.x,
        second * d.x * d.y,
        second * d.y * d.z,
        0.25 * (5.0 / pi).sqrt() * (3.0 * d.z * d.z - 1.0),
        second * d.x * d.z,
        0.5 * second * (d.x * d.x - d.y * d.y),
    ]
}

/// Directions of the sphere with equal solid angles, and that angle, sr.
fn sphere() -> (Vec<DVec3>, f64) {
    let (rows, columns) = (128, 256);
    let at = |i: usize| {
        let z = 2.0 * ((i / columns) as f64 + 0.5) / rows as f64 - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * ((i % columns) as f64 + 0.5) / columns as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    };
    ((0..rows * columns).map(at).collect(), 4.0 * std::f64::consts::PI / (rows * columns) as f64)
}

/// Radiance as harmonics.
fn projected(radiance: impl Fn(DVec3) -> DVec3) -> [DVec3; 9] {
    let (directions, angle) = sphere();
    let mut sums = [DVec3::ZERO; 9];
    for d in directions {
        let light = angle * radiance(d);
        sums.iter_mut().zip(basis(d)).for_each(|(sum, b)| *sum += b * light);
    }
    sums
}

/// Integral of radiance times a kernel of the cosine to an axis.
fn integral(radiance: impl Fn(DVec3) -> DVec3, axis: DVec3, kernel: impl Fn(f64) -> f64) -> DVec3 {
    let (directions, angle) = sphere();
    directions.into_iter().map(|d| angle * kernel(d.dot(axis)) * radiance(d)).sum()
}

const CLAMPED_COSINE: Vec3 = Vec3::new(1.0, 2.0 / 3.0, 0.25);

/// Checks that the convolution of three smooth distributions of radiance with the clamped cosine is their irradiance over pi.
fn irradiance_is_exact(on: On) -> Result<(), String> {
    let mut random = Random::new(2);
    let (mut queries, mut expected) = (Vec::new(), Vec::new());
    for _ in 0..24 {
        let [a, b, axis] = [(); 3].map(|()| random.direction().as_dvec3());
        // Of orders 0 to 2: exactly represented.
        let radiance = |d: DVec3| DVec3::new(1.0, 1.0 + d.dot(a), 0.3 + d.dot(a) * d.dot(b) + d.dot(b) * d.dot(b));
        queries.extend(projected(radiance).map(|c| c.as_vec3().extend(0.0)));
        queries.extend([axis.as_vec3().extend(0.0), CLAMPED_COSINE.extend(0.0)]);
        expected.push(integral(radiance, axis, |cosine| cosine.max(0.0) / std::f64::consts::PI));
    }
    let answers = evaluate(on, "convolutions", 1, &queries, [11, 1]);
    let apart = answers.iter().zip(&expected).map(|(a, b)| (a.truncate().as_dvec3() - *b).abs().max_element());
    match apart.fold(0.0, f64::max) {
        // The step of the integral's directions.
        most if most < 1e-3 => Ok(()),
        most => Err(format!("off by {most}")),
    }
}

#[gpu_test]
fn gpu_harmonics_give_the_irradiance_of_smooth_radiance(gpu: &Gpu) {
    irradiance_is_exact((gpu, &library())).unwrap();
    let module = "indirect/sampled/probes/spherical_harmonics";
    for (text, by) in [("0.48860251 * d.y", "0.48 * d.y"), ("d.y * d.z", "d.x * d.z"), ("3.0 * d.z * d.z - 1.0", "d.z")]
    {
        assert!(irradiance_is_exact((gpu, &edited_library(module, text, by))).is_err(), "blind to {by}");
    }
}

/// Factors of the clamped cosine times the grazing fraction, for surfaces of every roughness, against a sum over cosines. Largest error, over the first factor.
fn off_of_factors(on: On) -> f64 {
    let steps = 256;
    let mut most: f64 = 0.0;
    for alpha in [1e-4f32, 0.01, 0.04, 0.2, 0.5, 1.0] {
        let cosine = |i: usize| (i as f32 + 0.5) / steps as f32;
        let queries: Vec<Vec4> = (0..steps).map(|i| Vec4::new(alpha, cosine(i), 0.0, 0.0)).collect();
        let answers = evaluate(on, "factors", 1, &queries, [1, 1]);
        let mut sums = DVec3::ZERO;
        for (i, answer) in answers.iter().enumerate() {
            let c = f64::from(cosine(i));
            let legendre = DVec3::new(1.0, c, 1.5 * c * c - 0.5);
            sums += 2.0 / steps as f64 * c * f64::from(answer.w) * legendre;
        }
        let actual = answers[0].truncate().as_dvec3();
        most = most.max((actual - sums).abs().max_element() / sums.x);
    }
    most
}

#[gpu_test]
fn gpu_grazing_factors_are_integrals(gpu: &Gpu) {
    let most = off_of_factors((gpu, &library()));
    assert!(most < 1e-3, "{most}");
    let module = "indirect/sampled/probes/interpolate";
    for (text, by) in [("1.5 * m2 - 0.5 * m0", "1.5 * m2"), ("3.0 * m1", "2.0 * m1"), ("(p + 3.0)", "(p + 4.0)")] {
        assert!(off_of_factors((gpu, &edited_library(module, text, by))) > 0.01, "blind to {by}");
    }
}

/// Of the glossy lobe of a white metal, by sums over directions: its total, the parts of its mean direction along the surface and along the normal, and the
/// mean second Legendre polynomial about that direction.
fn lobe(alpha: f64, n_dot_v: f64) -> [f64; 4] {
    let metal = reflector(&Material::default(), DVec3::ONE, 1.0, alpha.sqrt(), true);
    let wo = DVec3::new((1.0 - n_dot_v * n_dot_v).sqrt(), 0.0, n_dot_v);
    let (directions, angle) = sphere();
    let weigh = |wi: DVec3| (angle * metal.specular(DVec3::Z, wi, wo).x * wi.z, wi);
    let weighted: Vec<(f64, DVec3)> = directions.into_iter().filter(|wi| wi.z > 0.0).map(weigh).collect();
    let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
    let mean = weighted.iter().map(|(weight, wi)| *weight * *wi).sum::<DVec3>() / total;
    let legendre = |wi: DVec3| 1.5 * wi.dot(mean.normalize()).powi(2) - 0.5;
    let second = weighted.iter().map(|(weight, wi)| weight * legendre(*wi)).sum::<f64>() / total;
    [total, mean.x, mean.z, second]
}

/// Largest errors of the fitted glossy lobe: of its total, of the angle between its axis and the lobe's mean direction, and of its factors.
fn off_of_lobes(on: On) -> [f32; 4] {
    let views = [0.15f32, 0.4, 0.7, 0.95];
    let of_alpha = |alpha: f32| views.map(|n_dot_v| Vec4::new(alpha, n_dot_v, 0.0, 0.0));
    // Perceptual roughness of 0.6 to 1.
    let queries: Vec<Vec4> = [0.36, 0.5, 0.7, 1.0].into_iter().flat_map(of_alpha).collect();
    let answers = evaluate(on, "lobes", 1, &queries, [1, 1]);
    let mut most = [0.0f32; 4];
    for (query, fit) in queries.iter().zip(answers) {
        let [total, x, z, second] = lobe(query.x.into(), query.y.into()).map(|part| part as f32);
        let (sine, cosine) = ((1.0 - query.y * query.y).sqrt(), query.y);
        let (fit_x, fit_z) = (-fit.y * sine, 1.0 - fit.y + fit.y * cosine);
        let angle = (fit_x.atan2(fit_z) - x.atan2(z)).abs();
        let off = [fit.x - total, angle, fit.z - x.hypot(z), fit.w - second];
        most.iter_mut().zip(off).for_each(|(most, off)| *most = most.max(off.abs()));
    }
    most
}

#[gpu_test]
fn gpu_glossy_lobes_of_rough_surfaces_are_integrals(gpu: &Gpu) {
    let most = off_of_lobes((gpu, &library()));
    println!("off by {most:.3?}");
    let limits = [0.045, 0.04, 0.04, 0.06];
    assert!(most.iter().zip(limits).all(|(most, limit)| *most < limit), "{most:?}");
    let module = "indirect/sampled/probes/glossy_lobe";
    for (i, text, by) in [(0, "0.8312", "0.9"), (1, "0.7445", "0.9"), (2, "0.9501", "1.0"), (3, "0.8962", "1.0")] {
        let most = off_of_lobes((gpu, &edited_library(module, text, by)));
        assert!(most[i] > limits[i], "blind to {by}: {most:?}");
    }
}

/// A ray of a probe: its direction; its weights as radiance and as irradiance over pi.
fn rays(on: On, spots: &[[Vec4; 2]], normal: Vec3, shift: [f32; 2], count: u32) -> Vec<(Vec3, [f64; 2])> {
    let queries: Vec<Vec4> =
        (0..count).flat_map(|i| [normal.extend(i as f32), Vec4::new(shift[0], shift[1], 0.0, 0.0)]).collect();
    let answers = evaluate_at(on, "rays", (count, spots), &queries, [2, 2]);
    let of = |answer: &[Vec4]| {
        assert!((answer[0].truncate().length() - 1.0).abs() < 1e-5, "{answer:?}");
        (answer[0].truncate(), [answer[1].x, answer[1].y].map(f64::from))
    };
    answers.chunks(2).map(of).collect()
}

/// Largest error of the rays' distribution and weights: of the number of rays below each cosine, of the weights to the density of that distribution, and of
/// the light of a white hemisphere.
fn off_of_rays(on: On) -> f64 {
    let (count, uniform, pi) = (1024, 0.25, std::f64::consts::PI);
    let mut most: f64 = 0.0;
    for (normal, shift) in [(Vec3::Y, [0.1, 0.7]), (Vec3::new(-0.6, 0.0, -0.8), [0.9, 0.3])] {
        let rays = rays(on, &[], normal, shift, count);
        let rays: Vec<_> = rays.into_iter().map(|(to, weights)| (f64::from(to.dot(normal)), weights)).collect();
        let of_all = |sum: f64| sum / f64::from(count);
        for cosine in [0.05, 0.2, 0.5, 0.8, 0.95] {
            let below = rays.iter().filter(|(own, _)| *own < cosine).count() as f64;
            most = most.max((of_all(below) - (1.0 - uniform) * cosine * cosine - uniform * cosine).abs());
        }
        for (cosine, [radiance, irradiance]) in &rays {
            let density = (2.0 * (1.0 - uniform) * cosine + uniform) / (2.0 * pi);
            most = most.max((of_all(1.0 / density) / radiance - 1.0).abs());
            most = most.max((irradiance - radiance * cosine / pi).abs() * f64::from(count));
        }
        // Solid angle of the hemisphere, and irradiance over pi of constant radiance.
        let total = |i: usize| rays.iter().map(|(_, weights)| weights[i]).sum::<f64>();
        most = most.max((total(0) / (2.0 * pi) - 1.0).abs()).max((total(1) - 1.0).abs());
    }
    most
}

/// Rays leave in proportion to a mixture of the cosine and a constant; weights are over that density.
#[gpu_test]
fn gpu_rays_of_probes_follow_their_density(gpu: &Gpu) {
    let most = off_of_rays((gpu, &library()));
    // The discrepancy of as many points.
    assert!(most < 5e-3, "{most}");
    let module = "indirect/sampled/probes/aim";
    for (text, by) in
        [("1.0 / density", "1.01 / density"), ("+ 4.0 * (1.0 - UNIFORM) * u)", "+ 3.8 * (1.0 - UNIFORM) * u)")]
    {
        assert!(off_of_rays((gpu, &edited_library(module, text, by))) > 6e-3, "blind to {by}");
    }
}

/// Largest error of rays of which a part is aimed at two spots, one of them near: of the light of a white hemisphere, and of the solid angle of the far one.
fn off_of_aimed_rays(on: On) -> f64 {
    let pi = std::f64::consts::PI;
    let far = Vec3::new(0.6, 0.8, 0.0);
    let spots = [[(4.0 * far).extend(0.5), Vec4::X * 60.0], [Vec3::new(-0.2, 0.3, 0.4).extend(0.3), Vec4::X * 0.5]];
    let rays = rays(on, &spots, Vec3::Y, [0.1, 0.7], 4096);
    let cosine = (1.0 - 1.0 / 64.0f64).sqrt();
    let within: Vec<_> = rays.iter().filter(|(to, _)| f64::from(to.dot(far)) > cosine).collect();
    assert!(within.len() > 600, "{} rays are aimed", within.len());
    let of = |rays: &mut dyn Iterator<Item = &f64>, expected: f64| (rays.sum::<f64>() / expected - 1.0).abs();
    let all = of(&mut rays.iter().map(|(_, [radiance, _])| radiance), 2.0 * pi);
    let angle = of(&mut within.iter().map(|(_, [radiance, _])| radiance), 2.0 * pi * (1.0 - cosine));
    all.max(angle).max(of(&mut rays.iter().map(|(_, [_, irradiance])| irradiance), 1.0))
}

/// Rays aimed at bright spots keep the light of all directions.
#[gpu_test]
fn gpu_rays_aimed_at_bright_spots_are_weighted(gpu: &Gpu) {
    let most = off_of_aimed_rays((gpu, &library()));
    assert!(most < 0.02, "{most}");
    let module = "indirect/sampled/probes/spot_list";
    for (text, by) in
        [("(1.0 - aim.part) * others", "others"), ("2.0 * PI * (1.0 - cone.cosine)", "6.0 * (1.0 - cone.cosine)")]
    {
        let most = off_of_aimed_rays((gpu, &edited_library(module, text, by)));
        assert!(most > 0.03, "blind to {by}: {most}");
    }
}

/// Sums over rays are the harmonics of the hemisphere's radiance, its irradiance, and the mean nearness of what is there; also of radiance that is not smooth.
#[gpu_test]
fn gpu_sums_over_rays_are_harmonics_of_the_hemisphere(gpu: &Gpu) {
    let rays = 2048;
    let mut random = Random::new(5);
    let cases: Vec<[Vec3; 2]> = (0..6).map(|_| [random.direction(), random.direction()]).collect();
    let shift = |i: usize| Vec4::new(0.13 * i as f32, 0.37, 0.0, 0.0);
    let queries: Vec<Vec4> =
        (0..cases.len()).flat_map(|i| [cases[i][0].extend(0.0), shift(i), cases[i][1].extend(0.0)]).collect();
    let answers = evaluate((gpu, &library()), "sums", rays, &queries, [3, 9]);
    for ([normal, axis], sums) in cases.iter().zip(answers.chunks(9)) {
        let (normal, axis) = (normal.as_dvec3(), axis.as_dvec3());
        let radiance = |d: DVec3| {
            let along = d.dot(axis);
            if d.dot(normal) > 0.0 {
                DVec3::new(1.0, 1.0 + along, f64::from(u8::from(along > 0.0)))
            } else {
                DVec3::ZERO
            }
        };
        let expected = projected(radiance);
        for (i, (sum, expected)) in sums.iter().zip(expected).enumerate() {
            let off = (sum.truncate().as_dvec3() - expected).abs().max_element();
            assert!(off < 0.02, "coefficient {i}: {sum}, not {expected}");
        }
        let irradiance = integral(radiance, normal, |cosine| cosine.max(0.0) / std::f64::consts::PI);
        let actual = DVec3::new(sums[1].w.into(), sums[2].w.into(), sums[3].w.into());
        assert!((actual - irradiance).abs().max_element() < 0.01, "irradiance {actual}, not {irradiance}");
        assert!((sums[0].w - 0.5).abs() < 1e-3, "nearness {}", sums[0].w);
        assert!(sums[4..].iter().all(|sum| sum.w == 0.0));
    }
}
