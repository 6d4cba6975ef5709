//! The scene as rays hit it.

use glam::{Affine3A, DVec2, Vec3, Vec3A};
use lanternfish_scene::{
    AlphaMode, Material, Primitive, Scene,
    bvh::{self, Effort},
};
use obvhs::{
    aabb::Aabb,
    cwbvh::CwBvh,
    ray::{Ray, RayHit},
    triangle::Triangle,
};
use rayon::prelude::*;

use crate::{
    random::unit_of,
    surface::is_thin_dielectric,
    texture::{self, Encoding, Srgb},
};

/// Where in the scene's lists a triangle comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub instance: u32,
    pub primitive: u32,
    /// First of its three indices.
    pub first_index: u32,
    /// Whether a ray may pass, wholly or in part.
    pub kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Solid,
    /// A hole where alpha is below the cutoff, or partly covered.
    Alpha,
    /// Thin and smooth: light passes straight, tinted, where alpha says that the pane is there.
    ThinDielectric,
}

/// A place on a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Along the ray, m.
    pub distance: f32,
    pub triangle: u32,
    /// Weights of the three corners.
    pub weights: [f32; 3],
    /// True if it was hit from the side from which it is wound counter-clockwise, in object space.
    pub front: bool,
}

/// Which triangles a ray does not see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Faces {
    /// It sees all of them.
    All,
    /// Backs of single-sided surfaces, as the rasteriser leaves them out.
    FrontsOnly,
}

/// Triangles of all instances in world space, and a tree over them.
pub(crate) struct World<'a> {
    pub scene: &'a Scene,
    pub srgb: Srgb,
    pub triangles: Vec<Triangle>,
    pub sources: Vec<Source>,
    tree: CwBvh,
    /// The instance's transform turns fronts into backs.
    mirrored: Vec<bool>,
    /// Takes object-space normals to world space, up to a positive length.
    pub normal_matrices: Vec<glam::Mat3A>,
}

impl<'a> World<'a> {
    /// Memory that gathering and sorting takes, at most: a triangle and its source twice, and the tree.
    pub const BYTES_PER_TRIANGLE: u64 = bvh::BYTES_PER_BOX + 2 * (size_of::<Triangle>() + size_of::<Source>()) as u64;

    /// Gathers and sorts. Triangles without three distinct finite corners are left out.
    pub fn new(scene: &'a Scene, lambert: bool) -> Self {
        let parts: Vec<(Vec<Triangle>, Vec<Source>)> =
            (0..scene.instances.len()).into_par_iter().map(|instance| gather(scene, instance, lambert)).collect();
        let (mut triangles, mut sources) = (Vec::new(), Vec::new());
        for (t, s) in parts {
            triangles.extend(t);
            sources.extend(s);
        }
        let mut tree = CwBvh::default();
        if !triangles.is_empty() {
            // Large triangles stay whole: a ray hits each triangle once, as half-covered ones need.
            tree = bvh::build(&padded_boxes(&triangles), Effort::Medium);
            triangles = tree.primitive_indices.par_iter().map(|i| triangles[*i as usize]).collect();
            sources = tree.primitive_indices.par_iter().map(|i| sources[*i as usize]).collect();
        }
        let linear = |i: &lanternfish_scene::Instance| i.world_from_object.matrix3;
        Self {
            scene,
            srgb: Srgb::new(),
            triangles,
            sources,
            tree,
            mirrored: scene.instances.iter().map(|i| linear(i).determinant() < 0.0).collect(),
            normal_matrices: scene.instances.iter().map(|i| cofactors(&i.world_from_object)).collect(),
        }
    }

    pub fn primitive(&self, source: &Source) -> &'a Primitive {
        let instance = &self.scene.instances[source.instance as usize];
        &self.scene.meshes[instance.mesh].primitives[source.primitive as usize]
    }

    pub fn material(&self, source: &Source) -> &'a Material {
        &self.scene.materials[self.primitive(source).material]
    }

    /// Indices of the triangle's corners in its primitive.
    pub fn corners(&self, source: &Source) -> [u32; 3] {
        let first = source.first_index as usize;
        let indices = &self.primitive(source).indices;
        [indices[first], indices[first + 1], indices[first + 2]]
    }

    /// The nearest surface. `key` decides which half-covered surfaces are there for this ray.
    pub fn closest(&self, origin: Vec3A, direction: Vec3A, faces: Faces, key: u64) -> Option<Hit> {
        let (ray, across) = ray(origin, direction, f32::INFINITY);
        let mut nearest = None;
        self.tree.ray_traverse(ray, &mut RayHit::none(), |ray, index| {
            let Some(hit) = self.intersect(ray, &across, index, faces) else { return f32::INFINITY };
            if self.sources[index].kind != Kind::Solid && unit_of(key, index as u32) >= self.coverage(&hit) {
                return f32::INFINITY;
            }
            nearest = Some(hit);
            hit.distance
        });
        nearest
    }

    /// Share of light, each channel, that passes from `origin` to `distance` along `direction`.
    pub fn transmittance(&self, origin: Vec3A, direction: Vec3A, distance: f32) -> Vec3 {
        let (ray, across) = ray(origin, direction, distance);
        let mut passes = Vec3::ONE;
        let is_open = self.tree.ray_traverse_miss(ray, |ray, index| {
            let Some(hit) = self.intersect(ray, &across, index, Faces::All) else { return f32::INFINITY };
            let stops = match self.sources[index].kind {
                Kind::Solid => true,
                Kind::Alpha => {
                    passes *= 1.0 - self.coverage(&hit);
                    passes == Vec3::ZERO
                }
                Kind::ThinDielectric => {
                    let through = crate::surface::thin_dielectric_transmittance(self, &hit, direction);
                    passes *= Vec3::ONE.lerp(through, self.coverage(&hit));
                    passes == Vec3::ZERO
                }
            };
            if stops { hit.distance } else { f32::INFINITY }
        });
        if is_open { passes } else { Vec3::ZERO }
    }

    /// Where the ray hits a triangle, if it does and may.
    ///
    /// Corners are projected along the ray, each by itself, and the edge functions of the projections have the right sign:
    /// products of 32 bits are exact in 64. So what is whole is whole in the projection, and no ray slips between triangles
    /// that share corners [Woop2013].
    fn intersect(&self, ray: &Ray, across: &Across, index: usize, faces: Faces) -> Option<Hit> {
        let triangle = &self.triangles[index];
        let a = triangle.v0 - ray.origin;
        let (pa, pb, pc) = (across.of(a), across.of(triangle.v1 - ray.origin), across.of(triangle.v2 - ray.origin));
        let (u, v, w) = (pb.perp_dot(pc), pc.perp_dot(pa), pa.perp_dot(pb));
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        if least < 0.0 && most > 0.0 {
            return None;
        }
        let normal = (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0);
        let slope = normal.dot(ray.direction);
        let distance = normal.dot(a) / slope;
        let sum = u + v + w;
        // Not a number, where the triangle is seen edge on.
        let in_reach = distance >= ray.tmin && distance < ray.tmax;
        if !in_reach || sum == 0.0 {
            return None;
        }
        let source = &self.sources[index];
        let front = (slope < 0.0) != self.mirrored[source.instance as usize];
        if faces == Faces::FrontsOnly && !front && !self.material(source).double_sided {
            return None;
        }
        let hit =
            Hit { distance, triangle: index as u32, weights: [u / sum, v / sum, w / sum].map(|w| w as f32), front };
        Some(hit)
    }

    /// Alpha as coverage: 0 in the holes of a mask, 1 elsewhere on it.
    pub fn coverage(&self, hit: &Hit) -> f32 {
        let source = &self.sources[hit.triangle as usize];
        let material = self.material(source);
        match material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } => f32::from(self.alpha(hit, source, material) >= cutoff),
            AlphaMode::Blend => self.alpha(hit, source, material),
        }
    }

    fn alpha(&self, hit: &Hit, source: &Source, material: &Material) -> f32 {
        let (primitive, corners) = (self.primitive(source), self.corners(source));
        let mut alpha = material.base_color.w;
        if !primitive.colors.is_empty() {
            let at = |i: usize| primitive.colors[corners[i] as usize].w * hit.weights[i];
            alpha *= at(0) + at(1) + at(2);
        }
        if let Some(reference) = &material.base_color_texture {
            let uv = texture::coordinates(reference, primitive, corners, hit.weights);
            alpha *= texture::sample(self.scene, &self.srgb, reference, Encoding::Linear, uv).w;
        }
        alpha
    }

    /// True if the triangle is seen from its front by who looks against `towards` (from the triangle to the viewer).
    pub fn is_front(&self, triangle: usize, towards: Vec3A) -> bool {
        let t = &self.triangles[triangle];
        let slope = (t.v1 - t.v0).cross(t.v2 - t.v0).dot(towards);
        (slope > 0.0) != self.mirrored[self.sources[triangle].instance as usize]
    }
}

fn gather(scene: &Scene, instance_index: usize, lambert: bool) -> (Vec<Triangle>, Vec<Source>) {
    let instance = &scene.instances[instance_index];
    let (mut triangles, mut sources) = (Vec::new(), Vec::new());
    for (number, primitive) in scene.meshes[instance.mesh].primitives.iter().enumerate() {
        let material = &scene.materials[primitive.material];
        let kind = match material.alpha_mode {
            _ if !lambert && is_thin_dielectric(material) => Kind::ThinDielectric,
            AlphaMode::Mask { .. } | AlphaMode::Blend => Kind::Alpha,
            AlphaMode::Opaque => Kind::Solid,
        };
        let world = |i: u32| Vec3A::from(instance.world_from_object.transform_point3(primitive.positions[i as usize]));
        for (i, corners) in primitive.indices.as_chunks::<3>().0.iter().enumerate() {
            let [v0, v1, v2] = corners.map(world);
            if v0 == v1 || v1 == v2 || v2 == v0 || !(v0.is_finite() && v1.is_finite() && v2.is_finite()) {
                continue;
            }
            triangles.push(Triangle { v0, v1, v2 });
            let (instance, primitive, first_index) = (instance_index as u32, number as u32, 3 * i as u32);
            sources.push(Source { instance, primitive, first_index, kind });
        }
    }
    (triangles, sources)
}

/// Boxes around triangles, larger by what the walk's slab tests may be wrong by: a ray that meets a triangle meets its box
/// [Ize2013]. Four roundings of the scene's largest coordinate, which bounds how far apart origin and box are.
fn padded_boxes(triangles: &[Triangle]) -> Vec<Aabb> {
    let largest = |t: &Triangle| t.v0.abs().max(t.v1.abs()).max(t.v2.abs()).max_element();
    let padding = Vec3A::splat(4.0 * f32::EPSILON * triangles.par_iter().map(largest).reduce(|| 0.0, f32::max));
    let padded = |t: &Triangle| {
        let bounds = t.aabb();
        Aabb::new(bounds.min - padding, bounds.max + padding)
    };
    triangles.par_iter().map(padded).collect()
}

/// Cofactors of the linear part, turned so that mirrored normals keep to their side.
fn cofactors(b_from_a: &Affine3A) -> glam::Mat3A {
    let m = b_from_a.matrix3;
    let side = m.determinant().signum();
    glam::Mat3A::from_cols(
        side * m.y_axis.cross(m.z_axis),
        side * m.z_axis.cross(m.x_axis),
        side * m.x_axis.cross(m.y_axis),
    )
}

/// Two directions that span the plane across a ray.
struct Across(Vec3A, Vec3A);

impl Across {
    /// A point seen from the ray's origin, projected along the ray.
    fn of(&self, p: Vec3A) -> DVec2 {
        DVec2::new(p.dot(self.0).into(), p.dot(self.1).into())
    }
}

/// A ray for the tree's walk, which takes a zero for positive and its inverse by its sign: negative zeros would miss boxes. So
/// would inverses that are cut at 2²³, as the tree's own are.
fn ray(origin: Vec3A, direction: Vec3A, length: f32) -> (Ray, Across) {
    let (x, y) = direction.any_orthonormal_pair();
    let direction = direction + Vec3A::ZERO;
    // Large enough to be no bound, small enough to be multiplied by any coordinate.
    let inv_direction = direction.recip().clamp(Vec3A::splat(-1e20), Vec3A::splat(1e20));
    (Ray { origin, direction, inv_direction, tmin: 0.0, tmax: length }, Across(x, y))
}

/// A place just off a surface at `p`, on the side to which `normal` points: off by some units in the last place of each
/// coordinate, by a fixed amount near the origin [Waechter2019].
pub(crate) fn offset(p: Vec3A, normal: Vec3A) -> Vec3A {
    const UNITS: f32 = 256.0;
    const NEAR: f32 = 1.0 / 32.0;
    const FIXED: f32 = 1.0 / 65536.0;
    let moved = |p: f32, n: f32| {
        if p.abs() < NEAR {
            return p + FIXED * n;
        }
        let step = (UNITS * n) as i32;
        f32::from_bits((p.to_bits() as i32 + if p < 0.0 { -step } else { step }) as u32)
    };
    Vec3A::new(moved(p.x, normal.x), moved(p.y, normal.y), moved(p.z, normal.z))
}
