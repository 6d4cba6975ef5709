//! The scene's triangles in world space, and ray intersection.

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
    texture::{self, Encoding, Srgb},
};

/// Origin of a triangle in the scene's lists.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub instance: u32,
    pub primitive: u32,
    /// First of its three indices.
    pub first_index: u32,
    /// How the triangle transmits rays.
    pub kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Solid,
    /// Alpha mask or alpha blending.
    Alpha,
    /// Thin and smooth: light passes straight and is tinted, in proportion to alpha.
    ThinDielectric,
}

/// A hit point on a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Distance along the ray, m.
    pub distance: f32,
    pub triangle: u32,
    /// Barycentric coordinates of the three corners.
    pub weights: [f32; 3],
    /// True if the ray hit the front, the side with counter-clockwise winding in object space.
    pub front: bool,
}

/// Face culling of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Faces {
    /// No culling.
    All,
    /// Culls backs of single-sided surfaces, like the rasteriser.
    FrontsOnly,
}

/// Triangles of all instances in world space, and a BVH over them.
pub(crate) struct World<'a> {
    pub scene: &'a Scene,
    pub srgb: Srgb,
    pub triangles: Vec<Triangle>,
    pub sources: Vec<Source>,
    tree: CwBvh,
    /// True for each instance whose transform mirrors.
    mirrored: Vec<bool>,
    /// Matrix of each instance from object-space to world-space normals, up to a positive scale.
    pub normal_matrices: Vec<glam::Mat3A>,
}

impl<'a> World<'a> {
    /// Peak memory of the build per triangle: the triangle and its source twice, and the BVH.
    pub const BYTES_PER_TRIANGLE: u64 = bvh::BYTES_PER_BOX + 2 * (size_of::<Triangle>() + size_of::<Source>()) as u64;

    /// Gathers the triangles and builds the BVH. Triangles without three distinct finite corners are skipped.
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
            // Large triangles are not split: a ray must test each triangle once, for stochastic alpha.
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

    /// The nearest hit. `key` selects the random numbers of stochastic alpha.
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

    /// Transmittance per channel from `origin` to `distance` along `direction`.
    pub fn transmittance(&self, origin: Vec3A, direction: Vec3A, distance: f32) -> Vec3 {
        let (ray, across) = ray(origin, direction, distance);
        let mut passes = Vec3::ONE;
        let is_unoccluded = self.tree.ray_traverse_miss(ray, |ray, index| {
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
        if is_unoccluded { passes } else { Vec3::ZERO }
    }

    /// Intersects a ray with a triangle; face culling applies.
    ///
    /// Each corner is projected along the ray separately. The edge functions of the projections have the exact sign, because products of
    /// 32-bit floats are exact in 64 bits. So the intersection is watertight: no ray passes between triangles that share corners
    /// [Woop2013].
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
        // `distance` is NaN if the triangle is edge-on; the comparison then fails.
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

    /// Coverage from alpha. A mask has 0 in holes and 1 elsewhere.
    pub fn coverage(&self, hit: &Hit) -> f32 {
        let source = &self.sources[hit.triangle as usize];
        let material = self.material(source);
        match material.alpha_mode {
            AlphaMode::Opaque | AlphaMode::ShadowCatcher { .. } => 1.0,
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

    /// True if a viewer in direction `towards` (from the triangle to the viewer) sees the triangle's front.
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
            _ if !lambert && material.is_thin_dielectric() => Kind::ThinDielectric,
            AlphaMode::Mask { .. } | AlphaMode::Blend => Kind::Alpha,
            AlphaMode::Opaque | AlphaMode::ShadowCatcher { .. } => Kind::Solid,
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

/// Boxes around triangles, padded by the rounding error of slab tests, so that a ray that hits a triangle also hits its box [Ize2013].
/// The padding is four epsilons of the scene's largest coordinate, which bounds the distance between origin and box.
fn padded_boxes(triangles: &[Triangle]) -> Vec<Aabb> {
    let largest = |t: &Triangle| t.v0.abs().max(t.v1.abs()).max(t.v2.abs()).max_element();
    let padding = Vec3A::splat(4.0 * f32::EPSILON * triangles.par_iter().map(largest).reduce(|| 0.0, f32::max));
    let padded = |t: &Triangle| {
        let bounds = t.aabb();
        Aabb::new(bounds.min - padding, bounds.max + padding)
    };
    triangles.par_iter().map(padded).collect()
}

/// Cofactors of the linear part, with the sign of its determinant, so that mirrored normals keep their side.
fn cofactors(b_from_a: &Affine3A) -> glam::Mat3A {
    let m = b_from_a.matrix3;
    let side = m.determinant().signum();
    glam::Mat3A::from_cols(
        side * m.y_axis.cross(m.z_axis),
        side * m.z_axis.cross(m.x_axis),
        side * m.x_axis.cross(m.y_axis),
    )
}

/// Two axes that span the plane perpendicular to a ray.
struct Across(Vec3A, Vec3A);

impl Across {
    /// Projects a point, relative to the ray's origin, along the ray.
    fn of(&self, p: Vec3A) -> DVec2 {
        DVec2::new(p.dot(self.0).into(), p.dot(self.1).into())
    }
}

/// A ray for BVH traversal. Traversal takes a zero component for positive, but uses the sign of its inverse, so negative zeros would miss
/// boxes; they are replaced by positive ones. Inverses clamped at 2²³, as in the BVH library's constructor, would also miss boxes.
fn ray(origin: Vec3A, direction: Vec3A, length: f32) -> (Ray, Across) {
    let (x, y) = direction.any_orthonormal_pair();
    let direction = direction + Vec3A::ZERO;
    // Large enough not to limit any intersection, small enough not to overflow in products with coordinates.
    let inv_direction = direction.recip().clamp(Vec3A::splat(-1e20), Vec3A::splat(1e20));
    (Ray { origin, direction, inv_direction, tmin: 0.0, tmax: length }, Across(x, y))
}

/// A ray origin offset from a surface at `p` towards `normal`, by some units in the last place of each coordinate, or by a fixed amount
/// near the origin [Waechter2019].
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
