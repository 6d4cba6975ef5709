//! Checks of the importers for arbitrary input; shared by the fuzz target and the bounded test.

use std::path::{Path, PathBuf};

use lanternfish_scene::{Environment, LoadOptions, Scene, SceneError, load_with};

/// Memory limit of an import, bytes.
const MEMORY: u64 = 256_000_000;

/// Passes inputs to the importers through files in a folder that is otherwise empty.
pub struct Harness {
    folder: PathBuf,
}

impl Harness {
    /// A harness that writes its inputs to `folder`.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// Loads `bytes` as a file with the extension `ending`: a scene, a file that a scene refers to, or an environment. Returns true
    /// if it loads; of an image, if the scene has its texture. Panics if the scene is invalid, or if the error is not a fault of the file.
    pub fn check(&self, bytes: &[u8], ending: &str) -> bool {
        let path = self.folder.join("input").with_extension(ending);
        std::fs::write(&path, bytes).expect("the folder can be written to");
        let result = match ending {
            "hdr" | "exr" => return self.check_environment(&path),
            "mtl" => {
                let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib input.mtl\nusemtl a\nf 1 2 3\n";
                self.load(text, "obj").map(|_| true)
            }
            "png" | "jpg" | "webp" | "ktx2" => {
                let json = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"images":[{"uri":"input.ENDING"}],
                    "textures":[{"source":0}],"materials":[{"normalTexture":{"index":0}}],
                    "accessors":[{"componentType":5126,"count":3,"type":"VEC3"}],
                    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}]}"#;
                let scene = self.load(&json.replace("ENDING", ending), "gltf");
                scene.map(|scene| scene.materials[0].normal_texture.is_some())
            }
            _ => self.load_file(&path).map(|_| true),
        };
        match result {
            Ok(is_read) => is_read,
            Err(error) => {
                // An unknown format or demo would be a fault of the harness.
                let of_harness = matches!(error, SceneError::UnknownFormat { .. } | SceneError::UnknownDemo { .. });
                assert!(!of_harness && !error.to_string().is_empty(), "{error}");
                tell(&error);
                false
            }
        }
    }

    /// Loads a scene with this text, which refers to the input file.
    pub fn load(&self, text: &str, ending: &str) -> Result<Scene, SceneError> {
        let path = self.folder.join("scene").with_extension(ending);
        std::fs::write(&path, text).expect("the folder can be written to");
        self.load_file(&path)
    }

    fn load_file(&self, path: &Path) -> Result<Scene, SceneError> {
        let options = LoadOptions { confine: true, memory_limit: Some(MEMORY), ..LoadOptions::default() };
        let scene = load_with(path, &options)?;
        scene.validate().unwrap_or_else(|what| panic!("loaded, but is no valid scene: {what}"));
        Ok(scene)
    }

    fn check_environment(&self, path: &Path) -> bool {
        let environment = match Environment::load(path) {
            Ok(environment) => environment,
            Err(error) => {
                tell(&error);
                return false;
            }
        };
        let Environment { width, height, pixels, .. } = &environment;
        assert_eq!(width * height, pixels.len());
        assert!(!pixels.is_empty() && pixels.iter().all(|pixel| pixel.is_finite() && pixel.min_element() >= 0.0));
        true
    }
}

/// Prints the error if a decoder panicked. It is an error like any other, but worth reporting upstream.
fn tell(error: &SceneError) {
    if error.to_string().contains("its decoder failed") {
        println!("{error}");
    }
}

/// File extension for content of unknown format, from its first bytes.
pub fn ending(bytes: &[u8]) -> &'static str {
    let begins = |magic: &[u8]| bytes.starts_with(magic);
    match bytes.iter().find(|byte| !byte.is_ascii_whitespace()) {
        _ if begins(b"glTF") => "glb",
        _ if begins(b"\x89PNG") => "png",
        _ if begins(b"\xff\xd8") => "jpg",
        _ if begins(b"RIFF") => "webp",
        _ if begins(b"\xabKTX 20") => "ktx2",
        _ if begins(b"#?") => "hdr",
        _ if begins(b"\x76\x2f\x31\x01") => "exr",
        _ if begins(b"newmtl") => "mtl",
        Some(b'{') => "gltf",
        _ => "obj",
    }
}
