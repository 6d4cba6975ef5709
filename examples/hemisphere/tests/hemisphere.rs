//! A technique from outside is chosen, rendered, listed and read like the library's own.

#[macro_use]
extern crate lanternfish_gpu_test;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use glam::{Affine3A, Vec3, Vec4};
use lanternfish::{Indirect, Renderer, Root, Settings, settings::Materials, technique::Technique as _, techniques};
use lanternfish_gpu::{check_layout, testing};
use lanternfish_hemisphere::{Hemisphere, HemisphereParameters};
use lanternfish_scene::{Camera, Instance, Material, Mesh, Primitive, Projection, Scene};

/// A white wall that fills the view is as bright as the mix of sky and ground by its normal.
#[gpu_test]
fn gpu_a_wall_is_as_bright_as_its_normal_says(gpu: &Gpu) {
    let hemisphere = Hemisphere { sky: 2.0, ground: 0.5 };
    let settings = Settings::direct_light().with_indirect(hemisphere).with_materials(Materials::Lambert);
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    for (normal, expected) in [(Vec3::Z, 1.25), (Vec3::new(0.6, 0.8, 0.0), 1.85), (Vec3::new(0.6, -0.8, 0.0), 0.65)] {
        let right = normal.any_orthonormal_vector();
        let scene = wall(9.0 * right, 9.0 * normal.cross(right));
        let camera = Camera::look_at(normal, Vec3::ZERO, Projection::Perspective { fov_y: 0.8, near: 0.02 });
        let uploaded = renderer.upload(&scene).unwrap();
        let image = renderer.render(&uploaded, &camera, [24, 16]).unwrap();
        for pixel in &image.radiance {
            // Half floats, of a normal in 16 bits.
            let off = (Vec4::from(*pixel).truncate() - expected).abs().max_element();
            assert!(off < 2e-3 * expected, "{normal}: {pixel:?}, expected {expected}");
        }
    }
}

#[test]
fn it_is_known_by_name_once_it_is_registered() {
    let names = || Indirect::all().iter().map(Indirect::name).collect::<Vec<_>>();
    assert!(!names().contains(&"hemisphere") && Indirect::named("hemisphere").is_none());
    lanternfish_hemisphere::register();
    assert!(names().contains(&"hemisphere"));
    let mut chosen = Indirect::named("hemisphere").unwrap();
    chosen.technique_mut().unwrap().set("hemisphere-ground", "0.7").unwrap();
    assert_eq!(chosen.get::<Hemisphere>(), Some(&Hemisphere { ground: 0.7, ..Hemisphere::default() }));
    assert!(chosen.technique_mut().unwrap().set("hemisphere-sky", "bright").is_err());
    assert_ne!(chosen, Indirect::named("hemisphere").unwrap());
    let roots = techniques::shaders().into_iter().flat_map(|folder| folder.roots).map(|root: &Root| root.module);
    assert_eq!(roots.filter(|module| *module == "hemisphere/find").count(), 1);
    let shader = Hemisphere::SHADERS.link("hemisphere/find", &[]).unwrap();
    assert_eq!(check_layout::<HemisphereParameters>(&shader), Ok(()));
    assert!(std::panic::catch_unwind(lanternfish_hemisphere::register).is_err(), "two of one name");
}

/// A white rectangle about the origin.
fn wall(half_right: Vec3, half_up: Vec3) -> Scene {
    let corner = |s: f32, t: f32| s * half_right + t * half_up;
    let primitive = Primitive {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![half_right.cross(half_up).normalize(); 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    };
    let instance = Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY };
    Scene {
        meshes: vec![Mesh { name: String::new(), primitives: vec![primitive] }],
        instances: vec![instance],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

/// The program of the package, in a folder.
fn program(folder: &Path, words: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanternfish-hemisphere"));
    command.current_dir(folder).env_remove("RUST_LOG").stdin(Stdio::null()).args(words.split(' '));
    command
}

fn output(mut command: Command) -> String {
    let output = command.output().unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{command:?}: {out}{err}");
    out
}

#[test]
fn help_and_shots_have_it() {
    let folder = tempfile::tempdir().unwrap();
    let help = output(program(folder.path(), "help render --all"));
    for words in ["hemisphere:", Hemisphere::SUMMARY, "--hemisphere-sky <NITS>", "--hemisphere-ground <NITS>"] {
        assert!(help.contains(words), "{words}: {help}");
    }
    let shot = output(program(folder.path(), "shot demo:cornell --indirect hemisphere --hemisphere-sky 2"));
    assert!(shot.contains("indirect = \"hemisphere\"") && shot.contains("hemisphere-sky = 2"), "{shot}");
}

#[gpu_test]
fn gpu_images_are_rendered_with_its_settings(gpu: &Gpu) {
    let folder = tempfile::tempdir().unwrap();
    let image = |name: &str| {
        let technique = "--indirect hemisphere --hemisphere-sky";
        let file = format!("{name}.png");
        output(program(
            folder.path(),
            &format!("render demo:cornell --size 32x24 --exposure 0 --quality draft -o {file} {technique} {name}"),
        ));
        fs::read(folder.path().join(file)).unwrap()
    };
    assert_ne!(image("1"), image("4"));
}

#[gpu_test(full)]
fn gpu_the_doctor_lists_it(gpu: &Gpu) {
    let doctor = output(program(Path::new("."), "doctor --filter hemisphere"));
    assert!(doctor.contains("indirect hemisphere"), "{doctor}");
}
