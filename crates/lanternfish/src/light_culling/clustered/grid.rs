//! Geometry of the cluster grid: the space that it divides, and the number of clusters [VanGelderen2020, §3.1, §4.1–4.4].
//!
//! Computed once a frame in double precision from the cameras' frusta; `cluster_grid.wesl` reads it.

#[cfg(test)]
mod tests;

use std::{fmt, str::FromStr};

use glam::{Affine3A, DAffine3, DVec2, DVec3, UVec2, UVec3, Vec3};

use lanternfish_scene::Setting;

use crate::view::frustum::{ViewFrustum, corners_of, enclosing, mean_origin, world_from_head};

/// The shape of the clusters [VanGelderen2020, table 5.1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClusterShape {
    /// `perspective P`: perspective clusters, P pixels wide and high, as deep as they are wide. 0 pixels count as 1.
    Perspective {
        /// Width and height of a cluster, pixels. More: fewer clusters, and more lights in each.
        pixels: u32,
    },
    /// `orthographic S`: cubes.
    Orthographic {
        /// Side of a cluster, m; above 0. More: fewer clusters, and more lights in each.
        side: f32,
    },
    /// `displaced P D`: perspective clusters from an eye D m behind the camera, of the same mean volume.
    Displaced {
        /// Width and height, pixels, of the undisplaced clusters that have the same volume.
        pixels: u32,
        /// Distance from the camera back along its axis, m; not negative. More: clusters closer to cubes, larger ones near the camera and
        /// smaller ones far away. More than 16 times the far plane's distance counts as that.
        distance: f32,
    },
}

/// Greatest length of a shape that the parser accepts, m; squares and volumes stay finite.
const FARTHEST: f32 = 1e12;

/// `persp:P`, `ortho:S` or `displ:P:D` [VanGelderen2020, table 5.1].
impl fmt::Display for ClusterShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Perspective { pixels } => write!(f, "persp:{pixels}"),
            Self::Orthographic { side } => write!(f, "ortho:{side}"),
            Self::Displaced { pixels, distance } => write!(f, "displ:{pixels}:{distance}"),
        }
    }
}

impl FromStr for ClusterShape {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            "expected persp:PIXELS, ortho:METRES or displ:PIXELS:METRES, e.g. persp:32, ortho:2 or displ:64:32";
        let pixels = |text: &str| {
            let pixels = text.parse::<u32>().ok().filter(|pixels| (4..=4096).contains(pixels));
            pixels.ok_or_else(|| format!("{text:?} pixels: expected 4 to 4096"))
        };
        let metres = |text: &str| {
            let metres = text.trim().parse().ok().filter(|metres: &f32| metres.is_finite());
            let metres = metres.ok_or_else(|| format!("{text:?} metres: expected a number"))?;
            let fits = metres > 0.0 && metres <= FARTHEST;
            fits.then_some(metres)
                .ok_or_else(|| format!("{text:?} metres: expected metres, more than 0, at most {FARTHEST:e}"))
        };
        match text.split(':').collect::<Vec<_>>()[..] {
            ["persp", size] => Ok(Self::Perspective { pixels: pixels(size)? }),
            ["ortho", side] => Ok(Self::Orthographic { side: metres(side)? }),
            ["displ", size, distance] => Ok(Self::Displaced { pixels: pixels(size)?, distance: metres(distance)? }),
            _ => Err(expected.to_owned()),
        }
    }
}

impl Setting for ClusterShape {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = text.parse()?;
        Ok(())
    }
}

/// Geometry of a cluster grid.
///
/// Cluster space has the clustering camera at the origin looking down −z, m. A perspective grid divides x and y over distance, and the
/// logarithm of the distance, evenly; a parallel grid divides x, y and the distance [VanGelderen2020, §3.1, §4.2].
///
/// The default has no clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridGeometry {
    /// Cluster space to world, rotation and translation only.
    pub world_from_cluster: Affine3A,
    /// x, y: least slopes (or coordinates, m); z: least distance, m, above 0 unless `parallel`.
    pub low: Vec3,
    /// Size of a cluster in the same terms; z: logarithm of the ratio of successive distances (through the eye), or m.
    pub cell: Vec3,
    /// Clusters along x, y and z; none is 0.
    pub dimensions: UVec3,
    /// True for parallel sides (boxes); false for a perspective grid.
    pub parallel: bool,
}

/// Reasons why there is no grid.
#[derive(Clone, Debug, PartialEq)]
pub enum GridError {
    /// No frustum contains all views: perspective and displaced shapes need views with roughly the same direction.
    Unaligned,
    /// More than [`MOST_CLUSTERS`]: larger clusters or a shorter span of distances give fewer.
    TooMany {
        /// Number of clusters needed; `u64::MAX` for a side of 0 or less.
        needed: u64,
        /// [`MOST_CLUSTERS`].
        limit: u64,
    },
}

/// Greatest number of clusters of a grid; the starts of their lists then take 64 MiB.
pub const MOST_CLUSTERS: u64 = 1 << 24;

impl GridGeometry {
    /// One grid for all of these views (individual clustering calls it with one). `views` must not be empty, and each view must satisfy its
    /// fields' documentation: near below far, left below right, bottom below top, all finite; this is not checked.
    ///
    /// *Perspective*, one view: cluster space is view space, and clusters are exactly P pixels wide and high from the left and the *top*
    /// edge, like tiles; the last column and the lowest row (y = 0) may extend beyond the view. Several views: the grid divides the frustum
    /// of [`enclosing`], into clusters whose volume is the mean of the views' own [VanGelderen2020, eq. 4.4].
    ///
    /// *Displaced*: the same with that frustum's eye moved back, also for one view.
    ///
    /// *Orthographic*: the box around all corners, along the axes of the view (one view), of the mean orientation (aligned views) or of the
    /// world (other views).
    ///
    /// Parallel views have no eye: for one view, perspective and displaced give clusters P pixels wide and high and as deep as wide; for
    /// several, cubes of the mean volume.
    ///
    /// Every corner of every view is inside. Clusters are longer than requested where shaders could not distinguish them in f32: more than
    /// 4096 along an axis, or 1400 layers of a telescope's view.
    pub fn new(views: &[ViewFrustum], shape: ClusterShape) -> Result<Self, GridError> {
        let geometry = match (shape, views) {
            (ClusterShape::Orthographic { side }, _) => Self::of_cubes(&enclosing_box(views), f64::from(side)),
            (ClusterShape::Perspective { pixels }, [view]) => Self::of_pixels(view, pixels),
            (ClusterShape::Displaced { pixels, .. }, [view]) if view.parallel => Self::of_pixels(view, pixels),
            (ClusterShape::Perspective { pixels }, _) => {
                Self::of_volume(&enclosing(views).ok_or(GridError::Unaligned)?, own_volume(views, pixels))
            }
            (ClusterShape::Displaced { pixels, distance }, _) => {
                let frustum = enclosing(views).ok_or(GridError::Unaligned)?;
                Self::of_volume(&frustum.displaced(distance), own_volume(views, pixels))
            }
        };
        let needed = geometry.cluster_count();
        if needed > MOST_CLUSTERS {
            return Err(GridError::TooMany { needed, limit: MOST_CLUSTERS });
        }
        Ok(geometry)
    }

    /// Like [`GridGeometry::new`], but doubles the pixels of a cluster until the grid has at most [`MOST_CLUSTERS`], for a large image or a
    /// telescope's view. If it doubled them, it also returns the pixels used.
    pub fn fitting(views: &[ViewFrustum], shape: ClusterShape) -> Result<(Self, Option<u32>), GridError> {
        let (requested, with): (_, &dyn Fn(u32) -> ClusterShape) = match shape {
            ClusterShape::Orthographic { .. } => return Ok((Self::new(views, shape)?, None)),
            ClusterShape::Perspective { pixels } => (pixels.max(1), &|pixels| ClusterShape::Perspective { pixels }),
            ClusterShape::Displaced { pixels, distance } => {
                (pixels.max(1), &move |pixels| ClusterShape::Displaced { pixels, distance })
            }
        };
        let mut pixels = requested;
        loop {
            match (Self::new(views, with(pixels)), pixels.checked_mul(2)) {
                (Err(GridError::TooMany { .. }), Some(twice)) => pixels = twice,
                (grid, _) => return Ok((grid?, (pixels != requested).then_some(pixels))),
            }
        }
    }

    /// Corners of a cluster's full extent, world space, m: x first, then y, then z, farther ones last. `index` is its index in the grid: x
    /// fastest, then y, then z.
    pub fn corners(&self, index: u32) -> [Vec3; 8] {
        let UVec3 { x, y, .. } = self.dimensions.max(UVec3::ONE);
        self.corners_between(UVec3::new(index % x, index / x % y, index / x / y), UVec3::ONE)
    }

    /// Corners of the grid, in the same order.
    pub fn outline(&self) -> [Vec3; 8] {
        self.corners_between(UVec3::ZERO, self.dimensions)
    }

    fn corners_between(&self, first: UVec3, count: UVec3) -> [Vec3; 8] {
        std::array::from_fn(|corner| {
            let step = UVec3::new(corner as u32 & 1, corner as u32 >> 1 & 1, corner as u32 >> 2) * count;
            let offset = (first + step).as_dvec3() * self.cell.as_dvec3();
            let low = self.low.as_dvec3();
            let (across, distance) = match self.parallel {
                true => (low.truncate() + offset.truncate(), low.z + offset.z),
                false => {
                    let distance = low.z * offset.z.exp();
                    ((low.truncate() + offset.truncate()) * distance, distance)
                }
            };
            self.world_from_cluster.as_daffine3().transform_point3(across.extend(-distance)).as_vec3()
        })
    }

    /// Number of clusters of the grid, including those that no view shows.
    pub fn cluster_count(&self) -> u64 {
        self.dimensions.to_array().into_iter().fold(1, |count, along| count.saturating_mul(u64::from(along)))
    }

    /// Mean volume of a cluster, m³: the grid's volume over the number of clusters [VanGelderen2020, eq. 4.2].
    pub fn mean_volume(&self) -> f64 {
        let cell = self.cell.as_dvec3();
        if self.parallel {
            return cell.element_product();
        }
        let near = f64::from(self.low.z);
        let layers = f64::from(self.dimensions.z);
        // (f³ − n³) / 3, with the ratio first: it may be nearly 1.
        cell.x * cell.y * near.powi(3) * (3.0 * cell.z * layers).exp_m1() / (3.0 * layers)
    }

    /// Perspective clusters of so many pixels, as deep as wide [VanGelderen2020, eq. 3.4–3.6].
    fn of_pixels(view: &ViewFrustum, pixels: u32) -> Self {
        let pixels = pixels.max(1);
        let size = view.size.max(UVec2::ONE);
        let cell = extent(view).truncate() * f64::from(pixels) / size.as_dvec2();
        let width = 0.5 * (cell.x + cell.y);
        let (columns, rows) = (size.x.div_ceil(pixels), size.y.div_ceil(pixels));
        let depth = if view.parallel { width } else { width.ln_1p() };
        let layers = cluster_count_along(extent(view).z / depth, most_cells(view).z);
        let bottom = f64::from(view.slopes[3]) - cell.y * f64::from(rows);
        Self {
            world_from_cluster: view.world_from_view,
            low: DVec3::new(f64::from(view.slopes[0]), bottom, f64::from(view.near)).as_vec3(),
            cell: cell.extend(extent(view).z / f64::from(layers)).as_vec3(),
            dimensions: UVec3::new(columns, rows, layers),
            parallel: view.parallel,
        }
    }

    /// Clusters of about this volume, m³, that divide the frustum exactly [VanGelderen2020, eq. 4.3–4.5].
    fn of_volume(frustum: &ViewFrustum, volume: f64) -> Self {
        if frustum.parallel {
            return Self::of_cubes(frustum, volume.cbrt());
        }
        let width = cluster_width(volume_factor(frustum) * volume);
        Self::divided(frustum, DVec2::splat(width).extend(width.ln_1p()))
    }

    /// Cubes of about this side, m, that divide a parallel frustum exactly [VanGelderen2020, eq. 4.7, eq. 4.8].
    fn of_cubes(frustum: &ViewFrustum, side: f64) -> Self {
        Self::divided(frustum, DVec3::splat(side))
    }

    /// Clusters of at most the size `cell`; up to a millionth larger if that avoids a layer due to rounding.
    fn divided(frustum: &ViewFrustum, cell: DVec3) -> Self {
        let extent = extent(frustum);
        let (counts, most) = (extent / cell * (1.0 - 1e-6), most_cells(frustum));
        let dimensions = UVec3::new(
            cluster_count_along(counts.x, most.x),
            cluster_count_along(counts.y, most.y),
            cluster_count_along(counts.z, most.z),
        );
        Self {
            world_from_cluster: frustum.world_from_view,
            low: Vec3::new(frustum.slopes[0], frustum.slopes[2], frustum.near),
            cell: (extent / dimensions.as_dvec3()).as_vec3(),
            dimensions,
            parallel: frustum.parallel,
        }
    }
}

/// Number of clusters: rounded up, at least 1 and about `most`; `u32::MAX` for an invalid count (a side of 0 or less).
fn cluster_count_along(count: f64, most: f64) -> u32 {
    if count.is_finite() && count >= 0.0 { count.min(most).ceil().max(1.0) as u32 } else { u32::MAX }
}

/// Greatest number of clusters along each axis for which the sides' error in shaders is at most half of the padding of
/// `cluster_volume.wesl`, 2e-3.
///
/// In an even division, the error of a coordinate is some four roundings of the largest one, 4 · 2⁻²⁴ = 2.4e-7 of it: 1e-3 of one of 4096
/// clusters. The error of the logarithm of a distance over the near one is up to 2⁻²¹ or 3 ulp. The error of the distance from `exp` is 3 +
/// 2 ln(f / n) ulp (the limits of WGSL), that of the division and of the distance itself 3 ulp. Together this is at most 1.2e-6 + 6e-7 ln(f
/// / n), which is 1e-3 of one of this many layers.
fn most_cells(frustum: &ViewFrustum) -> DVec3 {
    let [left, right, bottom, top] = frustum.slopes.map(|slope| f64::from(slope).abs());
    let (near, far) = (f64::from(frustum.near).abs(), f64::from(frustum.far).abs());
    let extent = extent(frustum);
    let even = 4096.0 * extent / DVec3::new(left.max(right), bottom.max(top), near.max(far));
    let layers = if frustum.parallel { even.z } else { extent.z / (1.2e-3 + 6e-4 * extent.z) };
    even.truncate().extend(layers)
}

/// The evenly divided extent: Δx and Δy as slopes or m, and the logarithm of far over near, or m.
fn extent(frustum: &ViewFrustum) -> DVec3 {
    let [left, right, bottom, top] = frustum.slopes.map(f64::from);
    let (near, far) = (f64::from(frustum.near), f64::from(frustum.far));
    let depth = if frustum.parallel { far - near } else { (far / near).ln() };
    DVec3::new(right - left, top - bottom, depth)
}

/// The box around all corners, as a parallel frustum [VanGelderen2020, §4.2].
fn enclosing_box(views: &[ViewFrustum]) -> ViewFrustum {
    let axes = match views {
        [view] => view.world_from_view.as_daffine3(),
        // An origin near the cameras keeps coordinates, and their rounding, small.
        _ => world_from_head(views).unwrap_or_else(|| DAffine3::from_translation(mean_origin(views))),
    };
    ViewFrustum::around(axes, &corners_of(views), true, views[0].size)
}

/// Mean over the views of the mean volume, m³, of each view's own clusters.
///
/// The thesis divides the volume of a frustum by the number of its clusters. This function divides the volume of the grid, of which the
/// last column and row may lie outside the frustum: the volume of a cluster then does not depend on whether the number of pixels is a
/// multiple of P.
fn own_volume(views: &[ViewFrustum], pixels: u32) -> f64 {
    let sum: f64 = views.iter().map(|view| GridGeometry::of_pixels(view, pixels).mean_volume()).sum();
    sum / views.len() as f64
}

/// 3 ln(f / n) / (f³ − n³): times a volume, the right side of [VanGelderen2020, eq. 4.4], where z₀ = −f, z₁ = −n.
fn volume_factor(frustum: &ViewFrustum) -> f64 {
    let ratio = extent(frustum).z;
    3.0 * ratio / (f64::from(frustum.near).powi(3) * (3.0 * ratio).exp_m1())
}

/// The width d at distance 1 that solves d² ln(1 + d) = `target` by Newton–Raphson [VanGelderen2020, eq. 4.4].
///
/// The left side is increasing and convex, and the first guess, which replaces ln(1 + d) by d, is below the root: the first step overshoots
/// and the others decrease to the root.
fn cluster_width(target: f64) -> f64 {
    let mut width = target.cbrt();
    for _ in 0..NEWTON_STEPS {
        let log = width.ln_1p();
        let slope = 2.0 * width * log + width * width / (1.0 + width);
        let step = (width * width * log - target) / slope;
        width -= step;
        if step.abs() <= 1e-12 * width {
            break;
        }
    }
    width
}

/// Greatest number of steps. A d up to 1 takes 5. For a large d the first step overshoots to about its square, which each step halves: 18
/// steps at 1e12, wider than any frustum of pixels.
const NEWTON_STEPS: u32 = 32;
