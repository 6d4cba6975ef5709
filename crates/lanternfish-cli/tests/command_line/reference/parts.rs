//! A ground truth in parts: the same bytes as in a single run.

use std::fs;

use lanternfish_metrics::{exr_layers, read_exr};

use super::{contents, cornell, output, samples, text};

#[test]
fn merged_parts_equal_a_single_run_to_the_byte() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let merge = |words: &str| {
        let output = output(folder.path(), &format!("merge {words}"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        (text(&output.stdout).to_owned(), text(&output.stderr).to_owned())
    };
    cornell(folder.path(), "--spp 24 --seed 3 -o whole.exr");
    // Any division, traced in any order.
    for range in ["8-17", "1-7", "18-24"] {
        cornell(folder.path(), &format!("--samples {range} --seed 3 -o {range}.exr --threads 1"));
    }
    assert_eq!(samples(&folder.path().join("8-17.exr")), 10);
    let (stdout, stderr) = merge("18-24.exr 1-7.exr 8-17.exr -o merged.exr");
    assert_eq!(stdout, "merged.exr\n");
    assert!(stderr.contains("merged.exr: samples 1-24 of a pixel, of 3 parts, expected error "), "{stderr}");
    assert!(read("merged.exr") == read("whole.exr"));
    // Merging in steps: a result without the first sample is a part.
    assert!(merge("8-17.exr 18-24.exr -o late.exr").1.contains("samples 1-7 are missing before it"));
    merge("late.exr 1-7.exr -o again.exr");
    assert!(read("again.exr") == read("whole.exr"));
    // A single part with all samples gives the same file, without the sums.
    cornell(folder.path(), "--samples 1-24 --seed 3 -o all.exr");
    merge("all.exr -o all-merged.exr");
    assert!(read("all-merged.exr") == read("whole.exr"));
    assert_eq!(exr_layers(&folder.path().join("merged.exr")).unwrap(), ["", "variance"]);
    // Negative control: two parts differ.
    let mean = |name: &str| read_exr(&folder.path().join(name)).unwrap();
    assert_ne!(mean("1-7.exr"), mean("18-24.exr"));
}

#[test]
fn a_part_resumes_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    cornell(folder.path(), "--samples 5-20 -o a.exr");
    let whole = read("a.exr");
    // The part has enough samples already: its sums are read and written unchanged.
    assert_eq!(cornell(folder.path(), "--samples 5-20 --resume -o a.exr").1, "");
    assert!(read("a.exr") == whole);
    for (words, why) in [
        ("--samples 5-21", "it is of samples 5-20, not of samples 5-21"),
        ("--spp 20", "it is of samples 5-20, not of all samples"),
    ] {
        let output = output(folder.path(), &format!("reference demo:cornell --size 32x32 {words} --resume -o a.exr"));
        assert!(!output.status.success() && text(&output.stderr).contains(why), "{}", text(&output.stderr));
    }
}

#[test]
fn parts_of_different_ground_truths_are_not_merged() {
    let folder = tempfile::tempdir().unwrap();
    for (name, words) in [
        ("a", "--samples 1-2"),
        ("b", "--samples 3-4"),
        ("c", "--samples 4-5"),
        ("d", "--samples 6-6"),
        ("seed", "--samples 3-4 --seed 9"),
        ("depth", "--samples 3-4 --max-depth 2"),
        ("light", "--samples 3-4 --point 0,1,0,5"),
        ("whole", "--spp 2"),
    ] {
        cornell(folder.path(), &format!("{words} -o {name}.exr"));
    }
    fs::write(folder.path().join("cut.exr"), &fs::read(folder.path().join("b.exr")).unwrap()[..5000]).unwrap();
    let before = contents(folder.path());
    for (words, why) in [
        ("a.exr b.exr c.exr -o o.exr", "b.exr and c.exr: both have samples 4-4"),
        ("a.exr a.exr -o o.exr", "both have samples 1-2"),
        ("d.exr a.exr -o o.exr", "samples 3-5 are in none of the parts"),
        ("a.exr seed.exr -o o.exr", "seed.exr: not of the same ground truth as a.exr: its seed is 9, not 0"),
        ("a.exr depth.exr -o o.exr", "max-depth is 2 there and unlimited in the other"),
        ("a.exr light.exr -o o.exr", "the scene's content differs"),
        ("a.exr whole.exr -o o.exr", "whole.exr: not a part of a ground truth"),
        ("a.exr gone.exr -o o.exr", "gone.exr"),
        ("a.exr cut.exr -o o.exr", "cut.exr"),
        ("a.exr b.exr -o a.exr", "both a part and the merged image"),
        ("a.exr b.exr -o o.png", ".exr"),
        ("-o o.exr", "PART.exr"),
        ("a.exr", "--output"),
    ] {
        let output = output(folder.path(), &format!("merge {words}"));
        let error = text(&output.stderr);
        assert!(!output.status.success() && output.stdout.is_empty(), "{words}: {error}");
        assert!(error.contains(why) && !error.contains("internal error"), "{words}: {error}");
        assert!(contents(folder.path()) == before, "{words}");
    }
}
