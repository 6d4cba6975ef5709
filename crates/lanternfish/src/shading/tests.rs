//! `brdf.wesl` against the path tracer's `brdf`, which is the same in double precision, and invariants of both.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer,
    brdf::{self, Grain, Reflector, normal_distribution},
    layers::{Coat, Sheen, ThinFilm},
    reflector,
};
use lanternfish_scene::{
    Camera, Filter, Image, Light, Material, Projection, Sampler, Texture, TextureRef, linear_from_srgb,
};

use crate::{
    Renderer, Settings,
    testing::{Random, apart, evaluate, quad, scene_of},
};

const ROUGHNESSES: [f64; 7] = [0.0, 0.05, 0.15, 0.3, 0.5, 0.75, 1.0];

/// glTF's default dielectric, or a metal; the normal is +z.
fn surface(base_color: DVec3, metallic: f64, perceptual_roughness: f64) -> Reflector {
    reflector(&Material::default(), base_color, metallic, perceptual_roughness, true)
}

fn white(metallic: f64, perceptual_roughness: f64) -> Reflector {
    surface(DVec3::ONE, metallic, perceptual_roughness)
}

/// The directional albedo towards `wo`: ∫ f cos dω, by `n` × `n` strata. The specular part samples GGX half vectors, the diffuse part the
/// cosine.
fn reflectance(surface: &Reflector, wo: DVec3, n: u32) -> DVec3 {
    let a2 = surface.alpha().powi(2);
    let mut sum = DVec3::ZERO;
    for i in 0..n * n {
        let u = (f64::from(i / n) + 0.5) / f64::from(n);
        let (sin_phi, cos_phi) = (2.0 * PI * (f64::from(i % n) + 0.5) / f64::from(n)).sin_cos();

        let cosine = ((1.0 - u) / (1.0 + (a2 - 1.0) * u)).sqrt();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let h = DVec3::new(sine * cos_phi, sine * sin_phi, cosine);
        let wi = 2.0 * wo.dot(h) * h - wo;
        if wi.z > 0.0 && wo.dot(h) > 0.0 {
            let pdf = normal_distribution(DVec3::Z, h, surface.alpha()) * cosine / (4.0 * wo.dot(h));
            sum += surface.specular(DVec3::Z, wi, wo) * wi.z / pdf;
        }

        let wi = DVec3::new(u.sqrt() * cos_phi, u.sqrt() * sin_phi, (1.0 - u).sqrt());
        sum += surface.diffuse(DVec3::Z, wi, wo) * PI;
    }
    sum / f64::from(n * n)
}

/// A unit vector at an angle from +z.
fn at(angle: f64) -> DVec3 {
    DVec3::new(angle.sin(), 0.0, angle.cos())
}

#[gpu_test]
fn gpu_brdf_is_its_cpu_reference(gpu: &Gpu) {
    let mut random = Random::new(11);
    let mut queries = Vec::new();
    let mut surfaces = Vec::new();
    for _ in 0..4096 {
        let base_color = 0.5 + 0.5 * random.point();
        let metallic = [0.0, 1.0, random.unit()][(3.0 * random.unit()) as usize];
        let roughness = random.between(0.03, 1.0);
        let upper = |v: Vec3| if v.z < 0.0 { -v } else { v };
        // One light in eight is behind the surface.
        let wi = random.direction();
        let wi = if random.unit() < 0.125 { wi } else { upper(wi) };
        let wo = upper(random.direction());
        queries.extend([base_color.extend(metallic), Vec3::Z.extend(roughness), wi.extend(0.0), wo.extend(0.0)]);
        let surface = surface(base_color.as_dvec3(), metallic.into(), roughness.into());
        surfaces.push((surface, wi.as_dvec3(), wo.as_dvec3()));
    }
    let mut worst = 0.0f64;
    for ((surface, wi, wo), answer) in surfaces.iter().zip(evaluate(gpu, "reflections", &queries, 4)) {
        let expected = surface.reflect_light(DVec3::Z, *wi, *wo);
        let actual = answer.truncate().as_dvec3();
        // n × h has the rounding error of h relative to the width alpha of the highlight; it enters to the fourth power.
        let tolerance = 16.0 * f64::from(f32::EPSILON) / surface.alpha();
        let error = (actual - expected).abs().max_element() / expected.max_element().max(1e-6);
        assert!(error <= tolerance, "{surface:?} {wi} {wo}: {actual}, not {expected}");
        assert!(wi.z > 0.0 || actual == DVec3::ZERO);
        worst = worst.max(error);
    }
    println!("largest relative difference {worst:.1e}");
}

#[gpu_test]
fn gpu_coats_are_their_cpu_references(gpu: &Gpu) {
    let mut random = Random::new(13);
    let (mut queries, mut expected) = (Vec::new(), Vec::new());
    for _ in 0..2048 {
        let (weight, roughness) = (random.unit(), random.between(0.1, 1.0));
        let upper = |v: Vec3| if v.z < 0.0 { -v } else { v };
        let (wi, wo) = (upper(random.direction()), upper(random.direction()));
        queries.extend([Vec4::new(weight, roughness, 0.0, 0.0), Vec3::Z.extend(0.0), wi.extend(0.0), wo.extend(0.0)]);
        let coat = Coat { weight: weight.into(), perceptual_roughness: roughness.into(), normal: DVec3::Z };
        let (wi, wo) = (wi.as_dvec3(), wo.as_dvec3());
        expected.push(coat.over(wi, wo, DVec3::splat(wi.z / PI)));
    }
    for (answer, expected) in evaluate(gpu, "coated_reflections", &queries, 4).iter().zip(expected) {
        let error = (answer.truncate().as_dvec3() - expected).abs().max_element();
        // The tolerance of the BRDF without a coat; alpha is at least 0.01.
        assert!(error <= 2e-4 * expected.x.max(1e-3), "{answer}, not {expected}");
    }
}

#[gpu_test]
fn gpu_sheen_grain_and_films_are_their_cpu_references(gpu: &Gpu) {
    let mut random = Random::new(17);
    let upper = |v: Vec3| if v.z < 0.0 { -v } else { v };
    let (mut of_sheen, mut of_grain, mut of_film) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sheens, mut grains, mut films) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..2048 {
        let (wi, wo) = (upper(random.direction()), upper(random.direction()));
        let (roughness, strength) = (random.between(0.1, 1.0), random.unit());
        let along = Vec3::new(wi.y, -wi.x, 0.0).normalize_or(Vec3::X);
        // One surface in eight is a mirror across its grain.
        let across = if random.unit() < 0.125 { 0.0 } else { roughness };
        of_sheen.extend([Vec4::splat(roughness), wi.extend(0.0), wo.extend(0.0)]);
        of_grain.extend([Vec4::new(across, strength, 0.0, 0.0), along.extend(0.0), wi.extend(0.0), wo.extend(0.0)]);
        let f0 = random.unit() * Vec3::new(1.0, 0.8, 0.5);
        let (ior, thickness) = (random.between(1.0, 2.5), 1200.0 * random.unit());
        of_film.extend([f0.extend(ior), Vec4::new(thickness, wo.z, 0.0, 0.0)]);

        let (wi, wo) = (wi.as_dvec3(), wo.as_dvec3());
        let sheen = Sheen { color: DVec3::ONE, perceptual_roughness: roughness.into() };
        sheens.push((sheen.reflect(DVec3::Z, wi, wo), sheen.albedo(wo.z)));
        let grain = Grain::new(along.as_dvec3().normalize(), across.into(), strength.into());
        let metal = Reflector {
            albedo: DVec3::ZERO,
            f0: DVec3::splat(0.5),
            grain: Some(grain),
            ..white(1.0, grain.mean_roughness())
        };
        grains.push(metal.reflect_light(DVec3::Z, wi, wo).x);
        let film = ThinFilm { ior: ior.into(), thickness: thickness.into() };
        films.push(film.f0(f0.as_dvec3(), wo.z));
    }
    let is_near = |actual: f32, expected: f64, tolerance: f64| {
        let error = (f64::from(actual) - expected).abs();
        assert!(error <= tolerance * expected.abs().max(1e-2), "{actual}, not {expected}");
    };
    for (answer, (light, albedo)) in evaluate(gpu, "sheen_reflections", &of_sheen, 3).iter().zip(sheens) {
        is_near(answer.x, light, 2e-3);
        is_near(answer.y, albedo, 1e-3);
    }
    for (answer, light) in evaluate(gpu, "grain_reflections", &of_grain, 4).iter().zip(grains) {
        is_near(answer.x, light, 2e-3);
    }
    for (answer, f0) in evaluate(gpu, "film_reflectances", &of_film, 2).iter().zip(films) {
        // The phases of thick films reach hundreds of radians in single precision.
        (0..3).for_each(|channel| is_near(answer[channel], f0[channel], 5e-3));
    }
}

/// In the surface target sheen has a few bits, whose mean over pixels and frames is right; they are no grain.
#[gpu_test]
fn gpu_stored_sheen_is_right_in_the_mean(gpu: &Gpu) {
    let mut random = Random::new(5);
    for (roughness, share) in [(0.3, 0.1), (0.55, 0.5), (0.9, 1.0), (0.5, 0.0)] {
        let queries: Vec<Vec4> = (0..4096).map(|_| Vec4::new(roughness, share, random.unit(), random.unit())).collect();
        let stored = evaluate(gpu, "stored_sheen", &queries, 1);
        assert!(stored.iter().all(|stored| stored.z == 0.0 && stored.w == 0.0 && stored.max_element() <= 1.0));
        let with: Vec<_> = stored.iter().filter(|stored| stored.y > 0.0).collect();
        let mean_share = stored.iter().map(|stored| stored.y).sum::<f32>() / stored.len() as f32;
        assert!((mean_share - share).abs() < 0.01, "{mean_share}, not {share}");
        let mean_roughness = with.iter().map(|stored| stored.x).sum::<f32>() / with.len() as f32;
        assert!(share == 0.0 || (mean_roughness - roughness).abs() < 0.01, "{mean_roughness}, not {roughness}");
    }
}

/// The albedo of sheen, by which it dims the surface below, is that of its lobe.
#[test]
fn the_fit_of_the_albedo_of_sheen_is_close() {
    for roughness in [0.1, 0.25, 0.4, 0.6, 0.8, 1.0] {
        let sheen = Sheen { color: DVec3::ONE, perceptual_roughness: roughness };
        for angle in [0.05f64, 0.5, 1.0, 1.3, 1.5] {
            let n = 200;
            let sum: f64 = (0..n * n)
                .map(|i| {
                    let z = (f64::from(i / n) + 0.5) / f64::from(n);
                    let (sin, cos) = (2.0 * PI * (f64::from(i % n) + 0.5) / f64::from(n)).sin_cos();
                    let ring = (1.0 - z * z).sqrt();
                    sheen.reflect(DVec3::Z, DVec3::new(ring * cos, ring * sin, z), at(angle))
                })
                .sum();
            let (albedo, fit) = (2.0 * PI * sum / f64::from(n * n), sheen.albedo(angle.cos()));
            assert!((-0.011..0.031).contains(&(fit - albedo)), "{roughness}, {angle}: {fit}, not {albedo}");
        }
    }
}

/// A texture whose right half has a uniform colour equals the same values as factors there, in the renderer and in the path tracer.
#[gpu_test]
fn gpu_textures_of_layers_scale_their_factors(gpu: &Gpu) {
    let texel = [51, 102, 153, 204];
    let tint = Vec3::from([0, 1, 2].map(|c| linear_from_srgb(texel[c])));
    let base_color = Vec4::new(0.3, 0.3, 0.3, 1.0);
    let usual = Material { base_color, metallic: 0.0, perceptual_roughness: 0.5, ..Material::default() };
    let coated = Material { clearcoat: 1.0, clearcoat_roughness: 0.6, ..usual.clone() };
    let glass = Material { transmission: 1.0, ..usual.clone() };
    let fibres = Material { sheen_color: Vec3::ONE, sheen_roughness: 1.0, ..usual.clone() };
    let brushed = Material { anisotropy: 1.0, anisotropy_rotation: 0.3, metallic: 1.0, ..usual.clone() };
    let filmy = Material { iridescence: 1.0, iridescence_ior: 1.8, metallic: 1.0, ..usual.clone() };
    // The direction in red and green, of strength blue.
    let along = 0.6 * Vec2::new(-0.6, -0.2);
    type Put = fn(&mut Material, Option<TextureRef>);
    let textures: [(&str, &Material, Put, Material); 10] = [
        ("specular", &usual, |m, t| m.specular_texture = t, Material { specular: 0.8, ..usual.clone() }),
        ("its colour", &usual, |m, t| m.specular_color_texture = t, Material { specular_color: tint, ..usual.clone() }),
        ("transmission", &glass, |m, t| m.transmission_texture = t, Material { transmission: 0.2, ..glass.clone() }),
        ("coat", &coated, |m, t| m.clearcoat_texture = t, Material { clearcoat: 0.2, ..coated.clone() }),
        (
            "its roughness",
            &coated,
            |m, t| m.clearcoat_roughness_texture = t,
            Material { clearcoat_roughness: 0.6 * 0.4, ..coated.clone() },
        ),
        ("sheen", &fibres, |m, t| m.sheen_color_texture = t, Material { sheen_color: tint, ..fibres.clone() }),
        (
            "its roughness",
            &fibres,
            |m, t| m.sheen_roughness_texture = t,
            Material { sheen_roughness: 0.8, ..fibres.clone() },
        ),
        (
            "grain",
            &brushed,
            |m, t| m.anisotropy_texture = t,
            Material { anisotropy: along.length(), anisotropy_rotation: 0.3 + along.to_angle(), ..brushed.clone() },
        ),
        ("film", &filmy, |m, t| m.iridescence_texture = t, Material { iridescence: 0.2, ..filmy.clone() }),
        (
            "its thickness",
            &filmy,
            |m, t| m.iridescence_thickness_texture = t,
            Material { iridescence_thickness: 100.0 + 0.4 * 300.0, ..filmy.clone() },
        ),
    ];
    let camera = Camera::look_at(3.0 * Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 0.1, near: 0.02 });
    let scene = |material: &Material| {
        let lamp = Material { emissive: Vec3::splat(3.0), base_color: Vec4::W, ..Material::default() };
        let (sheet, behind) = (quad(0, Vec3::ZERO, Vec3::X, Vec3::Y), quad(1, -Vec3::Z, 4.0 * Vec3::X, 4.0 * Vec3::Y));
        let mut scene = apart(&scene_of(vec![sheet, behind], vec![material.clone(), lamp]));
        // A highlight, and sheen, which needs grazing light.
        for direction in [Vec3::new(0.1, 0.05, -1.0), Vec3::new(1.0, 0.3, -0.3)] {
            scene.lights.push(Light::directional(direction, Vec3::splat(3.0)));
        }
        scene.images.push(Image { name: String::new(), width: 2, height: 1, rgba: [[255; 4], texel].concat() });
        scene.samplers.push(Sampler { mag: Filter::Nearest, min: Filter::Nearest, ..Sampler::default() });
        scene.textures.push(Texture { image: 0, sampler: 0 });
        scene
    };
    let rendered = |material: &Material| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), Settings::direct_light()).unwrap();
        let uploaded = renderer.upload(&scene(material)).unwrap();
        let radiance = renderer.render(&uploaded, &camera, [9, 9]).unwrap().radiance;
        [38, 42].map(|pixel| Vec4::from(radiance[pixel]).truncate())
    };
    let traced = |material: &Material| {
        let mut film = Film::new([9, 9]).unwrap();
        let settings = TracerSettings { max_depth: 2, ..TracerSettings::default() };
        Tracer::new(&scene(material), settings).unwrap().render(&camera, &mut film, 64);
        [38, 42].map(|pixel| Vec3::from(film.mean()[pixel]))
    };
    for (name, plain, put, factor) in textures {
        let mut mapped = plain.clone();
        put(&mut mapped, Some(TextureRef::new(0)));
        for (who, of) in [("rendered", &rendered as &dyn Fn(&Material) -> [Vec3; 2]), ("traced", &traced)] {
            let [[_, plain], [left, mapped], [_, factor]] = [plain, &mapped, &factor].map(of);
            println!("{name}, {who}: {mapped}, by factor {factor}, without {plain}");
            let apart = |other: Vec3| (mapped - other).abs().max_element() / other.max_element();
            assert!(apart(factor) < 3e-3 && apart(plain) > 0.01, "{name}, {who}: {mapped}, not {factor}; was {plain}");
            assert!(apart(left) > 0.01, "{name}, {who}: {mapped}, at the left {left}");
        }
    }
}

/// Error bound of the sums over strata: halving the strata changes none by more.
const ENERGY_TOLERANCE: f64 = 0.006;

const ANGLES: [f64; 7] = [0.0, 0.3, 0.6, 0.9, 1.2, 1.4, 1.5];

/// Directional albedos of white surfaces at every roughness and these view angles.
fn reflectances(material: &Material, metallic: f64, angles: &[f64]) -> Vec<f64> {
    let of = |roughness| reflector(material, DVec3::ONE, metallic, roughness, true);
    let pairs = ROUGHNESSES.iter().flat_map(|roughness| angles.iter().map(move |angle| (*roughness, *angle)));
    pairs.map(|(roughness, angle)| reflectance(&of(roughness), at(angle), 96).max_element()).collect()
}

#[test]
fn no_surface_reflects_more_than_it_receives() {
    let index = |ior| Material { ior, ..Material::default() };
    for (name, material, metallic) in [
        ("metal", index(1.5), 1.0),
        ("half a metal", index(1.5), 0.5),
        ("dielectric", index(1.5), 0.0),
        ("diamond", index(2.42), 0.0),
        ("no diffuse light", index(0.0), 0.0),
        ("without a specular layer", Material { specular: 0.0, ..index(1.5) }, 0.0),
    ] {
        let most = reflectances(&material, metallic, &ANGLES).into_iter().fold(0.0, f64::max);
        println!("{name}: at most {most:.4}");
        assert!(most <= 1.0 + ENERGY_TOLERANCE, "{name}: {most}");
        // Check that the test can fail: a gain of 1.5 % of a lossless surface is detected.
        assert!(metallic == 0.5 || 1.015 * most > 1.0 + ENERGY_TOLERANCE, "{name}: {most}");
    }
    // A dielectric scatters all light that it does not mirror: a white one is lossless, except where the fit of its specular layer is
    // coarse.
    let least = reflectances(&index(1.5), 0.0, &ANGLES[..6]).into_iter().fold(1.0, f64::min);
    println!("dielectric up to 1.4 rad: at least {least:.4}");
    assert!(least > 0.96, "{least}");
    let least = reflectances(&index(1.5), 0.0, &ANGLES[..4]).into_iter().fold(1.0, f64::min);
    assert!(least > 0.98, "{least}");
    // Convergence of the sums.
    for (roughness, metallic, angle) in [(0.15, 1.0, 0.6), (0.3, 0.0, 0.9), (1.0, 0.5, 1.2)] {
        let [coarse, fine] = [48, 96].map(|n| reflectance(&white(metallic, roughness), at(angle), n).x);
        assert!((coarse - fine).abs() < ENERGY_TOLERANCE, "{coarse} and {fine}");
    }
}

/// The specular layer's fraction of uniform light is a fit; the diffuse part is the remainder.
#[test]
fn the_fit_of_the_specular_layer_is_close() {
    let layer = |f0, roughness| Reflector { albedo: DVec3::ZERO, f0: DVec3::splat(f0), ..white(0.0, roughness) };
    for roughness in ROUGHNESSES {
        for angle in &ANGLES[..6] {
            let fraction = reflectance(&layer(0.0, roughness), at(*angle), 96).x;
            let fit = brdf::grazing_fraction(angle.cos(), layer(0.0, roughness).alpha());
            assert!((-0.012..0.08).contains(&(fit - fraction)), "{roughness} {angle}: {fit}, not {fraction}");
        }
    }
}

/// The total reflected light of a surface equals the integral of its BRDF: uniform light, sampled by cosine-weighted rays.
#[gpu_test]
fn gpu_total_reflectances_are_integrals(gpu: &Gpu) {
    let cosines: Vec<f64> = (0..16).map(|i| ((f64::from(i) + 0.5) / 16.0).sqrt()).collect();
    for (base_color, metallic) in [(DVec3::new(0.68, 0.3, 0.0), 0.0), (DVec3::new(0.9, 0.5, 0.2), 1.0)] {
        for roughness in &ROUGHNESSES[1..] {
            let surface = surface(base_color, metallic, *roughness);
            let integrals: DVec3 = cosines.iter().map(|cosine| reflectance(&surface, at(cosine.acos()), 64)).sum();
            let query = |cosine: &f64| {
                let [first, second] = [base_color.extend(metallic), DVec3::Z.extend(*roughness)].map(|v| v.as_vec4());
                [first, second, at(cosine.acos()).as_vec3().extend(0.0), Vec4::Z]
            };
            let queries: Vec<Vec4> = cosines.iter().flat_map(query).collect();
            let actual: Vec4 = evaluate(gpu, "whole_reflections", &queries, 4).into_iter().sum();
            let [expected, actual] = [integrals, actual.truncate().as_dvec3()].map(|sum| sum / cosines.len() as f64);
            println!("{base_color} {metallic} {roughness}: {actual:.4}, {expected:.4}");
            assert!((actual - expected).abs().max_element() < 0.01, "{roughness}: {actual}, not {expected}");
        }
    }
}

#[test]
fn the_brdf_is_reciprocal() {
    let mut random = Random::new(2);
    for _ in 0..2000 {
        let upper = |v: Vec3| v.as_dvec3().with_z(f64::from(v.z).abs().max(1e-3)).normalize();
        let (wi, wo) = (upper(random.direction()), upper(random.direction()));
        let surface = white(random.unit().into(), random.unit().into());
        for f in [Reflector::specular, Reflector::diffuse] {
            let (there, back) = (f(&surface, DVec3::Z, wi, wo), f(&surface, DVec3::Z, wo, wi));
            assert!((there - back).abs().max_element() <= 1e-9 * there.max_element(), "{surface:?} {wi} {wo}");
        }
        // Check that the test can fail: with the cosine of one side only, reciprocity does not hold.
        let (there, back) = (surface.reflect_light(DVec3::Z, wi, wo), surface.reflect_light(DVec3::Z, wo, wi));
        assert!((wi.z - wo.z).abs() < 1e-3 || (there - back).length() > 0.0);
    }
}

#[test]
fn constants_are_the_shaders() {
    let file = "materials/brdf";
    assert_eq!(crate::shaders::constant(file, "LEAST_ROUGHNESS"), brdf::LEAST_ROUGHNESS);
}
