//! Moves in two levels, against another upload.

use super::*;

/// Thick glass casts no shadow and moves alone; what lets light pass in part is posed by an update; a mesh's only instance gets a tree by
/// another upload, once, after which the transforms of the last frame are still known.
#[gpu_test]
fn gpu_what_has_no_tree_moves_without_another_upload(gpu: &Gpu) {
    let mut scene = copies(40);
    let first = scene.instances.len();
    let glass = Material { transmission: 0.9, thickness: 1.0, ..Material::default() };
    let pane = Material { alpha_mode: AlphaMode::Blend, base_color: Vec4::new(0.9, 0.2, 0.2, 0.5), ..glass.clone() };
    for material in [glass, Material { transmission: 0.0, ..pane }] {
        let leaf = quad(scene.materials.len(), Vec3::ZERO, 3.0 * Vec3::X, 3.0 * Vec3::Z);
        scene.materials.push(Material { double_sided: true, ..material });
        scene.meshes.push(Mesh { name: String::new(), primitives: vec![leaf] });
        for x in [-4.0, 4.0] {
            let world_from_object = Affine3A::from_translation(Vec3::new(x, 4.0, 2.0));
            let mesh = scene.meshes.len() - 1;
            scene.instances.push(Instance { name: String::new(), mesh, world_from_object });
        }
    }
    let [mut painter, two] = [(); 2].map(|()| renderer(gpu, Tracer::TWO_LEVEL));
    let mut uploaded = two.upload(&scene).unwrap();
    let mut image = |uploaded: &GpuScene| painter.render(uploaded, &camera(), [48, 32]).unwrap().radiance;
    let mut last = image(&uploaded);
    // An instance, whether it moves alone, and whether the scene is uploaded again.
    let only = first - 1;
    for (step, (instance, moves, uploads)) in
        [(first, true, false), (first + 2, false, false), (only, false, true), (only, true, false)]
            .into_iter()
            .enumerate()
    {
        let shift = Affine3A::from_translation(Vec3::new(1.5, 0.5, 1.0));
        let moved = [(instance, shift * scene.instances[instance].world_from_object)];
        scene.instances[instance].world_from_object = moved[0].1;
        uploaded.note_shown();
        let (order, generation) = (uploaded.triangle_order(), uploaded.generation());
        match two.move_instances(&mut uploaded, &moved) {
            Ok(_) => assert!(moves, "step {step}"),
            Err(RenderError::NeedsUpdate { .. }) => {
                assert!(!moves, "step {step}");
                two.update(&mut uploaded, &scene).unwrap();
            }
            Err(error) => panic!("{error}"),
        }
        assert_eq!(uploaded.triangle_order() != order, uploads, "step {step}");
        assert!(uploaded.generation() != generation && uploaded.geometry_at(generation).is_some(), "step {step}");
        let now = image(&uploaded);
        assert!(apart(&last, &now)[1] > 0.003, "step {step}: nothing has moved");
        let [mean, others] = apart(&image(&two.upload(&scene).unwrap()), &now);
        assert!(mean < 1e-4 && others < 0.002, "step {step}: {mean}, {others}");
        last = now;
    }
    // The floor has no tree of its own, and a flat copy neither.
    let flat = Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0));
    for moved in [(0, Affine3A::from_translation(Vec3::Y)), (20, flat)] {
        assert!(matches!(two.move_instances(&mut uploaded, &[moved]), Err(RenderError::NeedsUpdate { .. })));
        scene.instances[moved.0].world_from_object = moved.1;
        two.update(&mut uploaded, &scene).unwrap();
        let [mean, others] = apart(&image(&two.upload(&scene).unwrap()), &image(&uploaded));
        assert!(mean < 1e-4 && others < 0.002, "{moved:?}: {mean}, {others}");
    }
    // What bends loses its tree, once, and the light of a surface without hits needs none.
    scene.materials[0].emissive = Vec3::ONE;
    for uploads in [true, false, false] {
        scene.instances[only].world_from_object.translation.x -= 0.3;
        scene.meshes[2].primitives[0].positions[2].y += 0.5;
        let order = uploaded.triangle_order();
        two.update(&mut uploaded, &scene).unwrap();
        assert_eq!(uploaded.triangle_order() != order, uploads);
        let [mean, others] = apart(&image(&two.upload(&scene).unwrap()), &image(&uploaded));
        assert!(mean < 1e-4 && others < 0.002, "{mean}, {others}");
    }
}

/// Instances that move far apart get another tree, whose rays hit the same as those of a fresh upload.
#[gpu_test]
fn gpu_the_tree_over_instances_is_built_again(gpu: &Gpu) {
    let (mut scene, rays) = (copies(300), rays(5000));
    let two = renderer(gpu, Tracer::TWO_LEVEL);
    let mut uploaded = two.upload(&scene).unwrap();
    let mut tree = children(&read_nodes(gpu, &uploaded));
    let mut random = Random::new(31);
    for step in 0..2 {
        let place = |i: usize| {
            let shift = Affine3A::from_translation(30.0 * random.point());
            (i, shift * scene.instances[i].world_from_object)
        };
        let moved: Vec<(usize, Affine3A)> = (20..300).map(place).collect();
        moved.iter().for_each(|(i, transform)| scene.instances[*i].world_from_object = *transform);
        two.move_instances(&mut uploaded, &moved).unwrap();
        let built = children(&read_nodes(gpu, &uploaded));
        assert_ne!(built, std::mem::replace(&mut tree, built.clone()), "step {step}: refitted alone");
        let fresh = two.upload(&scene).unwrap();
        let [moved, fresh] = [&uploaded, &fresh].map(|scene| distances(gpu, scene, Tracer::TWO_LEVEL, &rays));
        let [wrong, hits] = differing(&fresh, &moved);
        assert!(wrong == 0 && hits > 750, "step {step}: {wrong} of {hits}");
    }
}

/// Of each node, what a refit does not change: where its children are.
fn children(nodes: &[u32]) -> Vec<[u32; 4]> {
    nodes.as_chunks::<20>().0.iter().map(|node| [node[4], node[5], node[6], node[7]]).collect()
}

/// Hidden ones, whose scale is zero, stand for those that a program adds and removes. Memory is what was uploaded.
#[gpu_test]
fn gpu_a_thousand_instances_appear_move_and_vanish_in_each_frame(gpu: &Gpu) {
    let mut scene = copies(2000);
    let size = [48, 32];
    let mut two = renderer(gpu, Tracer::TWO_LEVEL);
    let mut uploaded = two.upload(&scene).unwrap();
    let image = |renderer: &mut Renderer, uploaded: &GpuScene| {
        renderer.render(uploaded, &camera(), size).unwrap().display.as_flattened().to_vec()
    };
    let mut random = Random::new(23);
    let stood = scene.instances.clone();
    let mut last = image(&mut two, &uploaded);
    let mut made = Vec::new();
    for frame in 0..30 {
        let place = |i: usize| {
            // No flat ones, and no others.
            let instance = 20 + (7 * i + 11 * frame) % 1970;
            let shift = Affine3A::from_translation(2.0 * random.point());
            match random.unit() < 0.25 {
                true => (instance, Affine3A::from_mat3(glam::Mat3::ZERO)),
                false => (instance, shift * stood[instance].world_from_object),
            }
        };
        let moved: Vec<(usize, Affine3A)> = (0..1000).map(place).collect();
        moved.iter().for_each(|(instance, transform)| scene.instances[*instance].world_from_object = *transform);
        let before = lanternfish_gpu::made();
        let sent = two.move_instances(&mut uploaded, &moved).unwrap();
        if frame == 0 {
            println!("{} bytes a frame of {} instances", sent.bytes, scene.instances.len());
        }
        if frame % 10 < 9 {
            continue;
        }
        let now = image(&mut two, &uploaded);
        made.push(lanternfish_gpu::made() - before);
        assert!(now != std::mem::replace(&mut last, now.clone()), "frame {frame}: nothing has moved");
        let fresh = two.upload(&scene).unwrap();
        assert!(now == image(&mut two, &fresh), "frame {frame}");
    }
    // What each of these frames, which follow another upload, makes again does not grow.
    let is_small = |made: &Made| made.buffers <= 8 && made.textures == 0 && made.pipelines == 0;
    assert!(made.iter().all(is_small), "{made:?}");
}
