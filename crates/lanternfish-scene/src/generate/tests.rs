use glam::{Affine3A, Vec2, Vec3};

use super::{build::Shape, *};
use crate::{AlphaMode, LightKind, Primitive};

/// The enclosed volume by the divergence theorem; valid for closed surfaces with outward winding.
fn volume(shape: &Shape) -> f32 {
    let corner = |t: &[u32], i: usize| shape.positions[t[i] as usize];
    shape.indices.chunks_exact(3).map(|t| corner(t, 0).dot(corner(t, 1).cross(corner(t, 2))) / 6.0).sum()
}

fn winding_faults(shape: &Shape) -> usize {
    let (positions, normals) = (shape.positions.clone(), shape.normals.clone());
    Primitive { positions, normals, indices: shape.indices.clone(), ..Primitive::default() }.winding_faults()
}

#[test]
fn solids_are_closed_and_wound_outwards() {
    let (min, max) = (Vec3::new(-1.0, 0.5, 2.0), Vec3::new(1.0, 1.5, 5.0));
    let mut sharp = Shape::new();
    sharp.cuboid(min, max, 0.0);
    assert_eq!(sharp.indices.len(), 36);
    // Tolerances: f32 sums of a few dozen terms of order 10.
    assert!((volume(&sharp) - 6.0).abs() < 1e-4);
    let mut bevelled = Shape::new();
    bevelled.cuboid(min, max, 0.1);
    assert_eq!(bevelled.indices.len(), 3 * 44);
    // Each edge loses a prism of 0.1²/2 over its length; at the 8 corners the prisms overlap, within 0.1³ each.
    let cut = 0.005 * 4.0 * (2.0 + 1.0 + 3.0);
    assert!((volume(&bevelled) - (6.0 - cut)).abs() < 8.0 * 0.001, "{}", volume(&bevelled));
    let mut cone = Shape::new();
    cone.lathe(&[(0.0, 0.0), (1.0, 0.0), (0.0, 3.0)], 64);
    assert!((volume(&cone) - std::f32::consts::PI).abs() < 0.01, "{}", volume(&cone));
    for shape in [&sharp, &bevelled, &cone] {
        assert_eq!(winding_faults(shape), 0);
    }
    let mut mirrored = Shape::new();
    mirrored.append(&bevelled, &Affine3A::from_scale(Vec3::new(-1.0, 2.0, 1.0)));
    assert!((volume(&mirrored) - 2.0 * volume(&bevelled)).abs() < 1e-3, "mirroring must not turn it inside out");
    assert_eq!(winding_faults(&mirrored), 0);
}

#[test]
fn a_sheet_has_the_documented_front() {
    let mut sheet = Shape::new();
    sheet.sheet(3, 2, Vec2::new(3.0, 2.0), |s, t| Vec3::new(3.0 * s, 2.0 * t, 0.0));
    assert_eq!(sheet.indices.len(), 3 * 12);
    assert!(sheet.normals.iter().all(|n| n.abs_diff_eq(Vec3::Z, 1e-6)));
    assert_eq!(sheet.uv[0], Vec2::new(0.0, 2.0), "v runs downwards");
}

#[test]
fn tangents_follow_the_texture() {
    let mut workshop = surface::Workshop::default();
    let finish =
        surface::Finish { normal_texture: Some(0), texture_size: 2.0, ..surface::Finish::new("", [1.0; 3], 1.0) };
    let mut wall = Shape::new();
    wall.polygon(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    let primitive = workshop.surface(finish).primitive(wall);
    // Upright image on a wall that faces +z: u to the right, the bitangent up.
    assert!(primitive.tangents.iter().all(|t| t.abs_diff_eq(Vec3::X.extend(1.0), 1e-6)), "{:?}", primitive.tangents);
    assert_eq!(primitive.uv0[2], Vec2::new(0.5, -0.5));
}

#[test]
fn demos_are_valid() {
    for name in DEMOS {
        let scene = demo(name).unwrap();
        assert_eq!(scene.validate(), Ok(()), "{name}");
        assert_eq!(scene.name, *name);
        assert!(!scene.cameras.is_empty() && !scene.lights.is_empty(), "{name}");
        for mesh in &scene.meshes {
            for primitive in &mesh.primitives {
                assert_eq!(primitive.winding_faults(), 0, "{name}: {}", mesh.name);
                assert!(!primitive.indices.is_empty(), "{name}: {} has an empty part", mesh.name);
                let needs = scene.materials[primitive.material].normal_texture.is_some();
                assert_eq!(needs, !primitive.tangents.is_empty(), "{name}: tangents of {}", mesh.name);
            }
        }
        let placed = |mesh| scene.instances.iter().any(|i| i.mesh == mesh);
        assert!((0..scene.meshes.len()).all(placed), "{name}: a mesh is never placed");
    }
    assert!(matches!(demo("nothing"), Err(SceneError::UnknownDemo { .. })));
}

#[test]
#[ignore = "full"]
fn demos_are_deterministic() {
    for name in DEMOS {
        let [a, b] = [0, 1].map(|_| format!("{:?}", demo(name).unwrap()));
        assert!(a == b, "{name} differs from itself");
    }
}

#[test]
fn the_atrium_is_as_documented() {
    let scene = demo("atrium").unwrap();
    let (stored, placed) = scene.triangle_counts();
    assert!((50_000..=160_000).contains(&placed), "{placed} triangles");
    assert!(stored < placed / 2, "{stored} stored: instancing is lost");

    let has = |f: &dyn Fn(&crate::Material) -> bool| scene.materials.iter().any(f);
    assert!(has(&|m| matches!(m.alpha_mode, AlphaMode::Mask { .. }) && m.base_color_texture.is_some()));
    assert!(has(&|m| m.alpha_mode == AlphaMode::Blend));
    assert!(has(&|m| m.metallic == 1.0));
    assert!(has(&|m| m.name.contains("cloth") && m.double_sided));
    assert!(has(&|m| m.normal_texture.is_some()));

    let size = scene.bounds().size();
    assert!(size.x < 26.0 && size.z < 17.0 && (9.0..11.0).contains(&size.y), "{size}");
    let suns = scene.lights.iter().filter(|l| l.kind == LightKind::Directional).count();
    let lanterns = scene.lights.iter().filter(|l| l.kind == LightKind::Point && l.range.is_none()).count();
    assert_eq!(suns, 1);
    assert!((12..=20).contains(&lanterns), "{lanterns} lanterns");
    assert!(scene.cameras.len() >= 3 && scene.cameras.iter().all(|c| !c.name.is_empty()));
    let inside = scene.bounds();
    assert!(scene.cameras.iter().all(|c| c.eye().cmpgt(inside.min).all() && c.eye().cmplt(inside.max).all()));
}

#[test]
fn the_street_is_as_documented() {
    let scene = demo("street").unwrap();
    let (stored, placed) = scene.triangle_counts();
    let (instances, lights) = (scene.instances.len(), scene.lights.len());
    assert!((900_000..=1_100_000).contains(&placed), "{placed} triangles");
    assert!(stored < placed / 10, "{stored} stored: instancing is lost");
    assert!(instances > 1000, "{instances} instances");
    let spots = scene.lights.iter().filter(|l| matches!(l.kind, LightKind::Spot { .. })).count();
    let points = scene.lights.iter().filter(|l| l.kind == LightKind::Point).count();
    assert!(spots >= 40 && points >= 300 && spots + points == lights && lights < 1000, "{spots} + {points} lamps");

    let has = |f: &dyn Fn(&crate::Material) -> bool| scene.materials.iter().any(f);
    assert!(has(&|m| matches!(m.alpha_mode, AlphaMode::Mask { .. }) && m.base_color_texture.is_some()));
    assert!(has(&|m| m.name.starts_with("shop window") && m.emissive.min_element() > 1.0));
    assert!(has(&|m| m.name.contains("asphalt") && m.perceptual_roughness < 0.4));
    let bounds = scene.bounds();
    assert!(bounds.size().x < 242.0 && bounds.size().z < 40.0 && bounds.size().y < 35.0, "{}", bounds.size());
    assert!(scene.cameras.iter().all(|c| c.eye().cmpgt(bounds.min).all() && c.eye().cmplt(bounds.max).all()));
    // A lamp inside a solid would light nothing: all must be over the ground and between the façades.
    assert!(scene.lights.iter().all(|l| l.position.z.abs() < 8.1 && l.position.y > 1.0));
}

#[test]
fn the_furnace_is_white() {
    let scene = demo("furnace").unwrap();
    assert_eq!(scene.sky, Vec3::ONE);
    assert!(scene.materials.iter().all(|m| m.base_color == glam::Vec4::ONE && m.base_color_texture.is_none()));
    for metallic in [0.0, 1.0] {
        let row = scene.materials.iter().filter(|m| m.metallic == metallic);
        let roughness: Vec<f32> = row.map(|m| m.perceptual_roughness).collect();
        assert_eq!(roughness.len(), 6);
        assert!(roughness[0] == 0.0 && roughness[5] == 1.0 && roughness.is_sorted());
    }
    // The normals are those of a sphere, not of its triangles.
    let ball = &scene.meshes[0].primitives[0];
    assert!(ball.positions.iter().zip(&ball.normals).all(|(p, n)| (2.0 * *p).abs_diff_eq(*n, 1e-5)));
    let [lights, cameras] = [scene.lights.len(), scene.cameras.len()];
    assert_eq!((lights, cameras, scene.instances.len()), (1, 1, 12));
}
