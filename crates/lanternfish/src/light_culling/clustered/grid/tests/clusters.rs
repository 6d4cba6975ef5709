//! Grids contain their views and have clusters of the requested size.

use std::{cell::Cell, f32::consts::PI};

use glam::{Affine3A, DVec3, UVec2, UVec3};
use proptest::prelude::*;

use super::{
    super::*,
    ROUNDED, Rig, any_shape, check,
    cpu_reference::{Wrong, point_of},
    grid_frustum, narrowed, outside, rig, view, vive, volume,
};

#[test]
fn newton_solves_equation_4_4() {
    for exponent in -300..=240 {
        let target = 10f64.powf(f64::from(exponent) / 10.0);
        let d = cluster_width(target);
        let error = d * d * d.ln_1p() / target - 1.0;
        assert!(error.abs() < 1e-6, "{target:e}: d = {d:e} is off by {error:e}");
    }
}

#[test]
fn enclosed_clusters_have_the_views_mean_volume_up_to_the_ceiling() {
    let tested = Cell::new(0);
    check((rig(), 24u32..300, 0.0f32..50.0), |(rig, pixels, distance)| {
        let eyes = rig.eyes();
        // Mean volume of the clusters of P pixels, by their definition.
        let own = eyes.map(|eye| GridGeometry::of_pixels(&eye, pixels));
        let target =
            own.map(|grid| volume(&grid_frustum(&grid)) / grid.cluster_count() as f64).iter().sum::<f64>() / 2.0;
        let enclosed = enclosing(&eyes).unwrap();
        for (shape, frustum) in [
            (ClusterShape::Perspective { pixels }, enclosed),
            (ClusterShape::Displaced { pixels, distance }, enclosed.displaced(distance)),
        ] {
            let Ok(grid) = GridGeometry::new(&eyes, shape) else { continue };
            let extent = extent(&frustum);
            let d = cluster_width(volume_factor(&frustum) * target);
            let exact = extent / DVec3::new(d, d, d.ln_1p());
            if exact.cmpgt(most_cells(&frustum)).any() {
                continue;
            }
            tested.set(tested.get() + 1);
            let fraction = grid.mean_volume() / target * (grid.dimensions.as_dvec3() / exact).element_product();
            // f32 cells: 1.2e-7 · 3 ln(far / near) and a far plane rounded outwards.
            prop_assert!((fraction - 1.0).abs() < 2e-5, "{fraction}");
            prop_assert!(grid.mean_volume() <= target * (1.0 + 2e-5));
            let rounded_up = grid.dimensions.as_dvec3().cmpge(exact * (1.0 - 2e-6));
            prop_assert!(rounded_up.all() && grid.dimensions.as_dvec3().cmplt(exact + 1.0).all());
            let volume_of_all = grid.mean_volume() * grid.cluster_count() as f64;
            prop_assert!((volume_of_all / volume(&frustum) - 1.0).abs() < 2e-5);
        }
        Ok(())
    });
    assert!(tested.get() > 500, "only {} grids", tested.get());
}

#[test]
fn every_grid_contains_every_corner() {
    let tested = Cell::new(0);
    let holds = |(rig, shape, single, parallel): (Rig, ClusterShape, bool, bool)| {
        let views = rig.eyes().map(|eye| ViewFrustum { parallel, ..eye });
        let views = if single { &views[..1] } else { &views[..] };
        let Ok(grid) = GridGeometry::new(views, shape) else { return Ok(()) };
        tested.set(tested.get() + 1);
        let grid = grid_frustum(&grid);
        let excess = outside(&grid, &corners_of(views));
        prop_assert!(excess <= ROUNDED, "{excess:e}: {grid:?}");
        // Columns of pixels may extend beyond the right side and rows beyond the bottom; a displaced grid is fitted to a frustum.
        let (sides, corners) = match shape {
            ClusterShape::Perspective { .. } if single => ([0, 3].as_slice(), corners_of(views)),
            ClusterShape::Orthographic { .. } => ([0, 1, 2, 3].as_slice(), corners_of(views)),
            _ => ([0, 1, 2, 3].as_slice(), enclosing(views).unwrap().exact_corners().to_vec()),
        };
        for side in sides.iter().filter(|_| !(parallel && single)) {
            let excess = outside(&narrowed(&grid, *side), &corners);
            prop_assert!(excess > 5e-3, "insensitive to side {side} moved inwards by 1 %: {excess}");
        }
        Ok(())
    };
    check((rig(), any_shape(), any::<bool>(), any::<bool>()), holds);
    assert!(tested.get() > 300, "only {} grids", tested.get());
}

#[test]
fn perspective_clusters_tile_pixels() {
    for parallel in [false, true] {
        for (size, pixels) in [((1080, 1200), 24), ((1920, 1080), 64), ((100, 60), 16), ((7, 5), 8), ((64, 64), 1)] {
            let size = UVec2::from(size);
            let view = ViewFrustum { size, parallel, ..view([-1.39, 1.25, -1.47, 1.46], 0.1, 100.0) };
            let grid = GridGeometry::new(&[view], ClusterShape::Perspective { pixels }).unwrap();
            let tiles = UVec2::new(size.x.div_ceil(pixels), size.y.div_ceil(pixels));
            assert_eq!(grid.dimensions.truncate(), tiles);
            for pixel in (0..size.x.max(size.y)).map(|i| UVec2::splat(i).min(size - 1)) {
                let uv = (pixel.as_dvec2() + 0.5) / size.as_dvec2();
                let p_view = point_of(&view, [uv.x, 1.0 - uv.y], 0.5).as_vec3();
                let cluster = grid.cluster_from_grid(grid.grid_from_cluster(p_view, Wrong(0.0)));
                // Rows of pixels are numbered downwards, rows of clusters upwards.
                let tile = UVec2::new(cluster.x, tiles.y - 1 - cluster.y);
                assert_eq!(tile, pixel / pixels, "pixel {pixel} of {size}, {pixels} wide");
            }
            // As deep as wide, up to rounding up the number of layers (eq. 3.4, eq. 3.6).
            let width = 0.5 * f64::from(grid.cell.x + grid.cell.y);
            let width = if parallel { width } else { width.ln_1p() };
            let depth = f64::from(grid.cell.z);
            let least = 1.0 - 1.0 / f64::from(grid.dimensions.z);
            assert!(depth <= width * (1.0 + 1e-6) && depth > least * width || grid.dimensions.z == 1);
        }
    }
}

#[test]
fn opposite_views_have_orthographic_grids_only() {
    let front = vive().eyes()[0];
    for angle in [1.6, 3.0, PI] {
        let rear = ViewFrustum { world_from_view: Affine3A::from_rotation_y(angle), ..front };
        let views = [front, rear];
        for shape in [ClusterShape::Perspective { pixels: 64 }, ClusterShape::Displaced { pixels: 64, distance: 5.0 }] {
            assert_eq!(GridGeometry::new(&views, shape), Err(GridError::Unaligned));
        }
        let grid = GridGeometry::new(&views, ClusterShape::Orthographic { side: 2.0 }).unwrap();
        assert_eq!(grid.world_from_cluster.matrix3, Affine3A::IDENTITY.matrix3);
        assert!(outside(&grid_frustum(&grid), &corners_of(&views)) <= ROUNDED);
        assert!(grid.cell.max_element() < 2.0 * (1.0 + 2e-6) && grid.cell.min_element() > 1.9);
    }
}

#[test]
fn too_many_clusters_are_refused() {
    let cube = ViewFrustum { parallel: true, ..view([-128.0, 128.0, -128.0, 128.0], 0.0, 256.0) };
    let orthographic = |side| GridGeometry::new(&[cube], ClusterShape::Orthographic { side });
    let too_many = |needed| Err(GridError::TooMany { needed, limit: MOST_CLUSTERS });
    assert_eq!(orthographic(1.0).unwrap().dimensions, UVec3::splat(256));
    assert_eq!(orthographic(0.999), too_many(257 * 257 * 257));
    assert!(matches!(orthographic(1e-30), Err(GridError::TooMany { .. })));
    for side in [0.0, -1.0, f32::NAN] {
        assert_eq!(orthographic(side), too_many(u64::MAX));
    }
    // The clusters of a telescope's view are thin.
    let telescope = view([-1e-5, 1e-5, -1e-5, 1e-5], 0.1, 1e6);
    let grid = GridGeometry::new(&[telescope], ClusterShape::Perspective { pixels: 8 });
    assert!(matches!(grid, Err(GridError::TooMany { .. })));
    assert!(GridGeometry::fitting(&[cube], ClusterShape::Orthographic { side: 0.999 }).is_err());
}

#[test]
fn where_clusters_would_be_too_many_they_are_larger() {
    let telescope = view([-1e-5, 1e-5, -1e-5, 1e-5], 0.1, 1e6);
    let wide = view([-0.5, 0.5, -0.5, 0.5], 0.1, 1000.0);
    let large = ViewFrustum { size: UVec2::splat(16_384), ..wide };
    let small = ViewFrustum { size: UVec2::splat(512), ..wide };
    let perspective = |pixels| ClusterShape::Perspective { pixels };
    let displaced = |pixels| ClusterShape::Displaced { pixels, distance: 2.0 };
    let cases: [(&dyn Fn(u32) -> ClusterShape, _, u32); 3] =
        [(&perspective, telescope, 8), (&perspective, large, 32), (&displaced, large, 32)];
    for (shape, view, pixels) in cases {
        let (grid, taken) = GridGeometry::fitting(&[view], shape(pixels)).unwrap();
        let taken = taken.expect("larger ones");
        assert!(grid.cluster_count() <= MOST_CLUSTERS && taken.is_multiple_of(pixels), "{taken}");
        assert_eq!(GridGeometry::new(&[view], shape(taken)), Ok(grid));
        assert!(GridGeometry::new(&[view], shape(taken / 2)).is_err(), "no larger than they must be");
        let grid = GridGeometry::new(&[small], shape(32)).unwrap();
        assert_eq!(GridGeometry::fitting(&[small], shape(32)), Ok((grid, None)));
    }
}

#[test]
fn extreme_views_have_finite_grids() {
    for slope in [1e-6f32, 1e-3, 1.0, 114.6] {
        for (near, far) in [(1e-3, 1e4), (0.1, 0.100001), (1e4, 1e5), (1e-3, 1e-2)] {
            for count in 1..3 {
                let rig = Rig { slopes: [-slope, slope, -slope, slope], near, far, ..vive() };
                let views = &rig.eyes()[..count];
                for shape in [
                    ClusterShape::Perspective { pixels: 1 << 20 },
                    ClusterShape::Perspective { pixels: 64 },
                    ClusterShape::Orthographic { side: 1e9 },
                    ClusterShape::Orthographic { side: 1.0 },
                    ClusterShape::Displaced { pixels: 64, distance: 1e-9 },
                    ClusterShape::Displaced { pixels: 64, distance: 1e9 },
                ] {
                    let grid = match GridGeometry::new(views, shape) {
                        Ok(grid) => grid,
                        Err(GridError::TooMany { needed, .. }) if needed > MOST_CLUSTERS => continue,
                        Err(error) => panic!("{error:?}: {shape:?} of {views:?}"),
                    };
                    assert!(grid.low.is_finite() && grid.cell.is_finite() && grid.world_from_cluster.is_finite());
                    assert!(grid.dimensions.min_element() > 0 && grid.cell.min_element() > 0.0, "{grid:?}");
                    assert!(grid.parallel || grid.low.z > 0.0);
                    assert!(grid.mean_volume() > 0.0 && grid.mean_volume().is_finite());
                    assert!(outside(&grid_frustum(&grid), &corners_of(views)) <= ROUNDED, "{grid:?} of {views:?}");
                }
            }
        }
    }
}

/// A cluster's corners lie on the sides of the shader's CPU reference, and the outline of all clusters is the frustum.
#[test]
fn corners_of_clusters_tile_the_frustum() {
    for shape in [ClusterShape::Perspective { pixels: 60 }, ClusterShape::Orthographic { side: 7.0 }] {
        let [eye, _] = vive().eyes();
        let grid = GridGeometry::new(&[eye], shape).unwrap();
        let outline = grid.outline();
        let near = |a: Vec3, b: Vec3| a.distance(b) < 1e-4 * eye.far;
        let count = grid.cluster_count() as u32;
        assert!(near(grid.corners(0)[0], outline[0]) && near(grid.corners(count - 1)[7], outline[7]));
        // Each cluster begins where the previous one ends.
        let UVec3 { x, y, .. } = grid.dimensions;
        for (step, axis) in [(1, 1), (x, 2), (x * y, 4)] {
            let (first, second) = (grid.corners(0), grid.corners(step));
            assert!((0..8).filter(|corner| corner & axis == 0).all(|i| near(first[i | axis], second[i])), "{shape}");
        }
        if let ClusterShape::Perspective { .. } = shape {
            // The rows of clusters may extend below the image.
            assert!(near(outline[6], eye.corners()[6]), "{outline:?} {:?}", eye.corners());
        }
    }
}
