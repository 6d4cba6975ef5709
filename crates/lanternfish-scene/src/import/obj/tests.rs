//! Tests of the OBJ import, with small files in a temporary folder.

use glam::{Vec2, Vec3, Vec4};

use crate::{AlphaMode, Primitive, Scene, SceneError, Wrap, load};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n";

/// Loads the scene `files[0]`, with the other files beside it.
fn read(files: &[(&str, &[u8])]) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    let scene = load(folder.path().join(files[0].0).to_str().unwrap())?;
    assert_eq!(scene.validate(), Ok(()));
    Ok(scene)
}

fn obj(text: &str) -> Scene {
    read(&[("test.obj", text.as_bytes())]).unwrap()
}

fn fault(text: &str) -> String {
    match read(&[("test.obj", text.as_bytes())]) {
        Err(SceneError::Invalid { what, .. }) => what,
        other => panic!("not refused as invalid: {other:?}"),
    }
}

/// The scene of a square with material `a` of `mtl`, with `images` beside it.
fn with_material(mtl: &str, images: &[(&str, &[u8])]) -> Scene {
    let text = format!("mtllib a library.mtl\n{SQUARE}usemtl a\nf 1/1/1 2/2/1 3/3/1 4/4/1\n");
    let mut files = vec![("test.obj", text.as_bytes()), ("a library.mtl", mtl.as_bytes())];
    files.extend(images);
    read(&files).unwrap()
}

fn png(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(color(x, y)));
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn only(scene: &Scene) -> &Primitive {
    assert_eq!((scene.meshes.len(), scene.meshes[0].primitives.len(), scene.instances.len()), (1, 1, 1));
    &scene.meshes[0].primitives[0]
}

#[test]
fn polygons_become_triangles_and_v_is_flipped() {
    let scene = obj(&format!("{SQUARE}f 1/1/1 2/2/1 3/3/1 4/4/1\n"));
    let square = only(&scene);
    assert_eq!(square.indices, [0, 1, 2, 0, 2, 3]);
    assert_eq!(square.uv0, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from));
    assert_eq!((square.normals[3], square.winding_faults(), square.tangents.len()), (Vec3::Z, 0, 0));
    assert_eq!(scene.name, "test");
    // Negative indices count back.
    let absolute = obj(&format!("{SQUARE}f 1/1/1 2/2/1 3/3/1\n"));
    let relative = obj(&format!("{SQUARE}f -4/-4/-1 -3/-3/-1 \\\n -2/-2/-1\nv 9 9 9\n"));
    assert_eq!(format!("{:?}", only(&absolute)), format!("{:?}", only(&relative)));
}

#[test]
fn missing_normals_are_flat_and_zero_ones_repaired() {
    let scene = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\n");
    let corner = only(&scene);
    assert_eq!((corner.positions.len(), corner.uv0.len(), corner.winding_faults()), (6, 0, 0));
    assert_eq!((corner.normals[0], corner.normals[3]), (Vec3::Z, Vec3::Y));
    let scene = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nf 1//1 2//1 3//1\n");
    assert_eq!(only(&scene).normals, [Vec3::Z; 3]);
}

#[test]
fn colors_of_vertices_are_read() {
    let [red, half] = [[1.0, 0.0, 0.0, 1.0], [0.21586; 4]].map(Vec4::from);
    let half = half.with_w(1.0);
    // A point without a colour is white; normals are flat, so each corner is a vertex; bytes are divided by 255.
    for (points, expected) in [
        ("v 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0 0.502 0.502 0.502\nvn 0 0 1\nf 1//1 2//1 3//1\n", [red, Vec4::ONE, half]),
        ("v 0 0 0 1 0 0\nv 1 0 0 1\nv 2 2 0 2\nf 3 2 1\n", [Vec4::ONE, Vec4::ONE, red]),
        ("v 0 0 0 255 0 0\nv 1 0 0 255 255 255\nv 1 1 0 128 128 128\nf 1 2 3\n", [red, Vec4::ONE, half]),
    ] {
        let scene = obj(points);
        assert!(only(&scene).colors.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(b, 1e-4)), "{:?}", only(&scene));
        assert_eq!((only(&scene).colors.len(), scene.materials[0].base_color), (3, Vec4::ONE));
    }
    assert_eq!(fault("v 0 0 0 1 0 x\n"), "line 1: v: \"x\" is no number");
    assert!(only(&obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")).colors.is_empty());
    // A texture has them already.
    let text = "mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
    let red = png(1, 1, |_, _| [255, 0, 0, 255]);
    let files = [("a.obj", text.as_bytes()), ("a.mtl", b"newmtl a\nmap_Kd a.png\n"), ("a.png", &red)];
    assert!(only(&read(&files).unwrap()).colors.is_empty());
}

#[test]
fn objects_groups_and_materials_are_split() {
    let mtl = b"newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n";
    let text = format!(
        "mtllib m.mtl\n{SQUARE}o first one\nusemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\ng second\nusemtl a\nf 1 2 4\n\
         usemtl none\nf 2 3 4\nl 1 2\n"
    );
    let scene = read(&[("test.obj", text.as_bytes()), ("m.mtl", mtl)]).unwrap();
    let names: Vec<_> = scene.meshes.iter().map(|m| (m.name.as_str(), m.primitives.len())).collect();
    assert_eq!(names, [("first one", 2), ("second", 2)]);
    let colors: Vec<_> = scene.materials.iter().map(|m| m.base_color).collect();
    assert_eq!(colors, [Vec4::new(1., 0., 0., 1.), Vec4::new(0., 1., 0., 1.), Vec4::new(0.8, 0.8, 0.8, 1.0)]);
    assert_eq!(scene.meshes[1].primitives.iter().map(|p| p.material).collect::<Vec<_>>(), [0, 2]);
}

/// Attributes stay with their corners if only some faces have them.
#[test]
fn faces_with_different_attributes_are_separate_primitives() {
    let scene = obj(&format!("{SQUARE}o s\nf 1 2 3\nf 1/4/1 3/3/1 4/2/1\nf 1/1 2/2 3\n"));
    let parts = &scene.meshes[0].primitives;
    assert_eq!(parts.iter().map(|p| p.uv0.len()).collect::<Vec<_>>(), [0, 3, 0]);
    assert_eq!(parts[1].uv0[0], Vec2::ZERO);
}

#[test]
fn material_values_are_mapped() {
    let material = |mtl: &str| with_material(&format!("newmtl a\n{mtl}\n"), &[]).materials.remove(0);
    let glossy = material("Kd 0.5 0.25 2\nKs 1 1 1\nNs 30\nKe 3 2 1\nillum 2");
    assert_eq!(glossy.base_color, Vec4::new(0.5, 0.25, 1.0, 1.0));
    // alpha² = 2 / 32, alpha = 1/4, roughness 1/2.
    assert_eq!((glossy.perceptual_roughness, glossy.metallic, glossy.emissive), (0.5, 0.0, Vec3::new(3., 2., 1.)));
    assert_eq!(material("Ks 1 1 1\nNs 30\nillum 1").perceptual_roughness, 1.0);
    assert_eq!(material("Ks 0 0 0\nNs 30\nillum 2").perceptual_roughness, 1.0);
    let pbr = material("Pr 0.3\nPm 0.9\nNs 500");
    assert_eq!((pbr.perceptual_roughness, pbr.metallic, pbr.alpha_mode), (0.3, 0.9, AlphaMode::Opaque));
    for mtl in ["d 0.25", "Tr 0.75", "d 0.25\nTr 0.1"] {
        let glass = material(mtl);
        assert_eq!((glass.base_color.w, glass.alpha_mode), (0.25, AlphaMode::Blend), "{mtl}");
    }
    // Lines on which `tobj` panics or fails.
    let broken = material("Kd 0.5\nKs 1 2\nKe spectral x.rfl\nNs\nd -halo 0.5\nillum 900\nmap_Kd\nPr nan\nTr x");
    assert_eq!((broken.base_color, broken.perceptual_roughness), (Vec4::new(0.5, 0.5, 0.5, 1.0), 1.0));
}

#[test]
fn maps_are_read() {
    let color = png(2, 2, |x, _| [200, x as u8, 0, 255]);
    let opacity = png(4, 1, |x, _| if x < 2 { [0, 0, 0, 255] } else { [255, 255, 255, 255] });
    let normals = png(2, 2, |_, _| [128, 128, 255, 255]);
    let heights = png(2, 2, |x, _| [128 * x as u8; 4]);
    let files = [("c o.png", &color[..]), ("d.png", &opacity), ("n.png", &normals), ("h.png", &heights)];

    let mtl = "newmtl a\nmap_Kd -clamp on -s 1 1 1 .\\c o.png\nmap_Ke c o.png\nmap_Bump -bm 0.5 n.png\n";
    let scene = with_material(mtl, &files);
    let material = &scene.materials[0];
    assert_eq!((material.base_color, material.emissive), (Vec4::ONE, Vec3::ONE));
    let texture = scene.textures[material.base_color_texture.unwrap().texture];
    assert_eq!(scene.images[texture.image].rgba[..4], [200, 0, 0, 255]);
    assert_eq!(scene.samplers[texture.sampler].wrap_u, Wrap::ClampToEdge);
    assert!(material.normal_texture.is_some() && material.normal_scale == 0.5);
    // u is along +x; the image's upward direction is +y.
    assert!(only(&scene).tangents.iter().all(|t| t.abs_diff_eq(Vec3::X.extend(1.0), 1e-6)));

    let masked = with_material("newmtl a\nmap_Kd c o.png\nmap_d d.png\nbump h.png\n", &files);
    assert_eq!(masked.materials[0].alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert!(masked.materials[0].normal_texture.is_none(), "a height map is no normal map");
    assert_eq!(masked.images.len(), 1, "unused images are dropped");
    assert_eq!(masked.images[0].rgba[..8], [200, 0, 0, 0, 200, 1, 0, 255]);
}

#[test]
fn missing_files_are_left_out() {
    let scene = with_material("newmtl a\nmap_Kd none.png\nmap_d broken.png\n", &[("broken.png", b"no image")]);
    assert!(scene.textures.is_empty() && scene.materials[0].alpha_mode == AlphaMode::Opaque);
    let scene = obj(&format!("mtllib none.mtl\n{SQUARE}usemtl a\nf 1 2 3\n"));
    assert_eq!((scene.materials[0].metallic, scene.materials[0].base_color.x), (0.0, 0.8));
    // The library of the file's own name is read instead of a missing one.
    for (library, green) in [("mtllib none.mtl\n", 1.0), ("", 1.0), ("mtllib there.mtl\n", 0.5)] {
        let text = format!("{library}{SQUARE}usemtl a\nf 1 2 3\n");
        let libraries = [("test.mtl", &b"newmtl a\nKd 0 1 0\n"[..]), ("there.mtl", b"newmtl a\nKd 0 0.5 0\n")];
        let scene = read(&[&[("test.obj", text.as_bytes())][..], &libraries].concat()).unwrap();
        assert_eq!(scene.materials[0].base_color, Vec4::new(0.0, green, 0.0, 1.0), "{library}");
    }
    assert!(obj("").meshes.is_empty() && obj("# nothing\nv 0 0 0\n").instances.is_empty());
}

/// An image of the file's own name is the base colour, unless a material has a texture or no face has texture coordinates.
#[test]
fn an_image_of_the_files_name_is_the_base_colour() {
    let red = png(1, 1, |_, _| [255, 0, 0, 255]);
    let blue = png(1, 1, |_, _| [0, 0, 255, 255]);
    let mapped = "f 1/1/1 2/2/1 3/3/1\n";
    let of = |head: &str, faces: &str, image: &str, mtl: &str| {
        let text = format!("{head}{SQUARE}{faces}");
        let files = [("test.obj", text.as_bytes()), (image, &red), ("b.png", &blue), ("m.mtl", mtl.as_bytes())];
        let scene = read(&files).unwrap();
        let material = &scene.materials[0];
        let texel = material.base_color_texture.map(|map| scene.images[scene.textures[map.texture].image].rgba[0]);
        (texel, material.base_color.x)
    };
    for image in ["test.png", "test.jpg", "test_diffuse.png", "test_D.jpeg"] {
        assert_eq!(of("", mapped, image, ""), (Some(255), 1.0), "{image}");
    }
    let with_library = format!("usemtl a\n{mapped}");
    assert_eq!(of("mtllib none.mtl\n", &with_library, "test.png", ""), (Some(255), 1.0));
    assert_eq!(of("mtllib m.mtl\n", &with_library, "test.png", "newmtl a\nKd 0.5 1 1\n"), (Some(255), 0.5));
    assert_eq!(of("mtllib m.mtl\n", &with_library, "test.png", "newmtl a\nmap_Kd b.png\n"), (Some(0), 1.0));
    assert_eq!(of("", "f 1//1 2//1 3//1\n", "test.png", ""), (None, 0.8));
    assert_eq!(of("", mapped, "other.png", ""), (None, 0.8));
}

#[test]
fn broken_files_are_refused_with_the_line() {
    for (text, part) in [
        ("v 0 0\n", "line 1: v: 2 numbers"),
        ("v 0 0 x\n", "\"x\" is no number"),
        ("\nv 0 0 nan\n", "line 2"),
        ("v 0 0 1e39\n", "is no number"),
        ("v 0 0 1 0\n", "infinity"),
        ("v 0 0 0\nf 1 2 1\n", "line 2: f: 2 is referred to, but there are 1 vertices"),
        ("v 0 0 0\nf 1 -2 1\n", "-2 is referred to"),
        ("v 0 0 0\nf 1/9223372036854775807 1 1\n", "0 texture coordinates"),
        ("v 0 0 0\nf 1 0 1\n", "0 is referred to"),
        ("v 0 0 0\nf 1///1 1 1\n", "is no corner"),
        ("v 0 0 0\nf a b c\n", "is no corner"),
    ] {
        let what = fault(text);
        assert!(what.contains(part), "{text:?}: {what}");
    }
}

#[test]
fn unreadable_material_values_are_noted() {
    let cleaned = |mtl: &str| {
        let mut notes = super::Notes::new();
        let text = super::materials::clean(&format!("newmtl a\n{mtl}\n"), "a.mtl", &mut notes);
        (text, notes.into_iter().collect::<Vec<_>>())
    };
    let (text, notes) = cleaned("Kd red green blue\nNs shiny\nillum\n# Kd x\nKs 0.1 0.2 0.3\nPr nan\nKe inf 0 0");
    assert_eq!(text, "newmtl a\nKs 0.1 0.2 0.3\n");
    let noted = "a.mtl: 5 lines have no readable value and are left out; line 2: Kd red green blue";
    assert_eq!(notes, [noted]);
    // Non-finite greys of one number.
    for value in ["nan", "inf", "-inf"] {
        let (text, notes) = cleaned(&format!("Kd {value}\nKe {value}"));
        assert_eq!((text.as_str(), notes.len()), ("newmtl a\n", 1), "{value}");
    }
    let (_, notes) = cleaned("Kd 0.5 0.5 0.5\nNs 30\nTr 0.5 0.5 0.5\nillum 2\nmap_Kd a.png");
    assert!(notes.is_empty(), "{notes:?}");
}

#[test]
fn unknown_materials_beyond_the_limit_are_counted() {
    let names: Vec<String> = (0..11).map(|i| format!("m{i:02}")).collect();
    for (count, last) in [(8, "usemtl m07: there is no such material; its faces become white"), (11, "and 3 more")] {
        let mut notes = super::Notes::new();
        super::note_unknown(&names.iter().take(count).collect::<Vec<_>>(), "become white", &mut notes);
        assert_eq!(notes.len(), 8 + usize::from(count > 8));
        assert!(notes.iter().any(|note| note.contains(last)), "{notes:?}");
    }
}

#[test]
fn used_materials_are_collected() {
    let plain = super::clean::clean(
        &format!("{SQUARE}usemtl unused\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3 4\n"),
        &mut super::Notes::new(),
    );
    let plain = plain.unwrap();
    assert_eq!((plain.materials.into_iter().collect::<Vec<_>>(), plain.triangles), (vec!["a".into(), "b".into()], 3));
}

/// Changes of attributes, numbers and indices stay short, whatever the length of the name.
#[test]
fn plain_text_growth_is_bounded() {
    let plain = |text: &str| {
        let plain = super::clean::clean(text, &mut super::Notes::new()).unwrap();
        let most = super::clean::MOST_GROWTH as usize * text.len();
        assert!(plain.text.len() <= most, "{} bytes of {}", plain.text.len(), text.len());
        plain
    };
    let name = "wall ".repeat(1000) + "end";
    let text = format!("{SQUARE}g {name}\n{}", "f 1 2 3\nf 1/1 2/2 3/3\n".repeat(1000));
    assert_eq!(plain(&text).names, [name.as_str()]);
    let scene = obj(&text);
    assert_eq!((scene.meshes.len(), &scene.meshes[0].name, scene.meshes[0].primitives.len()), (1, &name, 2000));
    plain(&"v 1e-45 1e38 1e-45\n".repeat(1000));
    plain(&"v 1 1 1 3\n".repeat(1000));
    plain(&format!("{}{}", "v 0 0 0\n".repeat(9999), "f -1 -1 -1\n".repeat(10_000)));
    let scene = obj("v 3e0 0 0\nv 3 3 0 3\nv 0 1 0\nvt 1e-3\nf 1/1 2/1 3/1\n");
    assert_eq!(only(&scene).positions, [Vec3::X * 3.0, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(only(&scene).uv0[0], Vec2::new(1e-3, 1.0));
    assert_eq!(scene.meshes[0].name, "unnamed");
}
