//! Queries at a pixel: the surface hit, the lights that reach it, and rays from it.

use glam::{DVec3, Vec3, Vec3A};
use lanternfish_scene::Camera;

use crate::{
    brdf::cosine_direction,
    camera,
    lights::{Incidence, incidence, incidence_from, point_of_area},
    surface::Surface,
    tracer::Tracer,
    world::{Faces, offset},
};

/// Shadow rays per axis of an area light: a grid of this size squared.
const POINTS_A_SIDE: u32 = 4;

/// Increments of the R₂ sequence [Roberts2018].
const SEQUENCE: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// A point on a surface, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probed {
    /// Position, m.
    pub p: Vec3,
    /// Distance from the ray's origin, m.
    pub distance: f32,
    /// Shading normal, unit, on the hit side.
    pub normal: Vec3,
    /// The triangle's normal, unit, on the hit side.
    pub geometric_normal: Vec3,
    /// Index into [`lanternfish_scene::Scene::instances`].
    pub instance: usize,
    /// Index into the primitives of the instance's mesh.
    pub primitive: usize,
    /// Index into [`lanternfish_scene::Scene::materials`].
    pub material: usize,
}

/// Light at a point from one light of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightAt {
    /// Index into [`lanternfish_scene::Scene::lights`].
    pub light: usize,
    /// Distance to its position, m; infinite for directional lights.
    pub distance: f32,
    /// Unshadowed irradiance of the surface, lx.
    pub unshadowed: Vec3,
    /// Irradiance of the surface with shadows, lx.
    pub irradiance: Vec3,
}

/// A ray from a point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayFrom {
    /// Direction, unit, world space.
    pub direction: Vec3,
    /// Distance to its hit, m; `None` if it leaves the scene.
    pub distance: Option<f32>,
}

impl LightAt {
    /// Visibility: ratio of shadowed to unshadowed irradiance, by luminance, 0..=1; 1 for a light without unshadowed irradiance.
    pub fn open(&self) -> f32 {
        match luminance(self.unshadowed) {
            unshadowed if unshadowed > 0.0 => (luminance(self.irradiance) / unshadowed).min(1.0),
            _ => 1.0,
        }
    }
}

fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

impl Tracer<'_> {
    /// The nearest visible surface at (x, y), in pixels from the top left of an image of this size. Backs of single-sided surfaces and holes of
    /// alpha masks are skipped. A transparent surface counts if its alpha exceeds a fixed random number per triangle.
    #[doc(hidden)]
    pub fn probe(&self, camera: &Camera, [x, y]: [f64; 2], [width, height]: [usize; 2]) -> Option<Probed> {
        let (origin, direction) = camera::ray(camera, x, y, width, height);
        let hit = self.world.closest(origin, direction, Faces::FrontsOnly, 0)?;
        let surface = Surface::new(&self.world, &hit, direction, self.settings.materials);
        let source = &self.world.sources[hit.triangle as usize];
        Some(Probed {
            p: surface.p.into(),
            distance: hit.distance,
            normal: surface.normal.as_vec3(),
            geometric_normal: surface.geometric_normal.into(),
            instance: source.instance as usize,
            primitive: source.primitive as usize,
            material: self.world.primitive(source).material,
        })
    }

    /// The `most` lights of the scene with the highest unshadowed irradiance at a point, in descending order, and the number of all lights
    /// with unshadowed irradiance. Shadow rays are traced for the returned lights only. A light with a radius counts as a point; an area light
    /// gets 16 shadow rays.
    #[doc(hidden)]
    pub fn lights_at(&self, place: &Probed, most: usize) -> (Vec<LightAt>, usize) {
        let lights = self.world.scene.lights.iter().enumerate();
        let mut reaching: Vec<_> = lights
            .filter_map(|(light, _)| {
                let (unshadowed, _) = self.light_at(place, light, |_| Vec3::ONE);
                (luminance(unshadowed) > 0.0).then_some((light, unshadowed))
            })
            .collect();
        let all = reaching.len();
        // A stable sort: equal lights keep their order.
        reaching.sort_by(|(_, a), (_, b)| luminance(*b).total_cmp(&luminance(*a)));
        reaching.truncate(most);
        let start = offset(place.p.into(), place.geometric_normal.into());
        let visibility = |incidence: &Incidence| {
            let (direction, distance) = segment(incidence, place, start);
            self.world.transmittance(start, direction, distance)
        };
        let lights = reaching.into_iter().map(|(light, unshadowed)| {
            let (irradiance, distance) = self.light_at(place, light, visibility);
            LightAt { light, distance, unshadowed, irradiance }
        });
        (lights.collect(), all)
    }

    /// Cosine-distributed rays around a point's normal, as for indirect light. Directions come from a fixed low-discrepancy sequence. Rays into
    /// the surface are omitted, so there may be fewer than `count`.
    #[doc(hidden)]
    pub fn rays_from(&self, place: &Probed, count: u32) -> Vec<RayFrom> {
        let start = offset(place.p.into(), place.geometric_normal.into());
        let directions = (0..count).map(|i| {
            let [u, v] = SEQUENCE.map(|step| (0.5 + f64::from(i) * step).fract());
            cosine_direction(place.normal.as_dvec3(), u, v).as_vec3()
        });
        let outwards = directions.filter(|direction| direction.dot(place.geometric_normal) > 0.0);
        outwards.map(|direction| RayFrom { direction, distance: self.nearest(start, direction.into()) }).collect()
    }

    /// Irradiance from a light at a point, lx, with the `visibility` of each point of the light; and the distance to the light, m.
    fn light_at(&self, place: &Probed, light: usize, visibility: impl Fn(&Incidence) -> Vec3) -> (Vec3, f32) {
        let light = &self.world.scene.lights[light];
        let (falloff, range_threshold) = (self.settings.falloff(), self.settings.range_threshold);
        let of = |incidence: Incidence| {
            let facing = |normal: Vec3| normal.as_dvec3().dot(incidence.wi).max(0.0) as f32;
            // Light from behind the triangle does not count, whatever the shading normal is.
            if facing(place.geometric_normal) == 0.0 {
                return Vec3::ZERO;
            }
            let irradiance = facing(place.normal) * incidence.irradiance;
            if irradiance == Vec3::ZERO { irradiance } else { irradiance * visibility(&incidence) }
        };
        let p = Vec3A::from(place.p);
        let centre = incidence(light, p, falloff, range_threshold);
        if light.area().is_none() {
            return (of(centre), centre.distance);
        }
        let side = f64::from(POINTS_A_SIDE);
        let points = (0..POINTS_A_SIDE * POINTS_A_SIDE).map(|i| {
            let (row, column) = (f64::from(i / POINTS_A_SIDE), f64::from(i % POINTS_A_SIDE));
            let point = point_of_area(light, [(column + 0.5) / side, (row + 0.5) / side]);
            of(incidence_from(light, point, p, falloff, range_threshold))
        });
        (points.sum::<Vec3>() / (side * side) as f32, centre.distance)
    }
}

/// Direction (unit) and distance (m) from `start`, which is offset from the point, to the light.
fn segment(incidence: &Incidence, place: &Probed, start: Vec3A) -> (Vec3A, f32) {
    if incidence.distance.is_infinite() {
        return (incidence.wi.as_vec3a(), f32::INFINITY);
    }
    let end = place.p.as_dvec3() + f64::from(incidence.distance) * incidence.wi;
    let towards: DVec3 = end - start.as_dvec3();
    (towards.normalize().as_vec3a(), towards.length() as f32)
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::{Light, Projection, generate::demo};

    use super::*;
    use crate::Settings;

    /// At the centre of the image is the back wall of the box.
    #[test]
    fn a_pixel_shows_a_point_of_an_instance() {
        let scene = demo("cornell").unwrap();
        let tracer = Tracer::new(&scene, Settings::default()).unwrap();
        let camera = scene.default_camera(1.0);
        let size = [64, 64];
        let hit = tracer.probe(&camera, [32.0, 32.0], size).unwrap();
        let (origin, direction) = camera::ray(&camera, 32.0, 32.0, 64, 64);
        assert_eq!(tracer.nearest(origin, direction), Some(hit.distance));
        assert!((Vec3::from(origin + hit.distance * direction) - hit.p).length() < 1e-4);
        assert!(hit.normal.is_normalized() && hit.normal.dot(Vec3::from(direction)) < 0.0);
        let mesh = &scene.meshes[scene.instances[hit.instance].mesh];
        assert_eq!(mesh.primitives[hit.primitive].material, hit.material);
        // A camera that faces away from the scene sees no surface.
        let away =
            Camera::look_at(Vec3::splat(1e3), Vec3::splat(2e3), Projection::Perspective { fov_y: 1.0, near: 0.1 });
        assert_eq!(tracer.probe(&away, [32.0, 32.0], size), None);
    }

    /// The mean cosine of rays from the floor of the box is 2/3. Some rays leave through its open front.
    #[test]
    fn rays_from_a_point_are_cosine_distributed() {
        let scene = demo("cornell").unwrap();
        let tracer = Tracer::new(&scene, Settings::default()).unwrap();
        let camera = scene.default_camera(1.0);
        let place = tracer.probe(&camera, [32.0, 60.0], [64, 64]).unwrap();
        let rays = tracer.rays_from(&place, 256);
        let cosines = rays.iter().map(|ray| ray.direction.dot(place.normal));
        let mean = cosines.sum::<f32>() / rays.len() as f32;
        assert!(rays.len() == 256 && (mean - 2.0 / 3.0).abs() < 0.01, "{mean}");
        for ray in rays.iter().filter_map(|ray| Some((ray.direction, ray.distance?))) {
            let end = place.p + ray.1 * ray.0;
            let bounds = scene.bounds();
            assert!((end.clamp(bounds.min, bounds.max) - end).length() < 1e-3, "{end}");
        }
        let hits = rays.iter().filter(|ray| ray.distance.is_some()).count();
        assert!((128..256).contains(&hits), "{hits}: the box is open to the front");
    }

    /// Lights above the floor of the box, behind a wall and below the floor, against analytic values.
    #[test]
    fn lights_are_sorted_by_irradiance_and_shadowed_by_walls() {
        let mut scene = demo("cornell").unwrap();
        let tracer = Tracer::new(&scene, Settings::default()).unwrap();
        let camera = scene.default_camera(1.0);
        let place = tracer.probe(&camera, [32.0, 60.0], [64, 64]).unwrap();
        assert!(place.normal.y > 0.99, "the floor: {place:?}");
        drop(tracer);
        let bounds = scene.bounds();
        let above = |height: f32| place.p + Vec3::new(0.0, height, 0.0);
        let beyond = Vec3::new(bounds.min.x - 1.0, place.p.y + 1.0, place.p.z);
        scene.lights = vec![
            Light::point(above(0.4), Vec3::ONE),
            Light::point(above(0.2), Vec3::ONE),
            Light::point(beyond, Vec3::splat(100.0)),
            Light::point(place.p - Vec3::Y, Vec3::ONE),
            Light::disk(above(0.3), Vec3::NEG_Y, 0.01, Vec3::splat(1e3)),
            Light::directional(Vec3::NEG_Y, Vec3::splat(1e-3)),
        ];
        let tracer = Tracer::new(&scene, Settings::default()).unwrap();
        let (actual, all) = tracer.lights_at(&place, 10);
        assert_eq!(all, 5, "the one below the floor lights it from behind");
        let order: Vec<_> = actual.iter().map(|at| at.light).collect();
        assert_eq!(actual.len(), 5);
        let of = |light: usize| actual[order.iter().position(|at| *at == light).unwrap()];
        assert!(order.windows(2).all(|two| luminance(of(two[0]).unshadowed) >= luminance(of(two[1]).unshadowed)));
        // One candela from straight above: the inverse square law, reduced by the range window.
        assert!((of(0).irradiance.x - 1.0 / 0.16).abs() < 0.07, "{:?}", of(0));
        assert!((of(1).irradiance.x - 1.0 / 0.04).abs() < 0.25 && of(1).open() == 1.0, "{:?}", of(1));
        assert!(of(2).irradiance == Vec3::ZERO && of(2).open() == 0.0, "behind a wall: {:?}", of(2));
        assert!(luminance(of(2).unshadowed) > 0.0);
        // A small disk is a point light with intensity radiance times area.
        let disk = 1e3 * std::f32::consts::PI * 1e-4 / 0.09;
        assert!((of(4).irradiance.x - disk).abs() < 0.02 * disk, "{:?} for {disk}", of(4));
        assert!(of(5).open() == 0.0 && of(5).distance.is_infinite(), "the ceiling occludes the sun");
        let (two, all) = tracer.lights_at(&place, 2);
        assert!(two.len() == 2 && all == 5 && two[0] == actual[0]);
    }
}
