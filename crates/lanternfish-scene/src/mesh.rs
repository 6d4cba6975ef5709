//! Triangle meshes in object space.

use glam::{Affine3A, Vec2, Vec3, Vec4};

use crate::motion::Deformation;

/// A list of primitives that are instanced together.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name in the file, or empty.
    pub name: String,
    /// Parts with one material each.
    pub primitives: Vec<Primitive>,
}

/// An indexed triangle list with one material. Attribute lists are as long as `positions`; those whose documentation says so may be empty.
#[derive(Clone, Debug, Default)]
pub struct Primitive {
    /// Index into [`crate::Scene::materials`].
    pub material: usize,
    /// Object space, m.
    pub positions: Vec<Vec3>,
    /// Unit length.
    pub normals: Vec<Vec3>,
    /// xyz: unit tangent along +u; w: sign of the bitangent, `cross(normal, tangent) * w`. Empty if the material
    /// has no normal map.
    pub tangents: Vec<Vec4>,
    /// First texture coordinates, origin top left. Empty: all zero.
    pub uv0: Vec<Vec2>,
    /// Second texture coordinates. Empty: all zero.
    pub uv1: Vec<Vec2>,
    /// Linear RGBA that multiplies the base colour, in 0..=1. Empty: white.
    pub colors: Vec<Vec4>,
    /// Three per triangle, counter-clockwise seen from the front; each below `positions.len()`.
    pub indices: Vec<u32>,
    /// Morph targets and skinning; `None` if the vertices are static.
    pub deformation: Option<Box<Deformation>>,
}

impl Primitive {
    /// Object-space bounding box of the positions.
    #[doc(hidden)]
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for p in &self.positions {
            bounds.add_point(*p);
        }
        bounds
    }
}

/// An axis-aligned box; empty when `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl Bounds {
    /// The empty box: the identity of [`Bounds::add_point`] and [`Bounds::add_bounds`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Grows to contain `p`.
    pub fn add_point(&mut self, p: Vec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Grows to contain `other`.
    #[doc(hidden)]
    pub fn add_bounds(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// True if the box is empty.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// True if `p` lies in the box or on its surface.
    pub(crate) fn contains(&self, p: Vec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Centre of the box; the origin for an empty one.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { 0.5 * (self.min + self.max) }
    }

    /// Edge lengths; zero for an empty one.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// The eight corners.
    #[doc(hidden)]
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// The box of the eight transformed corners.
    #[doc(hidden)]
    pub fn transformed(&self, b_from_a: &Affine3A) -> Self {
        let mut bounds = Self::EMPTY;
        if !self.is_empty() {
            self.corners().into_iter().for_each(|corner| bounds.add_point(b_from_a.transform_point3(corner)));
        }
        bounds
    }
}
