//! Surfaces that deep images miss, and spurious ones, counted.

use glam::Vec3;
use lanternfish::{RenderError, gpu_scene::GpuScene};
use lanternfish_gpu::read_back;

use super::{images::DeepImages, shaders::DeepGrid, validate::Fragment};

/// Surfaces of images against those of a baseline: images of the same scene, directions and resolution, built by a draw for each direction.
/// Two fragments of one texel are the same surface if their depths differ by at most a texel. Fractions, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Holes {
    /// Fraction of the baseline's fragments without a match in the images.
    pub missing: f64,
    /// Fraction of the images' fragments without a match in the baseline.
    pub spurious: f64,
    /// `missing` among the fragments whose surface's normal and the image's axis have a cosine of up to 1/4, 1/2, 3/4 and 1.
    pub missing_by_cosine: [f64; 4],
    /// Ratio of the images' fragments to the baseline's.
    pub fragments: f64,
}

/// Counts of fragments: all, and those without a match.
#[derive(Clone, Copy, Default)]
struct Alone {
    all: usize,
    alone: usize,
}

impl Alone {
    fn fraction(self) -> f64 {
        self.alone as f64 / self.all.max(1) as f64
    }
}

/// The class of `missing_by_cosine` of a cosine.
fn class_of(cosine: f32) -> usize {
    ((4.0 * cosine.abs()).ceil() as usize).clamp(1, 4) - 1
}

/// Counts the fragments of `lists` by class; `alone` counts those without a match in `others`, lists of the same texels.
fn alone(
    lists: &[Vec<Fragment>],
    others: &[Vec<Fragment>],
    texel: f32,
    class: impl Fn(usize, &Fragment) -> usize,
) -> [Alone; 4] {
    let mut classes = [Alone::default(); 4];
    for (index, (list, other)) in lists.iter().zip(others).enumerate() {
        for fragment in list {
            let counted = &mut classes[class(index, fragment)];
            let has_partner = other.iter().any(|partner| (partner.depth - fragment.depth).abs() <= texel);
            counted.all += 1;
            counted.alone += usize::from(!has_partner);
        }
    }
    classes
}

impl DeepImages {
    /// Compares with `baseline`, images of the same scene. Both are read back.
    ///
    /// An error if a list is broken, if the two differ in directions, resolution, chunks or the scene's bounds, or if the baseline has no
    /// triangles.
    pub fn holes(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &GpuScene,
        baseline: &DeepImages,
    ) -> Result<Holes, RenderError> {
        let grids = |images: &DeepImages| -> Vec<_> {
            let of = |grid: &DeepGrid| {
                (grid.first_image, grid.image_count, grid.resolution, grid.center, grid.radius, grid.set_from_world)
            };
            images.chunks.iter().map(|chunk| of(&chunk.grid)).collect()
        };
        let is_alike = grids(self) == grids(baseline) && self.directions.set() == baseline.directions.set();
        let has_triangles = baseline.chunks.iter().all(|chunk| chunk.triangles.is_some());
        let (Some(triangles), true, true) = (scene.bvh_triangles(), is_alike, has_triangles) else {
            return Err(RenderError::Together {
                setting: "holes",
                needed: "images of one form with triangles, and their scene",
            });
        };
        let words = read_back::<[f32; 12]>(device, queue, triangles, scene.traced_triangles() as usize)?;
        let corner = |words: &[f32; 12], i: usize| Vec3::from_slice(&words[4 * i..]);
        let normal =
            |w: &[f32; 12]| (corner(w, 1) - corner(w, 0)).cross(corner(w, 2) - corner(w, 0)).normalize_or_zero();
        let normals: Vec<Vec3> = words.iter().map(normal).collect();
        let (mut missing, mut spurious) = ([Alone::default(); 4], Alone::default());
        for (chunk, other) in self.chunks.iter().zip(&baseline.chunks) {
            let (these, those) = (self.read_lists(device, queue, chunk)?, baseline.read_lists(device, queue, other)?);
            let texel = 1.0 / chunk.grid.texels_per_metre;
            let texels = chunk.grid.resolution.pow(2) as usize;
            let class = |list: usize, fragment: &Fragment| {
                let axis = self.directions.frame(chunk.grid.first_image + (list / texels) as u32).z_axis;
                fragment.triangle.map_or(0, |triangle| class_of(normals[triangle as usize].dot(axis)))
            };
            for (sum, counted) in missing.iter_mut().zip(alone(&those, &these, texel, class)) {
                *sum = Alone { all: sum.all + counted.all, alone: sum.alone + counted.alone };
            }
            let [counted, ..] = alone(&these, &those, texel, |_, _| 0);
            spurious = Alone { all: spurious.all + counted.all, alone: spurious.alone + counted.alone };
        }
        let all = missing
            .iter()
            .fold(Alone::default(), |sum, class| Alone { all: sum.all + class.all, alone: sum.alone + class.alone });
        Ok(Holes {
            missing: all.fraction(),
            spurious: spurious.fraction(),
            missing_by_cosine: missing.map(Alone::fraction),
            fragments: spurious.all as f64 / all.all.max(1) as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_without_a_partner_are_counted_by_class() {
        let list = |depths: &[f32]| depths.iter().map(|depth| Fragment { depth: *depth, triangle: None }).collect();
        let (these, those) = ([list(&[0.0, 2.0]), list(&[1.0])], [list(&[0.4, 5.0]), list(&[])]);
        let [first, second, ..] = alone(&these, &those, 0.5, |index, _| index);
        assert_eq!([(first.all, first.alone), (second.all, second.alone)], [(2, 1), (1, 1)]);
        assert_eq!([-1.0, -0.6, 0.5, 0.25, 0.0].map(class_of), [3, 2, 1, 0, 0]);
        assert_eq!(Alone::default().fraction(), 0.0);
    }
}
