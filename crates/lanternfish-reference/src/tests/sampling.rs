//! Chi-square tests of sampling routines against their densities.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lanternfish_scene::{Environment, Scene};

use crate::{
    Random,
    brdf::{Behind, Bsdf, Grain, Reflector, ScattersThrough, cosine_direction},
    layers::{Layers, Sheen},
    lights::Sky,
    statistics::chi_square,
};

const ROWS: usize = 16;
const COLUMNS: usize = 16;
/// Points per axis of a cell, over which densities are summed.
const FINE: usize = 24;

fn cell(wi: DVec3) -> usize {
    let row = ((wi.z + 1.0) / 2.0 * ROWS as f64) as usize;
    let column = ((wi.y.atan2(wi.x) / (2.0 * PI) + 0.5) * COLUMNS as f64) as usize;
    row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)
}

/// Probability of each cell under a density over solid angle.
fn fractions(pdf: &dyn Fn(DVec3) -> f64) -> Vec<f64> {
    let mut fractions = vec![0.0; ROWS * COLUMNS];
    for i in 0..ROWS * FINE {
        let z = 2.0 * (i as f64 + 0.5) / (ROWS * FINE) as f64 - 1.0;
        for j in 0..COLUMNS * FINE {
            let phi = 2.0 * PI * ((j as f64 + 0.5) / (COLUMNS * FINE) as f64 - 0.5);
            let wi = DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z);
            fractions[cell(wi)] += pdf(wi) * 4.0 * PI / (ROWS * FINE * COLUMNS * FINE) as f64;
        }
    }
    fractions
}

/// p-value of the hypothesis that `sample` (`None` for lost samples) follows `pdf`.
fn agreement(sample: &dyn Fn([f64; 3]) -> Option<DVec3>, pdf: &dyn Fn(DVec3) -> f64) -> f64 {
    let mut counts = vec![0; ROWS * COLUMNS + 1];
    for i in 0..100_000 {
        let mut random = Random::new(5, i, 0);
        match sample([random.unit(), random.unit(), random.unit()]) {
            Some(wi) => counts[cell(wi)] += 1,
            None => counts[ROWS * COLUMNS] += 1,
        }
    }
    let mut expected = fractions(pdf);
    let lost = (1.0 - expected.iter().sum::<f64>()).max(0.0);
    // The accuracy of the sum over points: smaller losses are indistinguishable from none.
    if lost < 2e-3 {
        assert!(counts[ROWS * COLUMNS] < 500, "{} samples are lost and {lost} should be", counts[ROWS * COLUMNS]);
        counts.pop();
    } else {
        expected.push(lost);
    }
    chi_square(&counts, &expected)
}

/// Minimum p-value. There are forty tests, so a minimum of 10⁻³ would fail one run of the suite in 25.
const LEAST_P: f64 = 1e-5;

#[test]
fn cosine_directions_follow_the_cosine() {
    let n = DVec3::new(0.3, -0.5, 0.8).normalize();
    let sample = |u: [f64; 3]| Some(cosine_direction(n, u[0], u[1]));
    let p = agreement(&sample, &|wi| n.dot(wi).max(0.0) / PI);
    assert!(p > LEAST_P, "{p}");
    // The check can fail: the density has a normal that is off by three degrees.
    let off = DVec3::new(0.35, -0.5, 0.8).normalize();
    assert!(agreement(&sample, &|wi| off.dot(wi).max(0.0) / PI) < 1e-12);
}

#[test]
fn every_lobe_is_sampled_with_its_density() {
    let n = DVec3::new(-0.4, 0.2, 0.9).normalize();
    let mut tested = 0;
    for behind in [Behind::Thin, Behind::Volume { eta: 1.5 }, Behind::Volume { eta: 1.0 / 1.5 }] {
        for (roughness, metallic, transmission) in [(0.5, 1.0, 0.0), (0.6, 0.0, 0.0), (0.7, 0.0, 1.0), (0.9, 0.3, 0.5)]
        {
            // From the front, oblique, and below the shading normal's horizon.
            for wo in [n, DVec3::new(0.9, 0.1, 0.6), DVec3::new(0.93, 0.0, 0.3)] {
                let wo = wo.normalize();
                let reflector = Reflector {
                    albedo: DVec3::splat(0.8 * (1.0 - metallic)),
                    f0: DVec3::splat(0.04 + 0.9 * metallic),
                    f90: 1.0,
                    perceptual_roughness: roughness,
                    grain: None,
                    transmission,
                    behind,
                    through: ScattersThrough::default(),
                };
                let grain = Grain { along: n.any_orthonormal_vector(), alpha: [0.9, roughness * roughness] };
                let grainy = Reflector { grain: Some(grain), ..reflector };
                let through = ScattersThrough { fraction: 0.6, albedo: DVec3::new(0.9, 0.5, 0.2) };
                let sheen = Some(Sheen { color: DVec3::splat(0.7), perceptual_roughness: 0.6 });
                let bsdfs = [
                    Bsdf::MetallicRoughness(reflector),
                    Bsdf::MetallicRoughness(Reflector { through, ..reflector }),
                    Bsdf::MetallicRoughness(grainy),
                    Bsdf::Layered(Layers { sheen, coat: None }, reflector),
                ];
                for bsdf in &bsdfs[..if behind == Behind::Thin { 4 } else { 2 }] {
                    // `sample` returns `None` for samples without a contribution, so the density counts only where the BSDF is not zero.
                    let pdf =
                        |wi: DVec3| if bsdf.scatter(n, wi, wo) == DVec3::ZERO { 0.0 } else { bsdf.pdf(n, wi, wo) };
                    let p = agreement(&|u| bsdf.sample(n, wo, u).map(|s| s.wi), &pdf);
                    assert!(p > LEAST_P, "{bsdf:?} {wo}: p = {p}");
                    tested += 1;
                }
            }
        }
    }
    assert_eq!(tested, 96);
}

#[test]
fn skies_are_sampled_with_their_density() {
    let constant = Scene { sky: Vec3::ONE, ..Scene::default() };
    let mut image = Environment {
        width: 16,
        height: 8,
        pixels: (0..128).map(|i| Vec3::splat(((i * 37) % 11) as f32 * 0.1)).collect(),
        rotation: 0.7,
    };
    image.pixels[3 * 16 + 5] = Vec3::splat(20.0);
    let with_image = Scene { environment: Some(image), ..Scene::default() };
    for scene in [constant, with_image] {
        let sky = Sky::new(&scene);
        // The edges of the density are aligned with the y axis, so y is rotated to the grid's z axis.
        let rotated = |d: DVec3| DVec3::new(d.x, -d.z, d.y);
        let back = |d: DVec3| DVec3::new(d.x, d.z, -d.y);
        let sample = |u: [f64; 3]| sky.sample(&scene, u[1], u[2]).map(|(wi, _, _)| rotated(wi));
        let p = agreement(&sample, &|wi| sky.pdf(&scene, back(wi)));
        assert!(p > LEAST_P, "{p}");
        // The returned radiance and density are those of the direction.
        for i in 0..1000 {
            let mut random = Random::new(9, i, 0);
            let Some((wi, radiance, pdf)) = sky.sample(&scene, random.unit(), random.unit()) else { continue };
            assert_eq!((radiance, pdf), (sky.radiance(&scene, wi), sky.pdf(&scene, wi)));
        }
    }
}
