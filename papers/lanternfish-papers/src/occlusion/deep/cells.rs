//! Cached radiance of the environment around each direction of a set.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec4};
use lanternfish::{RenderError, environment_light::EnvironmentSample};
use lanternfish_gpu::{AcrossFrames, Frame, storage_buffer_of};

use crate::deep_images::directions::Directions;

/// Mean radiance of one environment image around each direction of one set. The set must be the same in every call, except for its
/// rotation.
#[derive(Debug, Default)]
pub(super) struct CellRadiances {
    cells: AcrossFrames<Option<Cells>>,
}

#[derive(Debug)]
struct Cells {
    samples: Arc<[EnvironmentSample]>,
    rotation: Quat,
    buffer: wgpu::Buffer,
}

impl CellRadiances {
    /// The radiances, bound as `cell_radiances`; computed again if the image or the rotation has changed.
    pub fn get(
        &mut self,
        frame: &Frame<'_>,
        samples: &Arc<[EnvironmentSample]>,
        directions: &Directions,
    ) -> Result<&wgpu::Buffer, RenderError> {
        let rotation = directions.rotation();
        let is_current = |cells: &Cells| Arc::ptr_eq(&cells.samples, samples) && cells.rotation == rotation;
        let cells = self.cells.get(frame);
        if !cells.as_ref().is_some_and(is_current) {
            let radiances = cell_radiances(samples, directions);
            let buffer = storage_buffer_of(frame.device, "occlusion/cells", &radiances, wgpu::BufferUsages::empty())?;
            *cells = Some(Cells { samples: samples.clone(), rotation, buffer });
        }
        Ok(&cells.as_ref().expect("created above if it was missing").buffer)
    }
}

/// Mean radiance of the part of the environment nearest to each direction: for each image of a set, of its axis and then of the opposite;
/// nits, w unused.
fn cell_radiances(samples: &[EnvironmentSample], directions: &Directions) -> Vec<Vec4> {
    let mut irradiance = vec![(DVec3::ZERO, 0.0f64); 2 * directions.len()];
    for sample in samples {
        let (image, reversed) = directions.nearest(sample.direction);
        let (radiance, solid_angle) = &mut irradiance[2 * image as usize + usize::from(reversed)];
        *radiance += sample.radiance.as_dvec3() * f64::from(sample.solid_angle);
        *solid_angle += f64::from(sample.solid_angle);
    }
    let mean = |(i, (radiance, solid_angle)): (usize, (DVec3, f64))| {
        if solid_angle > 0.0 {
            return (radiance / solid_angle).as_vec3().extend(0.0);
        }
        // The cell is smaller than an environment sample.
        let axis = directions.axes()[i / 2] * if i % 2 == 0 { 1.0 } else { -1.0 };
        let nearest = samples.iter().max_by(|a, b| a.direction.dot(axis).total_cmp(&b.direction.dot(axis)));
        nearest.map_or(Vec4::ZERO, |sample| sample.radiance.extend(0.0))
    };
    irradiance.into_iter().enumerate().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lanternfish::{environment_light::samples_of, view::rotations::frame_rotation};

    use super::*;
    use crate::{
        deep_images::directions::DirectionSet,
        testing::{half_white, image},
    };

    #[test]
    fn every_direction_has_the_mean_of_its_cell() {
        let set = Directions::new(DirectionSet::ZonalEqualArea { count: 169 }).unwrap();
        let even = samples_of(&image(32, 16, 0.0, |_| Vec3::new(0.3, 1.0, 7.0)));
        let half = samples_of(&half_white());
        for frame in [None, Some(0), Some(7)] {
            let rotated = set.rotated(frame.map_or(Quat::IDENTITY, frame_rotation));
            let cells = cell_radiances(&even, &rotated);
            let off = cells.iter().map(|cell| (*cell - Vec4::new(0.3, 1.0, 7.0, 0.0)).length());
            assert!(off.fold(0.0, f32::max) < 1e-6);
            // A cell is less than 10° wide.
            let wrong = |directions: &Directions| {
                let cells = cell_radiances(&half, directions);
                let axes = rotated.axes().iter().flat_map(|axis| [*axis, -*axis]);
                let is_wrong = |(axis, cell): &(Vec3, &Vec4)| axis.y.abs() > 0.2 && cell.x != f32::from(axis.y > 0.0);
                axes.zip(&cells).filter(is_wrong).count()
            };
            assert_eq!(wrong(&rotated), 0);
            // Negative control: cells of a set with another rotation.
            assert!(wrong(&set.rotated(frame_rotation(3))) > 50);
        }
        // The cells of the largest set are smaller than the environment samples at the equator; none may be black.
        let largest = Directions::new(DirectionSet::ZonalEqualArea { count: Directions::MAX_COUNT }).unwrap();
        assert!(cell_radiances(&even, &largest).iter().all(|cell| (cell.y - 1.0).abs() < 1e-6));
    }
}
