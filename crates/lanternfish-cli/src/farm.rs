//! `lanternfish farm`: writes a sequence as an Open Job Description job for many machines.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use clap::Args;

use crate::{
    args::demos,
    error::CliError,
    output::{self, Output},
    parse::{self, Span},
    scene::SceneName,
    shot,
};

pub const HELP: &str = "\
Examples:
  240 frames in chunks of 10, as a job beside the shot, then run on this machine:
    lanternfish farm shot.toml --frames 1-240 --chunk 10 -o job.yaml
    openjd run job.yaml

The job has parameters: Shot, Image, Frames, Chunk, and Lanternfish, the program as the machines
find it. Everything else about the images is said by the shot; `lanternfish shot SCENE FLAGS` writes
one.";

#[derive(Debug, Args)]
pub struct FarmArgs {
    #[arg(help = format!("What is rendered: a shot (.toml), a scene's file, or {}", demos()))]
    pub scene: SceneName,
    /// Frame range: A-B.
    #[arg(id = "wanted", long = "frames", value_name = "A-B", value_parser = parse::span)]
    pub wanted: Span<u32>,
    /// Frames per task. A machine loads the scene and compiles the shaders once per task.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=99_999))]
    pub chunk: u32,
    /// Frames per second, if the shot does not set them.
    #[arg(id = "rate", long = "fps", value_name = "N", value_parser = parse::fps)]
    pub fps: Option<f32>,
    /// The images, with the frame number before the extension: --output of `render`. Without it: as in the shot, or the
    /// shot's name with .png.
    #[arg(long = "image", alias = "picture", value_name = "FILE")]
    pub rendering: Option<PathBuf>,
    /// The job's file. Shot and images must lie in its folder or below. Without it: standard output, for a file in the
    /// current folder.
    #[arg(id = "job", short = 'o', long = "output", value_name = "FILE.yaml")]
    pub output: Option<PathBuf>,
}

pub fn run(args: &FarmArgs) -> Result<(), CliError> {
    let scene = &args.scene;
    let is_file = scene.demo().is_none();
    if is_file && !scene.path().is_file() {
        return Err(CliError::new(
            format_args!("{scene}: there is no such file"),
            "name a shot, a scene, or demo:NAME",
        ));
    }
    let said = match (&args.rendering, shot::is_shot(scene)) {
        (Some(rendering), _) => Some(rendering.clone()),
        (None, true) => shot::read(scene.path())?.args.output.output,
        (None, false) => None,
    };
    let rendering = Output::named(said.as_deref(), scene)?.path;
    if let Some(job) = &args.output {
        output::check_writable(job)?;
        output::refuse_same(&[(job, "the job")], &[(scene.path(), "the shot"), (&rendering, "the image")])?;
    }
    let folder = args.output.as_deref().map_or(Path::new(""), |job| job.parent().unwrap_or(Path::new("")));
    let shot = match is_file {
        true => below(folder, scene.path())?,
        false => scene.to_string(),
    };
    let text = template(args, &shot, &below(folder, &rendering)?, is_file);
    match &args.output {
        None => output::print(&text),
        Some(job) => output::write_text(job, &text).and_then(|()| output::print(&format!("{}\n", job.display()))),
    }
}

/// `path` relative to `folder`, with slashes. Paths outside the folder are refused: a job could read or write any file.
fn below(folder: &Path, path: &Path) -> Result<String, CliError> {
    let canonical = |path: &Path| -> io::Result<PathBuf> {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Ok(fs::canonicalize(parent)?.join(path.file_name().unwrap_or_default()))
    };
    let failed =
        |error: io::Error| CliError::new(format_args!("{}: {error}", path.display()), "create its folder first");
    let base = fs::canonicalize(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).map_err(failed)?;
    let path = canonical(path).map_err(failed)?;
    let inner = path.strip_prefix(&base).ok().and_then(|inner| {
        inner.iter().map(|part| part.to_str()).collect::<Option<Vec<_>>>().map(|parts| parts.join("/"))
    });
    inner.ok_or_else(|| {
        let common = base.ancestors().find(|folder| path.starts_with(folder));
        let remedy = match common.filter(|folder| folder.parent().is_some()) {
            Some(common) => {
                let job = common.join("job.yaml");
                format!("write the job into a folder that holds both, -o {}, or copy the file", job.display())
            }
            None => "copy the file into it".to_owned(),
        };
        CliError::new(format_args!("{}: not in the job's folder, {}", path.display(), base.display()), remedy)
    })
}

/// The job template. Its paths are relative to the job's file.
fn template(args: &FarmArgs, shot: &str, rendering: &str, is_file: bool) -> String {
    // A JSON string is also a YAML string.
    let quoted = |text: &str| serde_json::to_string(text).expect("text");
    let (wanted, chunk) = (args.wanted, args.chunk);
    let name: String =
        Path::new(shot).file_stem().map(|stem| stem.to_string_lossy().replace(['{', '}'], "_")).unwrap_or_default();
    let name: String = name.chars().filter(|c| !c.is_control()).take(64).collect();
    let fps = args.fps.map(|fps| format!("\n            - --fps\n            - \"{fps}\"")).unwrap_or_default();
    let (name, shot, rendering) = (quoted(&name), quoted(shot), quoted(rendering));
    let kind = match is_file {
        true => "PATH\n    objectType: FILE\n    dataFlow: IN",
        false => "STRING",
    };
    format!(
        r#"# Open Job Description: renders a sequence in chunks, then verifies it. Written by `lanternfish farm`.
specificationVersion: jobtemplate-2023-09
extensions:
  - TASK_CHUNKING
name: {name}
parameterDefinitions:
  - name: Shot
    description: What is rendered.
    type: {kind}
    default: {shot}
  - name: Image
    description: The images. The frame number goes before the extension.
    type: PATH
    objectType: FILE
    dataFlow: OUT
    default: {rendering}
  - name: Frames
    description: Which frames, A-B.
    type: STRING
    default: "{wanted}"
  - name: Chunk
    description: Frames per task.
    type: INT
    minValue: 1
    default: {chunk}
  - name: Lanternfish
    description: Path of the program on the render machines.
    type: STRING
    default: lanternfish
steps:
  - name: Render
    parameterSpace:
      taskParameterDefinitions:
        - name: Frame
          type: CHUNK[INT]
          range: "{{{{Param.Frames}}}}"
          chunks:
            defaultTaskCount: "{{{{Param.Chunk}}}}"
            rangeConstraint: CONTIGUOUS
    script:
      actions:
        onRun:
          command: "{{{{Param.Lanternfish}}}}"
          args:
            - render
            - "{{{{Param.Shot}}}}"
            - --frames
            - "{{{{Task.Param.Frame}}}}"{fps}
            - --skip-existing
            - --progress
            - openjd
            - -o
            - "{{{{Param.Image}}}}"
          cancelation:
            mode: NOTIFY_THEN_TERMINATE
            notifyPeriodInSeconds: 10
  - name: Verify
    dependencies:
      - dependsOn: Render
    script:
      actions:
        onRun:
          command: "{{{{Param.Lanternfish}}}}"
          args:
            - frames
            - "{{{{Param.Shot}}}}"
            - "{{{{Param.Frames}}}}"
            - -o
            - "{{{{Param.Image}}}}"
"#
    )
}

#[cfg(test)]
mod tests {
    use crate::testing::Place;

    #[test]
    fn a_job_has_relative_paths() {
        let place = Place::with(&[("walk.toml", "scene = \"demo:cornell\"\n[output]\noutput = \"out/walk.png\"\n")]);
        std::fs::create_dir(place.path("out")).unwrap();
        let job = |words: &str| {
            place.done(&format!("farm {words} -o %job.yaml"));
            place.text("job.yaml")
        };
        let text = job("%walk.toml --frames 1-24 --chunk 5");
        for line in [
            "  - TASK_CHUNKING",
            "    default: \"walk.toml\"",
            "    default: \"out/walk.png\"",
            "    default: \"1-24\"",
            "    default: 5",
            "            - \"{{Task.Param.Frame}}\"",
        ] {
            assert!(text.lines().any(|other| other == line), "{line} is not in:\n{text}");
        }
        assert!(!text.contains("--fps"));
        let text = job("demo:cornell --frames 3 --fps 12.5 --image %out/b.exr");
        assert!(
            text.contains("            - --fps\n            - \"12.5\"\n") && text.contains("\"out/b.exr\""),
            "{text}"
        );
        assert!(text.contains("type: STRING\n    default: \"demo:cornell\""), "{text}");
    }
}
