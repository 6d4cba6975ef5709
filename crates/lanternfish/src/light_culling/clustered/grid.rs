//! stub
#![allow(missing_docs)]
use glam::{Affine3A, UVec2, UVec3, Vec3};
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewFrustum {
    pub world_from_view: Affine3A,
    pub slopes: [f32; 4],
    pub near: f32,
    pub far: f32,
    pub parallel: bool,
    pub size: UVec2,
}
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClusterShape {
    Perspective { pixels: u32 },
    Orthographic { side: f32 },
    Displaced { pixels: u32, distance: f32 },
}
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridGeometry {
    pub world_from_cluster: Affine3A,
    pub low: Vec3,
    pub cell: Vec3,
    pub dimensions: UVec3,
    pub parallel: bool,
}
#[derive(Clone, Debug, PartialEq)]
pub enum GridError {
    Unaligned,
    TooMany { needed: u64, limit: u64 },
}
pub const MOST_CLUSTERS: u64 = 1 << 24;
impl GridGeometry {
    pub fn new(views: &[ViewFrustum], shape: ClusterShape) -> Result<Self, GridError> {
        let v = &views[0];
        let [l, r, b, t] = v.slopes;
        let pixels = match shape {
            ClusterShape::Perspective { pixels } => pixels,
            ClusterShape::Displaced { pixels, .. } => pixels,
            ClusterShape::Orthographic { side } => {
                let k = if v.parallel { 1.0 } else { v.far };
                let size = Vec3::new((r - l) * k, (t - b) * k, v.far - v.near);
                let d = (size / side).ceil().max(Vec3::ONE);
                return Ok(Self {
                    world_from_cluster: v.world_from_view,
                    low: Vec3::new(l * k, b * k, v.near),
                    cell: size / d,
                    dimensions: d.as_uvec3(),
                    parallel: true,
                });
            }
        };
        let p = pixels as f32;
        let cell = Vec3::new((r - l) * p / v.size.x as f32, (t - b) * p / v.size.y as f32, 0.0);
        let d = 0.5 * (cell.x + cell.y);
        let xy = UVec2::new(v.size.x.div_ceil(pixels), v.size.y.div_ceil(pixels));
        let (z, dz) = if v.parallel {
            let n = ((v.far - v.near) / d).ceil().max(1.0);
            (n, (v.far - v.near) / n)
        } else {
            let n = ((v.far / v.near).ln() / (1.0 + d).ln()).ceil().max(1.0);
            (n, (v.far / v.near).ln() / n)
        };
        let low_y = t - cell.y * xy.y as f32;
        Ok(Self {
            world_from_cluster: v.world_from_view,
            low: Vec3::new(l, low_y, v.near),
            cell: cell.with_z(dz),
            dimensions: xy.extend(z as u32),
            parallel: v.parallel,
        })
    }
    pub fn cluster_count(&self) -> u64 {
        u64::from(self.dimensions.x) * u64::from(self.dimensions.y) * u64::from(self.dimensions.z)
    }
}
