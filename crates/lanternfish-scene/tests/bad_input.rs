//! Robustness of the import: every file gives a valid scene or one error. The inputs are truncated files, mutated files and
//! files that try to exhaust memory or the stack. The fuzz target in `fuzz/` has the same harness; the seeds are its corpus.

#[path = "../../../fuzz/harness.rs"]
mod harness;

use std::ops::Range;
use std::path::Path;

use harness::{Harness, ending};

/// The seeds' names and contents, in order.
fn seeds() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds");
    let mut seeds: Vec<_> = std::fs::read_dir(folder)
        .expect("the seeds")
        .map(|entry| entry.expect("a seed").path())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap()))
        .collect();
    seeds.sort();
    assert!(seeds.len() >= 14);
    seeds
}

/// Random numbers by splitmix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `count`, which must not be zero.
    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}

/// Replacements for numbers in text.
const NUMBERS: &str = "-1 0 1 2 3 4 255 65535 65536 16777217 4294967295 4294967296 1073741824 9223372036854775807 \
                       -9223372036854775808 18446744073709551615 1e-45 1e38 3.5e38 -1e39 1e400 0.5 nan inf null \"\" [] {} 5120 5121 5125 5126";
/// Replacements for four bytes: NaN, infinities, the largest float and integer, a denormal, a signalling NaN, negative zero.
const WORDS: &[u32] = &[0x7fc0_0000, 0x7f80_0000, 0xff80_0000, 0x7f7f_ffff, 0xffff_ffff, 1, 0x7f80_0001, 0x8000_0000];

/// Applies one random change to a list of bytes.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    if bytes.is_empty() {
        bytes.push(random.next() as u8);
        return;
    }
    let at = random.below(bytes.len());
    let range = |random: &mut Random| at..(at + 1 + random.below(24)).min(bytes.len());
    match random.below(10) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => drop(bytes.drain(range(random))),
        3 => {
            let copy = bytes[range(random)].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        4 => {
            let at = at / 4 * 4;
            let end = (at + 4).min(bytes.len());
            let word = random.pick(WORDS).to_le_bytes();
            bytes[at..end].copy_from_slice(&word[..end - at]);
        }
        _ => {
            if let Some(number) = number_from(bytes, at) {
                let numbers: Vec<_> = NUMBERS.split(' ').collect();
                bytes.splice(number, random.pick(&numbers).bytes());
            }
        }
    }
}

/// The range of the first number in text at or after `from`.
fn number_from(bytes: &[u8], from: usize) -> Option<Range<usize>> {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"-.".contains(byte);
    let start = from + bytes[from..].iter().position(is_part)?;
    let length = bytes[start..].iter().position(|byte| !is_part(byte)).unwrap_or(bytes.len() - start);
    Some(start..start + length)
}

/// A seed after one to four changes. In a GLB the chunks change, and in most cases the lengths are corrected: otherwise
/// nearly all mutants would fail the length checks.
fn mutant(seed: &[u8], random: &mut Random) -> Vec<u8> {
    let count = 1 + random.below(4);
    if !seed.starts_with(b"glTF") || random.below(5) == 0 {
        let mut bytes = seed.to_vec();
        (0..count).for_each(|_| mutate(&mut bytes, random));
        return bytes;
    }
    let length = |at: usize| u32::from_le_bytes(seed[at..at + 4].try_into().unwrap()) as usize;
    let mut json = seed[20..20 + length(12)].to_vec();
    let mut bin = seed[28 + json.len()..].to_vec();
    for _ in 0..count {
        let chunk = if random.below(3) == 0 { &mut bin } else { &mut json };
        mutate(chunk, random);
    }
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |value: usize| (value as u32).to_le_bytes();
    let total = 28 + json.len() + bin.len();
    let head = [*b"glTF", word(2), word(total), word(json.len()), *b"JSON"].concat();
    [head, json, [word(bin.len()), *b"BIN\0"].concat(), bin].concat()
}

/// Runs `count` mutants of every seed and returns the number of scenes.
fn run_mutants(count: usize, seed: u64) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let harness = Harness::new(folder.path());
    let mut random = Random(seed);
    let (seeds, mut scenes) = (seeds(), 0);
    for _ in 0..count {
        for (name, content) in &seeds {
            let state = random.0;
            let bytes = mutant(content, &mut random);
            let run = std::panic::AssertUnwindSafe(|| harness.check(&bytes, ending(content)));
            match std::panic::catch_unwind(run) {
                Ok(is_scene) => scenes += usize::from(is_scene),
                Err(panic) => {
                    eprintln!("{name}, state {state:#x}: {}", String::from_utf8_lossy(&bytes));
                    std::panic::resume_unwind(panic);
                }
            }
        }
    }
    scenes
}

#[test]
fn seeds_are_scenes() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in seeds() {
        assert!(name.ends_with(ending(&content)), "{name}");
        assert!(Harness::new(folder.path()).check(&content, ending(&content)), "{name} is no scene");
    }
}

#[test]
fn truncated_files_are_scenes_or_errors() {
    let folder = tempfile::tempdir().unwrap();
    let harness = Harness::new(folder.path());
    for (name, content) in seeds() {
        let is_scene: Vec<bool> =
            (0..content.len()).step_by(3).map(|length| harness.check(&content[..length], ending(&content))).collect();
        // OBJ text and images may end anywhere; JSON and GLB chunks may not. The seeds have no trailing blanks.
        let must_be_complete = name.ends_with(".gltf") || name.ends_with(".glb");
        assert!(!must_be_complete || !is_scene.contains(&true), "{name}: a part of it is a scene");
    }
}

#[test]
fn mutants_are_scenes_or_errors() {
    let count = 200;
    let (scenes, all) = (run_mutants(count, 1), count * seeds().len());
    // Both outcomes must occur: otherwise the mutations fail the parser's first check, or have no effect.
    assert!((all / 20..all * 19 / 20).contains(&scenes), "{scenes} of {all} mutants are scenes");
}

/// A longer search. `run_mutants(100_000, 2)` is over a million.
#[test]
#[ignore = "full"]
fn mutants_for_long() {
    run_mutants(5_000, 2);
}

/// The file `triangles.gltf` with each `old` replaced by `new`.
fn triangles(changes: &[(&str, &str)]) -> Vec<u8> {
    let (_, seed) = seeds().into_iter().find(|(name, _)| name == "triangles.gltf").unwrap();
    let mut text = String::from_utf8(seed).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{old}");
        text = text.replacen(old, new, 1);
    }
    text.into_bytes()
}

#[test]
fn files_that_exhaust_resources_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let harness = Harness::new(folder.path());
    for (what, changes) in [
        ("counts beyond the buffer", &[("\"count\": 4", "\"count\": 4000000000")][..]),
        ("counts that overflow", &[("\"count\": 4", "\"count\": 18446744073709551615")]),
        ("a buffer that is not there", &[("\"byteLength\": 60", "\"byteLength\": 99999999999")]),
        ("zeros without a buffer", &[("\"bufferView\": 0, ", ""), ("\"count\": 4", "\"count\": 4000000000")]),
        ("a node that is its own child", &[("\"children\": [1]", "\"children\": [0]")]),
        ("a cycle of two", &[("{\"mesh\": 0", "{\"children\": [0], \"mesh\": 0")]),
        ("a mesh out of range", &[("\"mesh\": 0", "\"mesh\": 7")]),
        ("a scale that overflows", &[("[1, 2, 1]", "[1e38, 1e38, 1e38]"), ("\"translation\"", "\"scale\"")]),
    ] {
        let changes: Vec<_> = changes.to_vec();
        let is_scene = harness.check(&triangles(&changes), "gltf");
        assert!(!is_scene || what.starts_with("a scale"), "{what}: taken for a scene");
    }
    assert!(!harness.check(b"", "glb") && !harness.check(b"", "gltf"));
    let deep = format!("{{\"asset\":{}1{}}}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(!harness.check(deep.as_bytes(), "gltf"), "nesting that exhausts a stack");
}

#[test]
fn empty_and_degenerate_scenes_are_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let harness = Harness::new(folder.path());
    assert!(harness.check(b"{\"asset\":{\"version\":\"2.0\"}}", "gltf"));
    assert!(harness.check(b"", "obj"));
    assert!(harness.check(&triangles(&[("[1, 2, 1]", "[0, 0, 0]")]), "gltf"));
    assert!(harness.check(b"v 1 1 1\nv 1e12 -1e12 1e12\nf 1 1 1\nf 1 2 1\nf 2 2 2\n", "obj"));
}

/// PNG headers of various sizes before very little data. Sizes over 16,384 pixels a side or 1 GiB are refused before anything
/// is allocated, smaller ones at the end of the data: the scene lacks the texture.
#[test]
fn images_with_less_data_than_stated_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let harness = Harness::new(folder.path());
    for size in [0u32, 2, 4_096, 16_385, 65_536, u32::MAX] {
        let mut header = b"IHDR".to_vec();
        header.extend([size.to_be_bytes(), size.to_be_bytes()].concat());
        header.extend([8, 6, 0, 0, 0]);
        let crc = !header.iter().fold(!0u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
        });
        let png = [b"\x89PNG\r\n\x1a\n\0\0\0\x0d", &header[..], &crc.to_be_bytes(), b"\0\0\0\0IDAT\x35\xaf\x06\x1e"];
        std::fs::write(folder.path().join("lie.png"), png.concat()).unwrap();
        let file = triangles(&[
            ("\"meshes\"", "\"images\":[{\"uri\":\"lie.png\"}],\"textures\":[{\"source\":0}],\"meshes\""),
            ("\"nodes\": [{", "\"materials\":[{\"emissiveTexture\":{\"index\":0}}],\"nodes\": [{"),
            ("\"indices\": 1", "\"indices\": 1, \"material\": 0"),
        ]);
        let scene = harness.load(std::str::from_utf8(&file).unwrap(), "gltf").expect("only a texture is missing");
        assert_eq!(scene.materials[0].emissive_texture, None, "an image of {size} pixels a side without data");
        let obj = b"mtllib lie.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
        std::fs::write(folder.path().join("lie.mtl"), "newmtl a\nmap_Kd lie.png\n").unwrap();
        assert!(harness.check(obj, "obj"), "a texture of an OBJ is left out");
    }
}
