//! Comparison of all light culling schemes: lengths of their lists, memory, and times.

use lanternfish::{
    RenderError, RenderedImage,
    settings::{Culling, Settings, Shadows},
    techniques::{Clustered, TileSize, Tiled},
};
use lanternfish_cli::{
    error::CliError,
    images::differing,
    report::grouped,
    timed::Timed,
    times::{counter, ms_of},
};
use lanternfish_papers::RasterGrid;
use lanternfish_scene::{Camera, Scene};

use super::cases::BRUTE_FORCE_TESTS;
use crate::{bench::Bench, case::changed, document::LeftOut, table::Row};

/// The compared schemes: each technique with its defaults, and other tile sizes and numbers of layers.
fn cullings(look: &Settings, quick: bool) -> Vec<Culling> {
    let schemes = [
        "tiled",
        "tiled, tile-size 8",
        "tiled, tile-size 32",
        "clustered",
        "raster-grid",
        "raster-grid, tile-size 8, grid-layers 32",
        "raster-grid, tile-size 16, grid-layers 8",
        "raster-grid, tile-size 32, grid-layers 32",
    ];
    let wanted = schemes.into_iter().filter(|scheme| !quick || !scheme.contains(','));
    wanted.map(|scheme| changed(look, &format!("culling {scheme}")).culling).collect()
}

/// Name of a scheme, with its values as on the command line.
fn name(culling: &Culling) -> String {
    let name = culling.name();
    match (culling.get::<Tiled>(), culling.get::<Clustered>(), culling.get::<RasterGrid>()) {
        (Some(tiled), ..) => format!("{name} {}", tiled.tile_size),
        (_, Some(clustered), _) => format!("{name} {}", clustered.shape),
        (.., Some(grid)) => format!("{name} {}, {} layers", grid.tile_size, grid.layers),
        _ => name.to_owned(),
    }
}

/// Number of tiles of an image.
fn tiles(size: TileSize, width: u32, height: u32) -> u64 {
    u64::from(width.div_ceil(size.pixels())) * u64::from(height.div_ceil(size.pixels()))
}

/// Measures every scheme and number of lights, in one view. Returns what is left out beside the rows.
pub fn measure(
    bench: &Bench,
    (camera, [width, height]): (&Camera, [u32; 2]),
    scenes: &[Scene],
    quick: bool,
) -> Result<(Vec<Row>, Vec<LeftOut>), CliError> {
    let (mut rows, mut left_out) = (Vec::new(), Vec::new());
    let mut firsts: Vec<Option<RenderedImage>> = scenes.iter().map(|_| None).collect();
    let look = Settings::direct_light().with_shadows(Shadows::None);
    for culling in cullings(&look, quick) {
        let mut renderer = bench.renderer(&look.clone().with_culling(culling.clone()))?;
        for (scene, first) in scenes.iter().zip(&mut firsts) {
            let lights = scene.lights.len() as u64;
            let what = format!("{}, {} lights", name(&culling), grouped(lights));
            let tests = culling.get::<Tiled>().map_or(0, |tiled| tiles(tiled.tile_size, width, height) * lights);
            if tests > BRUTE_FORCE_TESTS {
                let reason = format!("{} tests of a light against a tile", grouped(tests));
                left_out.push(LeftOut { what, reason });
                continue;
            }
            let uploaded = renderer.upload(scene)?;
            let mut frame = || renderer.render(&uploaded, camera, [width, height]);
            let result = bench.step("schemes", &what, || {
                let image = frame()?;
                let times = Timed::each(bench.runs, || {
                    let passes = frame()?.report.passes;
                    Ok::<_, RenderError>(["light_culling/", "shading/"].map(|folder| ms_of(&passes, folder)))
                })?;
                Ok::<_, RenderError>((image, times.map(|times| times.median())))
            });
            match result {
                Ok((image, times)) => {
                    let first = first.get_or_insert_with(|| image.clone());
                    let differing = differing(first, &image);
                    rows.push(row(&culling, lights, &image, times).data("differing_pixels", differing));
                }
                Err(error) => left_out.push(LeftOut { what, reason: error.to_string() }),
            }
        }
    }
    rows.sort_by_key(|row| row.get("lights").as_u64());
    Ok((rows, left_out))
}

fn row(culling: &Culling, lights: u64, rendering: &RenderedImage, [building, shading]: [f64; 2]) -> Row {
    let counter = |name| counter(&rendering.report, name);
    let listed = counter("light_culling/listed_lights");
    let tiles = |size| tiles(size, rendering.width, rendering.height);
    // Bytes of cells, lists and their inputs, as documented for each technique.
    let bytes = match (culling.get::<Tiled>(), culling.get::<RasterGrid>()) {
        // A list start and a volume per tile.
        (Some(tiled), _) => 36 * tiles(tiled.tile_size) + 4 * listed,
        // A list start and a write position per cell, a mask per tile, an outline per light.
        (_, Some(grid)) => tiles(grid.tile_size) * (8 * u64::from(grid.layers) + 4) + 8 * lights + 4 * listed,
        // Includes the lists.
        _ => counter("light_culling/cluster_bytes"),
    };
    Row::default()
        .count("lights", "lights", lights)
        .text("scheme", "scheme", name(culling))
        .count("lights_listed", "lights listed", listed)
        // Tests of a light or a node of the light tree against a cell. Each runs again when the lists are written.
        .count("light_tests", "light tests", counter("light_culling/light_tests"))
        .count("bytes", "KiB", bytes)
        .said_as(grouped(bytes / 1024))
        .fixed("building_ms", "building ms", 2, building)
        .fixed("shading_ms", "shading ms", 2, shading)
}

#[test]
fn every_scheme_but_the_baseline_is_compared() {
    lanternfish_papers::register();
    for quick in [false, true] {
        let compared = cullings(&Settings::direct_light(), quick);
        let mut names: Vec<_> = compared.iter().map(name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), compared.len(), "a scheme twice");
        assert!(Culling::all().iter().all(|technique| compared.contains(technique)), "{names:?}");
    }
    assert_eq!(tiles(TileSize::Px16, 480, 270), 510);
}
