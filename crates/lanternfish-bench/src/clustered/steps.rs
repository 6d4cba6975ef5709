//! Passes grouped into the steps of clustered shading [VanGelderen2020, fig. 6.7, fig. 6.8].

use lanternfish_gpu::PassTime;
use serde::Serialize;

/// Milliseconds of each step, all views and grids together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Steps {
    /// Depth prepass.
    pub prepass: f64,
    /// Counting the fragments of every cluster.
    pub mark: f64,
    /// Making the list of visible clusters.
    pub compact: f64,
    /// Moving lights to cluster space, sorting them, and building the tree over them.
    pub tree: f64,
    /// Counting the lights of every cluster, and finding where each list starts.
    pub count: f64,
    /// Writing the lists of lights.
    pub write: f64,
    /// Shading, including blended surfaces.
    pub shading: f64,
    /// All other passes: sky and output.
    pub other: f64,
}

pub const NAMES: [&str; 8] = ["prepass", "mark", "compact", "sort + tree", "count", "write", "shading", "other"];

impl Steps {
    /// The steps of a frame, from its passes in the order in which they ran.
    pub fn of(passes: &[PassTime]) -> Self {
        let mut steps = Self::default();
        // Two scans bear one name: after `flag` and after `count`.
        let mut counting = false;
        for PassTime { name, ms } in passes {
            let clustered = name.strip_prefix("light_culling/clustered/");
            counting = match clustered {
                Some("count") => true,
                Some("flag" | "mark" | "mark_drawn") => false,
                _ => counting,
            };
            let step = match clustered {
                Some("mark" | "mark_drawn") => &mut steps.mark,
                Some("count") => &mut steps.count,
                Some("write") => &mut steps.write,
                Some("flag" | "compact") => &mut steps.compact,
                Some("scan" | "scan_add") if counting => &mut steps.count,
                Some("scan" | "scan_add") => &mut steps.compact,
                Some(_) => &mut steps.tree,
                None if name == "prepass" => &mut steps.prepass,
                None if name.starts_with("shading/") => &mut steps.shading,
                None => &mut steps.other,
            };
            *step += ms;
        }
        steps
    }

    /// The inverse of [`Self::values`].
    pub fn of_values([prepass, mark, compact, tree, count, write, shading, other]: [f64; 8]) -> Self {
        Self { prepass, mark, compact, tree, count, write, shading, other }
    }

    /// Milliseconds of the steps, in the order of [`NAMES`].
    pub fn values(&self) -> [f64; 8] {
        [self.prepass, self.mark, self.compact, self.tree, self.count, self.write, self.shading, self.other]
    }

    /// Milliseconds of what the thesis calls visibility: the depth pass, and counting the fragments of clusters
    /// [VanGelderen2020, fig. 6.8].
    pub fn visibility(&self) -> f64 {
        self.prepass + self.mark
    }

    /// Milliseconds of finding the lights: everything but drawing.
    pub fn culling(&self) -> f64 {
        self.mark + self.compact + self.tree + self.count + self.write
    }

    pub fn frame(&self) -> f64 {
        self.values().iter().sum()
    }
}

#[test]
fn the_two_scans_are_told_apart_in_every_grid() {
    let culling = [
        "mark",
        "mark_drawn",
        "flag",
        "scan",
        "scan_add",
        "compact",
        "keys",
        "sort/scatter",
        "place",
        "count",
        "scan",
        "write",
    ];
    let grid = || culling.iter().map(|name| format!("light_culling/clustered/{name}"));
    let names = ["prepass".to_owned()]
        .into_iter()
        .chain(grid())
        .chain(grid())
        .chain(["shading/forward".to_owned(), "output".to_owned()]);
    let passes: Vec<_> = names.map(|name| PassTime { name, ms: 1.0 }).collect();
    let steps = Steps::of(&passes);
    assert_eq!(steps.values(), [1.0, 4.0, 8.0, 6.0, 4.0, 2.0, 1.0, 1.0]);
    assert_eq!((steps.frame(), steps.culling()), (27.0, 24.0));
    assert_eq!((steps.visibility(), Steps::of_values(steps.values())), (5.0, steps));
}
