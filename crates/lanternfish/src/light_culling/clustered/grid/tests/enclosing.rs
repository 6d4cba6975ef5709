//! The enclosing frustum contains all views and is no larger than needed.

use glam::{Affine3A, DAffine3, DVec3, Quat, UVec2, Vec3};
use proptest::prelude::*;

use super::{
    super::{ViewFrustum, corners_of, enclosing},
    EXACT, Rig, VIVE, check, narrowed, outside, pose, slopes, straight_rig, view, vive, volume,
};

#[test]
fn enclosing_contains_any_views_that_face_roughly_one_way() {
    let views = prop::collection::vec((pose(), slopes(), 0.01f32..5.0, 0.05f32..7.0, any::<bool>()), 1..7);
    check((pose(), views, 0.0f32..0.15), |(head, views, spread)| {
        let views = views.into_iter().map(|(pose, slopes, near, log_ratio, parallel)| {
            let (_, rotation, position) = pose.to_scale_rotation_translation();
            let rotation = Quat::IDENTITY.slerp(rotation, 0.5 * spread);
            let world_from_view = head * Affine3A::from_rotation_translation(rotation, position * spread);
            // A parallel box 1e5 times as long as wide reaches the limit of double precision.
            let far = near * 10f32.powf(if parallel { log_ratio.min(4.0) } else { log_ratio });
            ViewFrustum { world_from_view, parallel, ..view(slopes, near, far) }
        });
        let views: Vec<_> = views.collect();
        let frustum = enclosing(&views).unwrap();
        let excess = outside(&frustum, &corners_of(&views));
        prop_assert!(excess <= EXACT, "{excess:e}: {frustum:?}");
        prop_assert!(frustum.parallel == views.iter().all(|view| view.parallel));
        prop_assert!(frustum.parallel || frustum.near > 0.0);
        Ok(())
    });
}

#[test]
fn enclosing_is_tight() {
    let holds = |rig: Rig| {
        let corners = corners_of(&rig.eyes());
        let frustum = enclosing(&rig.eyes()).unwrap();
        for side in 0..6 {
            let excess = outside(&narrowed(&frustum, side), &corners);
            // The near plane's 1 % are relative to the depth of the frustum, of which near is 1e-4 or more.
            prop_assert!(excess > if side == 4 { 5e-7 } else { 5e-3 }, "side {side}: {excess:e}");
        }
        let eye = frustum.world_from_view.as_daffine3().translation;
        let back = eye.distance(rig.head.as_daffine3().translation);
        // Figure 4.3: for eyes that see further to their own side, the frustum's sides are those outer planes.
        let [outer, inner] = [-rig.slopes[0], rig.slopes[1]];
        if outer < inner {
            return Ok(());
        }
        let expected = f64::from(0.5 * rig.ipd / outer);
        // Positions up to 87 m from the origin are rounded by 4e-6 m on each axis, three times.
        prop_assert!((back - expected).abs() < 2e-5, "{back} m back, not {expected}");
        // The eye may not be 1 % less far back: with the far plane's slopes (or its own) it would lose near corners.
        let forward = DAffine3::from_translation(DVec3::new(0.0, 0.0, -0.01 * back));
        let moved = frustum.world_from_view.as_daffine3() * forward;
        let far: Vec<_> = rig.eyes().iter().flat_map(|eye| eye.exact_corners()[4..].to_vec()).collect();
        let refitted = ViewFrustum::around(moved, &corners, false, UVec2::ONE);
        let slopes = ViewFrustum::around(moved, &far, false, UVec2::ONE).slopes;
        for slopes in [slopes, frustum.slopes] {
            let excess = outside(&ViewFrustum { slopes, ..refitted }, &corners);
            prop_assert!(excess > 1e-6, "{excess:e}");
        }
        Ok(())
    };
    holds(vive()).unwrap();
    check(straight_rig(), holds);
}

#[test]
fn one_view_encloses_itself_and_cpu_references_enclose_no_more() {
    let one = vive().eyes()[0];
    assert_eq!(enclosing(&[one]), Some(one));
    let cpu_references = enclosing(&[one, one, one]).unwrap();
    assert!(volume(&cpu_references) < volume(&one) * (1.0 + 1e-5), "{cpu_references:?}");
}

#[test]
fn displaced_grids_end_at_the_same_far_plane() {
    check((pose(), slopes(), 0.1f32..500.0), |(pose, slopes, distance)| {
        let view = ViewFrustum { world_from_view: pose, ..view(slopes, 0.1, 100.0) };
        let displaced = view.displaced(distance);
        prop_assert!(outside(&displaced, &view.exact_corners()) <= EXACT);
        // The rounding of positions scales with the eye's distance from the origin; off the axis by 0.85 of the distance at most.
        let rounding = 2.0 * f32::EPSILON * (90.0 + 1.7 * distance);
        prop_assert!((displaced.near - distance - 0.1).abs() <= rounding + displaced.near * f32::EPSILON);
        let (before, after) = (view.exact_corners(), displaced.exact_corners());
        for corner in 4..8 {
            let off = before[corner].distance(after[corner]);
            prop_assert!(off < f64::from(8.0 * rounding), "{off} m off at {distance} m");
        }
        Ok(())
    });
    let view = view(VIVE, 0.1, 100.0);
    assert_eq!(view.displaced(0.0), view);
    assert_eq!(view.displaced(f32::NAN), view);
    assert_eq!(view.displaced(1e30), view.displaced(1600.0));
}

#[test]
fn displacement_is_along_the_central_ray() {
    // The view lies completely to one side of the axis: from an eye back along the axis, near corners would lie outside the far rectangle.
    let view = view([0.5, 1.5, -2.0, -1.0], 0.1, 100.0);
    let displaced = view.displaced(50.0);
    let expected = [1.0 - 1.0 / 3.0, 1.0 + 1.0 / 3.0, -1.5 - 1.0 / 3.0, -1.5 + 1.0 / 3.0];
    for (slope, expected) in displaced.slopes.into_iter().zip(expected) {
        assert!((slope - expected).abs() < 1e-6, "{:?}", displaced.slopes);
    }
}

#[test]
fn lines_along_the_axis_move_the_eye_back_no_further_than_the_views_reach() {
    for slope in [1e-6, 1e-4] {
        let telescopes = Rig { slopes: [-slope, slope, -slope, slope], ..vive() }.eyes();
        let frustum = enclosing(&telescopes).unwrap();
        assert!((frustum.near - 100.1).abs() < 1e-3, "{frustum:?}");
        assert!(outside(&frustum, &corners_of(&telescopes)) <= EXACT);
    }
    let views =
        [view(VIVE, 0.1, 100.0), ViewFrustum { parallel: true, ..view([-200.0, 200.0, -1.0, 1.0], 0.1, 100.0) }];
    let frustum = enclosing(&views).unwrap();
    assert!(!frustum.parallel && (frustum.near - 100.1).abs() < 1e-3, "{frustum:?}");
    assert!(outside(&frustum, &corners_of(&views)) <= EXACT);
}

#[test]
fn the_eye_stays_behind_corners_that_f32_cannot_tell_from_it() {
    let head = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.7), Vec3::new(1e5, -3e4, 2e4));
    for step in 0..60 {
        let (cant, ipd) = ([-0.25, 0.0, 0.25][step % 3], 0.0005 * step as f32);
        let eyes = Rig { head, cant, ipd, near: 1e-4, ..vive() }.eyes();
        let frustum = enclosing(&eyes).unwrap();
        assert!(frustum.near > 0.0, "{frustum:?}");
        assert!(outside(&frustum, &corners_of(&eyes)) <= EXACT);
    }
}
