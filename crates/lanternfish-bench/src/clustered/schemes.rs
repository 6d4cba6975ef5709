//! Every scheme of light culling beside each other: what it lists, what that takes, and how long.

use lanternfish::{
    GpuScene, Picture, RenderError, Renderer,
    rooms::Family,
    settings::{Clustered, Culling, RasterGrid, Settings, Shadows, TileSize, Tiled},
};
use lanternfish_gpu::{Engine, PassTime};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

use super::configurations::BRUTE_FORCE_TESTS;
use crate::forward_plus::{differing, median};
use lanternfish_cli::{error::CliError, report::grouped};

/// What one scheme did with so many lights.
#[derive(Debug, Serialize)]
pub struct SchemeRow {
    pub scheme: String,
    pub lights: usize,
    /// Entries of the lists for the surfaces.
    pub lights_listed: u64,
    /// Tests of a light, or of a node of a tree over lights, against a cell; each is made again when the lists are written.
    pub light_tests: u64,
    /// Bytes of cells, lists and what they are made from.
    pub bytes: u64,
    /// Milliseconds of finding lights, for blended surfaces too: median over the runs.
    pub building_ms: f64,
    /// Milliseconds of shading: median over the runs.
    pub shading_ms: f64,
    /// Pixels that differ in any bit from those of the first row with these lights.
    pub differing_pixels: usize,
}

/// A scheme without figures.
#[derive(Debug, Serialize)]
pub struct SchemeLeftOut {
    pub scheme: String,
    pub lights: usize,
    pub reason: String,
}

/// What is compared: each room as it is where nobody says otherwise, and other sizes of tiles and numbers of layers.
fn cullings(quick: bool) -> Vec<Culling> {
    let tiled = |tile_size| Culling::Tiled(Tiled { tile_size, ..Tiled::default() });
    let grid = |tile_size, layers| Culling::RasterGrid(RasterGrid { tile_size, layers });
    let mut all = vec![
        Culling::Tiled(Tiled::default()),
        Culling::Clustered(Clustered::default()),
        Culling::RasterGrid(RasterGrid::default()),
    ];
    if !quick {
        let more = [
            tiled(TileSize::Px8),
            tiled(TileSize::Px32),
            grid(TileSize::Px8, 32),
            grid(TileSize::Px16, 8),
            grid(TileSize::Px32, 32),
        ];
        all.extend(more);
        all.sort_by_key(|culling| Culling::rooms().iter().position(|room| room.name() == culling.name()));
    }
    all
}

/// By the flags of the command line.
fn name(culling: &Culling) -> String {
    match culling {
        Culling::Tiled(tiled) => format!("tiled {}", tiled.tile_size),
        Culling::Clustered(clustered) => format!("clustered {}", clustered.shape),
        Culling::RasterGrid(grid) => format!("raster-grid {}, {} layers", grid.tile_size, grid.layers),
        other => other.name().to_owned(),
    }
}

/// Tiles of a picture.
fn tiles(size: TileSize, width: u32, height: u32) -> u64 {
    u64::from(width.div_ceil(size.pixels())) * u64::from(height.div_ceil(size.pixels()))
}

/// Rows of every scheme and number of lights, in one view.
pub fn measure(
    engine: &Engine,
    runs: u32,
    view: (&Camera, u32, u32),
    scenes: &[Scene],
    quick: bool,
) -> Result<(Vec<SchemeRow>, Vec<SchemeLeftOut>), CliError> {
    let (mut rows, mut left_out) = (Vec::new(), Vec::new());
    let mut firsts: Vec<Option<Picture>> = scenes.iter().map(|_| None).collect();
    let (_, width, height) = view;
    for culling in cullings(quick) {
        let scheme = name(&culling);
        eprintln!("  {scheme}");
        let settings = Settings { culling, shadows: Shadows::None, ..Settings::direct_light() };
        let mut renderer = Renderer::with_engine(engine, settings)?;
        for (scene, first) in scenes.iter().zip(&mut firsts) {
            let lights = scene.lights.len();
            let mut leave_out = |reason| left_out.push(SchemeLeftOut { scheme: scheme.clone(), lights, reason });
            if let Culling::Tiled(tiled) = culling {
                let tests = tiles(tiled.tile_size, width, height) * lights as u64;
                if tests > BRUTE_FORCE_TESTS {
                    leave_out(format!("{} tests of a light against a tile", grouped(tests)));
                    continue;
                }
            }
            let uploaded = renderer.upload(scene)?;
            match row(&mut renderer, &uploaded, view, runs, first) {
                Ok(row) => {
                    let bytes = bytes(culling, lights as u64, &row, width, height);
                    rows.push(SchemeRow { scheme: scheme.clone(), lights, bytes, ..row });
                }
                Err(error) => leave_out(error.to_string()),
            }
        }
    }
    Ok((rows, left_out))
}

/// What the renderer says: the bytes are those of clusters, or none.
fn row(
    renderer: &mut Renderer,
    scene: &GpuScene,
    (camera, width, height): (&Camera, u32, u32),
    runs: u32,
    first: &mut Option<Picture>,
) -> Result<SchemeRow, RenderError> {
    let picture = renderer.render(scene, camera, width, height)?;
    let counter = |name: &str| {
        let found = picture.report.counters.iter().find(|(known, _)| known == name);
        found.map_or(0, |(_, count)| *count)
    };
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..runs {
        let passes = renderer.render(scene, camera, width, height)?.report.passes;
        for (times, folder) in times.iter_mut().zip(["light_culling/", "shading/"]) {
            times.push(milliseconds(&passes, folder));
        }
    }
    let [building_ms, shading_ms] = times.map(|mut times| median(&mut times));
    Ok(SchemeRow {
        scheme: String::new(),
        lights: 0,
        lights_listed: counter("light_culling/listed_lights"),
        light_tests: counter("light_culling/light_tests"),
        bytes: counter("light_culling/cluster_bytes"),
        building_ms,
        shading_ms,
        differing_pixels: differing(first.get_or_insert_with(|| picture.clone()), &picture),
    })
}

fn milliseconds(passes: &[PassTime], folder: &str) -> f64 {
    passes.iter().filter(|pass| pass.name.starts_with(folder)).map(|pass| pass.ms).sum()
}

/// Bytes of cells, lists and what they are made from, as the pages of the rooms have them.
fn bytes(culling: Culling, lights: u64, row: &SchemeRow, width: u32, height: u32) -> u64 {
    let tiles = |size| tiles(size, width, height);
    4 * row.lights_listed
        + match culling {
            // A start and a volume a tile.
            Culling::Tiled(tiled) => 36 * tiles(tiled.tile_size),
            // A start and the next place a cell, a mask a tile, an outline a light.
            Culling::RasterGrid(grid) => tiles(grid.tile_size) * (8 * u64::from(grid.layers) + 4) + 8 * lights,
            // Lists are among them.
            _ => return row.bytes,
        }
}

#[test]
fn every_scheme_but_the_yardstick_is_compared() {
    for quick in [false, true] {
        let compared = cullings(quick);
        let mut names: Vec<_> = compared.iter().map(name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), compared.len(), "a scheme twice");
        assert!(Culling::rooms().iter().all(|room| compared.contains(room)), "{names:?}");
    }
    assert_eq!(tiles(TileSize::Px16, 480, 270), 510);
}
