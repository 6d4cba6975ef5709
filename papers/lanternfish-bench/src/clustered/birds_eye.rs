//! The visible clusters of a view from above [VanGelderen2020, fig. 4.8], drawn from the lists that the device made.
//!
//! The thesis colours the pixels of a second camera; here the clusters themselves are drawn, with the volumes of some lights.

use std::fmt::Write as _;

use glam::{DVec2, Vec3};
use lanternfish::light_culling::clustered::GridContents;
use lanternfish_cli::plot::escaped;
use lanternfish_scene::{Camera, Scene};

/// Size of the figure, pixels.
const SIZE: DVec2 = DVec2::new(640.0, 480.0);
/// Most light volumes that are drawn.
const MOST_LIGHTS: usize = 150;

/// The figure as SVG: clusters in the colour of their index modulo 3 along each axis, the view's frustum in green, the grid's in red, and
/// circles around lights. Up is where the camera looks.
pub fn figure(title: &str, camera: &Camera, aspect: f32, contents: &GridContents, scene: &Scene) -> String {
    let camera_from_world = camera.world_from_camera.inverse();
    let height = |p: &Vec3| camera_from_world.transform_point3(*p).y;
    let from_above = |p: &Vec3| {
        let p = camera_from_world.transform_point3(*p);
        DVec2::new(p.x.into(), p.z.into())
    };
    let grid = contents.geometry;
    let mut clusters: Vec<_> =
        contents.visible.iter().map(|cluster| (cluster.index, grid.corners(cluster.index))).collect();
    clusters.sort_by(|(_, a), (_, b)| height(&a[0]).total_cmp(&height(&b[0])));
    let shown = || clusters.iter().flat_map(|(_, corners)| corners).map(from_above).chain([DVec2::ZERO]);
    let (low, high) = (shown().fold(DVec2::INFINITY, DVec2::min), shown().fold(DVec2::NEG_INFINITY, DVec2::max));
    let (middle, scale) = (0.5 * (low + high), (0.85 * SIZE / (high - low).max(DVec2::splat(1e-6))).min_element());
    let at = |p: DVec2| 0.5 * SIZE + scale * (p - middle);
    let path = |points: &[DVec2]| {
        points.iter().map(|p| at(*p)).map(|p| format!("{:.1} {:.1}", p.x, p.y)).collect::<Vec<_>>().join("L")
    };
    let hull = |corners: &[Vec3]| path(&hull(corners.iter().map(from_above).collect()));

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" font-family=\"sans-serif\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        SIZE.x, SIZE.y
    );
    for (index, corners) in &clusters {
        let (x, y) = (grid.dimensions.x, grid.dimensions.y);
        let [r, g, b] = [index % x, index / x % y, index / x / y].map(|i| 127 * (i % 3));
        let _ = writeln!(svg, "<path d=\"M{}Z\" fill=\"rgb({r},{g},{b})\"/>", hull(corners));
    }
    let frustum = camera.projection.slopes(aspect).map(|[left, right, ..]| {
        let far = -low.y;
        [DVec2::new(f64::from(left) * far, -far), DVec2::ZERO, DVec2::new(f64::from(right) * far, -far)]
    });
    let frustum = frustum.map(|points| path(&points)).unwrap_or_default();
    let outline = hull(&grid.outline());
    for (points, color) in [(outline, "red"), (frustum, "limegreen")].into_iter().filter(|(d, _)| !d.is_empty()) {
        let _ = writeln!(svg, "<path d=\"M{points}Z\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>");
    }
    let within = |p: DVec2| p.cmpge(low).all() && p.cmple(high).all();
    let lights = scene.lights.iter().filter_map(|light| Some((from_above(&light.position), light.range?)));
    for (p, range) in lights.filter(|(p, _)| within(*p)).take(MOST_LIGHTS) {
        let (p, r) = (at(p), scale * f64::from(range));
        let _ =
            writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{r:.1}\" fill=\"none\" stroke=\"#888\"/>", p.x, p.y);
    }
    let _ = writeln!(svg, "<text x=\"10\" y=\"18\" font-size=\"14\">{}</text>\n</svg>", escaped(title));
    svg
}

/// The convex polygon around points, counterclockwise.
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let lower = half(&mut points.iter().copied());
    let upper = half(&mut points.iter().rev().copied());
    [lower, upper].concat()
}

#[test]
fn a_hull_has_the_corners_of_a_square_alone() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from);
    let inner = [[0.5, 0.5], [0.5, 0.0], [0.2, 0.9]].map(DVec2::from);
    assert_eq!(hull([inner.to_vec(), corners.to_vec()].concat()), corners);
}
