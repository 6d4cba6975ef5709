//! Several scenes in one process, which opens the adapter and compiles shaders once.

use std::{
    collections::{HashMap, HashSet},
    fs, io,
    path::{Path, PathBuf},
    time::Instant,
};

use clap::{ArgMatches, Args};

use crate::{
    args::{RenderArgs, keys::is_given},
    ending::has_ending,
    error::{self, CliError},
    output,
    scene::SceneName,
    shot,
};

/// Endings of scenes in a folder.
const SCENES: [&str; 3] = ["glb", "gltf", "obj"];
/// Endings of images.
const IMAGES: [&str; 5] = ["png", "exr", "jpg", "npz", "gif"];
/// Size of thumbnails, pixels.
const THUMBNAIL: &str = "256x256";

/// The scenes of a run of `render`.
#[derive(Debug, Args)]
pub struct ManyArgs {
    /// The flags, and the first scene.
    #[command(flatten)]
    pub render: RenderArgs,
    /// More scenes, and folders of scenes, each to an image of its own name; then -o names a folder.
    ///
    /// Subfolders are left out. If an earlier image has the name, it is name-2.png.
    #[arg(value_name = "SCENE", help_heading = None::<&'static str>, hide_short_help = true)]
    pub more: Vec<SceneName>,
    /// Images of 256 x 256 pixels, also of a folder of scenes: --size chooses another size.
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub thumbnails: bool,
}

/// Renders every scene. A scene that fails does not keep the others from being rendered; the result is false then.
pub fn run(args: &ManyArgs, matches: &ArgMatches, started: Instant) -> Result<bool, CliError> {
    let is_folder = |scene: &SceneName| scene.demo().is_none() && !shot::is_shot(scene) && scene.path().is_dir();
    let named: Vec<_> = [&args.render.scene].into_iter().chain(&args.more).cloned().collect();
    if let Some(image) = named[1..].iter().find(|scene| IMAGES.iter().any(|ending| has_ending(scene.path(), ending))) {
        return Err(CliError::new(format_args!("{image}: an image, not a scene"), "-o FILE names the image"));
    }
    let mut device = None;
    if let [scene] = &named[..]
        && !is_folder(scene)
    {
        let mut shot = shot::resolve(scene, matches)?;
        args.resize(&mut shot, matches);
        return super::run(&shot, started, &mut device).map(|()| true);
    }
    let mut scenes = Vec::new();
    for scene in named {
        match is_folder(&scene) {
            true => scenes.extend(scenes_in(scene.path(), args.render.run.quiet)?),
            false => scenes.push(scene),
        }
    }
    let folder = args.folder()?;
    let mut failed = Vec::new();
    for (scene, path) in scenes.iter().zip(names(&scenes)) {
        let rendered = shot::resolve(scene, matches).and_then(|mut shot| {
            args.resize(&mut shot, matches);
            // A shot names its own image.
            if args.render.output.output.is_some() || !shot::is_shot(scene) {
                let path = folder.join(path);
                output::refuse_texture(&path, scene)?;
                shot.args.output.output = Some(path);
            }
            super::run(&shot, Instant::now(), &mut device)
        });
        if let Err(error) = rendered {
            error::say(&error);
            failed.push(scene.to_string());
            // The next scene may do without what failed.
            device = None;
        }
    }
    if !failed.is_empty() && scenes.len() > 1 {
        error::say(&format_args!("{} of {} scenes failed: {}", failed.len(), scenes.len(), failed.join(", ")));
    }
    Ok(failed.is_empty())
}

impl ManyArgs {
    /// The folder of the images.
    fn folder(&self) -> Result<PathBuf, CliError> {
        let refused = |what: &str, hint: &str| Err(CliError::new(what.to_owned(), hint));
        if self.render.run.report.is_some() {
            return refused("--report with several scenes", "it is about one scene: render them one by one");
        }
        if let Some(quantity) = self.render.quantities().iter().find(|quantity| quantity.needs_floats()) {
            let what = format!("--outputs {} with several scenes: their images are .png files", quantity.name());
            return refused(&what, "render them one by one, each with -o NAME.exr or NAME.npz");
        }
        match &self.render.output.output {
            None => Ok(PathBuf::new()),
            Some(path) if path.is_dir() => Ok(path.clone()),
            Some(path) if !path.exists() && path.extension().is_none() => match fs::create_dir(path) {
                Ok(()) => Ok(path.clone()),
                Err(error) => refused(&format!("{}: {error}", path.display()), "name another folder"),
            },
            Some(path) => {
                refused(&format!("{}: several scenes, and this is no folder", path.display()), "name a folder")
            }
        }
    }

    /// Gives thumbnails their size.
    fn resize(&self, shot: &mut shot::Shot, matches: &ArgMatches) {
        if self.thumbnails && !is_given(matches, "size") {
            let size = crate::parse::size(THUMBNAIL).expect("this is a size");
            (shot.args.output.size, shot.args.view.size) = (size, [size.width, size.height]);
        }
    }
}

/// The scenes in a folder, by name. Notes subfolders that have scenes, too, unless it is to be `quiet`.
fn scenes_in(folder: &Path, quiet: bool) -> Result<Vec<SceneName>, CliError> {
    let failed =
        |what: &dyn std::fmt::Display, hint: &str| CliError::new(format!("{}: {what}", folder.display()), hint);
    let is_scene = |path: &PathBuf| SCENES.iter().any(|ending| has_ending(path, ending));
    let hint = "name a scene, or a folder of .glb, .gltf or .obj files";
    let paths = entries(folder).map_err(|error| failed(&error, hint))?;
    let has_scenes = |path: &&PathBuf| path.is_dir() && entries(path).is_ok_and(|paths| paths.iter().any(is_scene));
    let others: Vec<_> = paths.iter().filter(has_scenes).map(|path| path.display().to_string()).collect();
    let others = others.join(", ");
    let scenes: Vec<_> = paths.into_iter().filter(is_scene).map(SceneName::from).collect();
    match (scenes.is_empty(), others.is_empty()) {
        (true, true) => return Err(failed(&"this is a folder, without a scene", hint)),
        (true, false) => return Err(failed(&"this folder has scenes in others only", &format!("name them: {others}"))),
        (false, false) if !quiet => error::say(&format_args!("note: not rendered, unless named: scenes in {others}")),
        _ => {}
    }
    Ok(scenes)
}

/// The paths in a folder, in order.
fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

/// A name for the image of each scene: the scene's, with a number from 2 on if an earlier one has it.
fn names(scenes: &[SceneName]) -> Vec<PathBuf> {
    let (mut taken, mut counts) = (HashSet::new(), HashMap::<_, u32>::new());
    let named = scenes.iter().map(|scene| {
        let name = output::default_path(scene);
        let count = counts.entry(name.clone()).or_insert(1);
        let mut free = name.clone();
        while !taken.insert(free.clone()) {
            *count += 1;
            let mut stem = name.file_stem().unwrap_or_default().to_owned();
            stem.push(format!("-{count}.png"));
            free = stem.into();
        }
        free
    });
    named.collect()
}

#[cfg(test)]
#[test]
fn every_scene_has_an_image_of_its_own() {
    let scenes = ["a/cup.glb", "b/cup.obj", "hat.glb", "cup-2.glb", "c/cup.glb", "demo:hall"].map(SceneName::from);
    let expected = ["cup.png", "cup-2.png", "hat.png", "cup-2-2.png", "cup-3.png", "hall.png"].map(PathBuf::from);
    assert_eq!(names(&scenes), expected);
}
