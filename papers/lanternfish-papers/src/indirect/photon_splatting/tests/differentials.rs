//! Footprints of photons against finite differences of rays that are traced on the CPU [Aalund2015, §3.4].

use std::f64::consts::{PI, TAU};

use bytemuck::Zeroable;
use glam::{DQuat, DVec3, Mat4, Vec2Swizzles, Vec3, Vec4};
use lanternfish::{Renderer, lights::Light, rays::Structure, settings::Tracer, view::View};
use lanternfish_gpu::{
    Feature, Gpu, ShaderLibrary,
    bytemuck::{self, Pod},
    testing::Memory,
};

use super::super::parameters::{PhotonHit, PhotonParameters, PrimaryPhoton};
use crate::{
    indirect::{
        light_views::{LightView, LightViewSet, Source},
        tests::{closed_box, photons, settings},
    },
    testing::{self, edited_library, engine, library, probe_of},
};

/// A photon's way: from a point light to a surface, scattered to a direction, and on to another surface.
#[derive(Clone, Copy)]
struct Way {
    texel: u32,
    /// A point of the first plane, and the normals of both.
    p: DVec3,
    normals: [DVec3; 2],
    direction: DVec3,
    /// From the first surface to the second, m.
    distance: f64,
}

/// Texels along an edge of the light's view, which is 90° wide.
const SIDE: u32 = 8;
const LIGHT: DVec3 = DVec3::new(0.3, 2.0, -0.2);
/// Solid angle of the direction, sr.
const CELL: f64 = 0.02;

fn axes() -> [DVec3; 3] {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.4);
    [turn * DVec3::X, turn * DVec3::NEG_Z, turn * DVec3::NEG_Y]
}

fn ways() -> Vec<Way> {
    let unit = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).normalize();
    let way = |texel, n: [f64; 3], d: [f64; 3], m: [f64; 3], distance| Way {
        texel,
        p: DVec3::new(0.1, -0.2, 0.3),
        normals: [unit(n[0], n[1], n[2]), unit(m[0], m[1], m[2])],
        // As it comes from its 32 bits.
        direction: from_octahedral(snorm_octahedral(unit(d[0], d[1], d[2]).as_vec3())),
        distance,
    };
    vec![
        way(0, [0.0, 1.0, 0.0], [1.0, 0.5, 0.2], [-1.0, 0.2, 0.1], 1.5),
        way(27, [0.3, 1.0, -0.2], [-0.4, 1.0, 0.9], [0.1, -1.0, -0.3], 0.7),
        way(60, [-0.4, 1.0, 0.3], [0.1, 0.4, -1.0], [0.2, 0.1, 1.0], 3.0),
        // Back towards the light, nearly.
        way(36, [0.0, 1.0, 0.1], [-0.2, 1.0, 0.05], [0.6, -1.0, 0.2], 2.0),
    ]
}

/// Intersection with a plane through `p`.
fn intersect(origin: DVec3, direction: DVec3, p: DVec3, normal: DVec3) -> DVec3 {
    origin + normal.dot(p - origin) / normal.dot(direction) * direction
}

/// Texel of this index, in Morton order.
fn texel_of(code: u32) -> [f64; 2] {
    let of = |bits: u32| f64::from((0..3).map(|i| (bits >> (2 * i) & 1) << i).sum::<u32>());
    [of(code), of(code >> 1)]
}

impl Way {
    fn emitted(&self, off: [f64; 2]) -> DVec3 {
        let [right, up, forward] = axes();
        let [x, y] = texel_of(self.texel);
        let place = |texel: f64, off: f64| 2.0 * (texel + 0.5 + off) / f64::from(SIDE) - 1.0;
        (forward + place(x, off[0]) * right + place(y, off[1]) * up).normalize()
    }

    /// Hit point on the second surface of the ray that starts so many texels beside the photon's. The rotation from the arriving to the
    /// leaving direction is the photon's own: it depends on neither coordinate.
    fn landed(&self, off: [f64; 2]) -> DVec3 {
        let middle = self.emitted([0.0; 2]);
        let first = |d: DVec3| intersect(LIGHT, d, self.p, self.normals[0]);
        let turn = DQuat::from_rotation_arc(middle, self.direction);
        let target = first(middle) + self.distance * self.direction;
        let d = self.emitted(off);
        intersect(first(d), turn * d, target, self.normals[1])
    }

    /// Change of the hit point over a texel, by central differences.
    fn differences(&self) -> [DVec3; 2] {
        let step = 1e-4;
        [[step, 0.0], [0.0, step]].map(|[u, v]| (self.landed([u, v]) - self.landed([-u, -v])) / (2.0 * step))
    }
}

fn bind<T: Pod>(memory: &mut Memory, name: &str, content: T) {
    memory.bind(&[name], &[content]);
}

/// Largest relative errors of the squared size of footprints, and of irradiance, of all ways through these shaders.
fn errors(gpu: &Gpu, library: &ShaderLibrary) -> [f64; 2] {
    let ways = ways();
    let count = ways.len() as u32;
    let mut memory = Memory::new();
    let bits = |value: u32| f32::from_bits(value);
    let query = |p: DVec3, word: u32, normal: DVec3| [p.as_vec3().extend(bits(word)), normal.as_vec3().extend(0.0)];
    let [right, up, forward] = axes().map(|axis| axis.as_vec3());
    let origin = LIGHT.as_vec3();
    let view = LightView { right, up, forward, origin, side: SIDE, source: Source::Cone as u32, ..LightView::zeroed() };
    bind(&mut memory, "light_views", view);
    bind(&mut memory, "light_view_set", LightViewSet { count: 1, ..LightViewSet::zeroed() });
    let parameters = PhotonParameters {
        primary_count: count,
        direction_count: count,
        slot_count: count * count,
        radius: 1.0,
        ..PhotonParameters::zeroed()
    };
    bind(&mut memory, "photons", parameters);
    // Pixels of no size.
    let clip_from_view = Mat4::from_cols(1e9 * Vec4::X, Vec4::Y, Vec4::Z, Vec4::W);
    let view = View { clip_from_view, size: glam::UVec2::ONE, orthographic: 1, ..View::zeroed() };
    bind(&mut memory, "view", view);
    let directions: Vec<Vec4> = ways.iter().map(|way| way.direction.as_vec3().extend(CELL as f32)).collect();
    memory.bind(&["photon_directions"], &directions);
    memory.bind(&["primary_photons"], &vec![PrimaryPhoton::zeroed(); ways.len()]);
    memory.bind(&["split_photons"], &vec![PrimaryPhoton::zeroed(); ways.len()]);
    // Slot i * count + i: photon i in direction i.
    let mut hits = vec![PhotonHit { triangle: u32::MAX, ..PhotonHit::zeroed() }; ways.len() * ways.len()];
    let mut triangles = Vec::new();
    let mut places = vec![0u32; hits.len() + 1];
    for (i, way) in ways.iter().enumerate() {
        let slot = i * ways.len() + i;
        let direction = snorm_octahedral(way.direction.as_vec3());
        hits[slot] = PhotonHit { triangle: i as u32, direction, distance: way.distance as f32, ..PhotonHit::zeroed() };
        let (a, b) = way.normals[1].as_vec3().any_orthonormal_pair();
        triangles.extend([Vec3::ZERO, a, b].map(|corner| corner.extend(0.0)));
        places[slot + 1..].iter_mut().for_each(|place| *place += 1);
    }
    memory.bind(&["landed_hits"], &hits);
    memory.bind(&["bvh_triangles"], &triangles);
    memory.bind(&["places"], &places);
    memory.bind(&["placed_photons"], &vec![Light::zeroed(); ways.len()]);
    memory.bind(&["lights"], &vec![Light::zeroed(); ways.len()]);
    memory.bind(&["queries"], &ways.iter().flat_map(|w| query(w.p, w.texel, w.normals[0])).collect::<Vec<_>>());
    memory.bind(&["answers"], &[Vec4::ZERO]);

    // For the resources of surfaces, which the entry points do not read.
    let renderer = Renderer::with_engine(&engine(gpu), settings(photons())).unwrap();
    let scene = renderer.upload(&closed_box().0).unwrap();
    let features = Tracer::BVH.features(&Structure::NONE, true);
    let run = |memory: &mut Memory, (module, features): (&str, &[Feature]), entry: &str, count: u32| {
        let kernel = probe_of(library, gpu, module, features, entry);
        memory.run_beside(gpu, &kernel, &scene.bindings(), [count, 1, 1]);
    };
    let probe = ("testing/photon_differentials", &features[..]);
    run(&mut memory, probe, "emitted", count);
    let emitted: Vec<PrimaryPhoton> = memory.get("primary_photons");
    memory.set("split_photons", &emitted);
    run(&mut memory, ("indirect/photon_splatting/scatter", &[]), "scatter", 1);
    let placed: Vec<Light> = memory.get("placed_photons");
    memory.set("lights", &placed);

    // Points halfway to the edge of the ellipse whose conjugate half diameters are half of the differentials: a quarter, squared.
    let mut queries = Vec::new();
    for (i, way) in ways.iter().enumerate() {
        let [u, v] = way.differences();
        for k in 0..7 {
            let (sin, cos) = (TAU * f64::from(k) / 7.0).sin_cos();
            let p = way.landed([0.0; 2]) + 0.25 * (cos * u + sin * v);
            queries.extend(query(p, i as u32, way.normals[1]));
        }
    }
    memory.set("queries", &queries);
    memory.set("answers", &vec![Vec4::ZERO; queries.len() / 2]);
    run(&mut memory, probe, "placed", queries.len() as u32 / 2);
    let mut worst = [0.0f64; 2];
    for (answers, way) in memory.get::<Vec4>("answers").chunks(7).zip(&ways) {
        let [u, v] = way.differences();
        let flux = CELL * way.direction.dot(way.normals[0]).abs();
        // Eq. 4, of the area across the photon's direction.
        let irradiance = flux / (PI / 4.0 * u.cross(v).dot(way.direction).abs());
        for answer in answers {
            worst[0] = worst[0].max((f64::from(answer.x) / 0.25 - 1.0).abs());
            worst[1] = worst[1].max((f64::from(answer.y) / irradiance - 1.0).abs());
        }
    }
    worst
}

/// As shaders pack directions.
fn snorm_octahedral(direction: Vec3) -> u32 {
    let flat = direction.truncate() / direction.abs().element_sum();
    let folded = if direction.z >= 0.0 { flat } else { (1.0 - flat.abs().yx()) * flat.map(f32::signum) };
    let snorm = |value: f32| u32::from((value * 32767.0).round() as i16 as u16);
    snorm(folded.x) | (snorm(folded.y) << 16)
}

fn from_octahedral(bits: u32) -> DVec3 {
    let flat = glam::DVec2::new(f64::from(bits as u16 as i16), f64::from((bits >> 16) as u16 as i16)) / 32767.0;
    let z = 1.0 - flat.abs().element_sum();
    let flat = if z >= 0.0 { flat } else { (1.0 - flat.abs().yx()) * flat.map(f64::signum) };
    flat.extend(z).normalize()
}

/// The way from a point light to a surface, diffuse reflection, and the way to the next surface: the kernel's ellipse there is that of
/// differences between neighbouring rays. Bounds: 32-bit floats; for irradiance also the 16 bits of the packed normal.
#[gpu_test]
fn gpu_footprints_are_the_differences_of_neighbouring_rays(gpu: &Gpu) {
    let [size, irradiance] = errors(gpu, &library());
    println!("size {size:.5}, irradiance {irradiance:.5}");
    assert!(size < 1e-3 && irradiance < 1e-3, "size {size}, irradiance {irradiance}");
    // Negative control, one of those below.
    let edited = edited_library("indirect/photon_splatting/footprint", "spread = 0.25 *", "spread = 0.24 *");
    assert!(errors(gpu, &edited)[0] > 0.02);
}

/// Every term of the differentials is seen by the test above. One is not among them: what a direction's differential has along the direction
/// itself, each transfer to a surface removes.
#[gpu_test(full)]
fn gpu_footprints_without_a_term_are_noticed(gpu: &Gpu) {
    let edits = [
        ("emit", "2.0 / f32(seen_from.side)", "1.9 / f32(seen_from.side)"),
        ("differential", "scale * (step_v - d * dot(d, step_v))", "step_v - d * dot(d, step_v)"),
        ("differential", "along.position_u + t * along.direction_u", "along.position_u"),
        ("differential", "v - d * (dot(v, normal) / facing)", "v"),
        ("differential", "turned(arriving.direction_u, before, after)", "arriving.direction_u"),
        ("differential", " + w * (dot(w, v) / (1.0 + c))", ""),
        ("footprint", "leaving.position_u + t * leaving.direction_u", "leaving.position_u"),
        ("footprint", "leaving.position_v + t * leaving.direction_v", "t * leaving.direction_v"),
        ("footprint", "spread = 0.25 *", "spread = 0.24 *"),
        ("kernel", "-footprint.spread.y / determinant", "footprint.spread.y / determinant"),
        ("kernel", "footprint.flux / (PI * sqrt(determinant))", "footprint.flux / sqrt(determinant)"),
    ];
    for (module, text, by) in edits {
        let [size, irradiance] = errors(gpu, &edited_library(&format!("indirect/photon_splatting/{module}"), text, by));
        assert!(size > 0.02 || irradiance > 0.02, "{module}, {text}: size {size}, irradiance {irradiance}");
    }
}
