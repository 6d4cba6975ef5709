//! Passes grouped into the steps of clustered shading [VanGelderen2020, fig. 6.7, fig. 6.8].

use lanternfish_cli::times::sorted;
use lanternfish_gpu::PassTime;
use serde::{Serialize, Serializer};

/// Time of each step, ms, summed over all views and grids, in the order of [`NAMES`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps(pub [f64; 8]);

/// Names of the steps:
///
/// - `prepass`: depth prepass
/// - `mark`: counts the fragments of every cluster
/// - `compact`: lists the visible clusters
/// - `sort + tree`: transforms lights to cluster space, sorts them, and builds a tree over them
/// - `count`: counts the lights of every cluster, and computes the list starts
/// - `write`: writes the light lists
/// - `shading`: shading, transparent surfaces included
/// - `other`: all other passes: sky and output
pub const NAMES: [&str; 8] = ["prepass", "mark", "compact", "sort + tree", "count", "write", "shading", "other"];

impl Steps {
    /// Sums the passes of a frame, given in execution order, into steps.
    pub fn of(passes: &[PassTime]) -> Self {
        Self(sorted(passes, |name| {
            Some(match name.strip_prefix("light_culling/clustered/") {
                Some("mark" | "mark_drawn") => 1,
                Some("compact") => 2,
                Some("count" | "scan" | "scan_add") => 4,
                Some("write") => 5,
                Some(_) => 3,
                None if name == "prepass" => 0,
                None if name.starts_with("shading/") => 6,
                None => 7,
            })
        }))
    }

    /// Time of visibility, ms, as the thesis defines it: the depth pass, and counting the fragments of clusters
    /// [VanGelderen2020, fig. 6.8].
    pub fn visibility(&self) -> f64 {
        self.0[0] + self.0[1]
    }

    /// Time of light culling, ms: all steps but the prepass, shading and other passes.
    pub fn culling(&self) -> f64 {
        self.0[1..6].iter().sum()
    }

    /// Time of the frame, ms.
    pub fn frame(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// Serializes to an object whose keys are the last words of [`NAMES`].
impl Serialize for Steps {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(NAMES.map(|name| name.rsplit(' ').next().unwrap_or(name)).into_iter().zip(self.0))
    }
}

#[test]
fn passes_belong_to_the_steps_of_the_thesis() {
    let culling =
        ["mark", "mark_drawn", "compact", "keys", "sort/few", "scatter", "count", "scan", "scan_add", "write"];
    let grid = || culling.iter().map(|name| format!("light_culling/clustered/{name}"));
    let names = ["prepass".to_owned()]
        .into_iter()
        .chain(grid())
        .chain(grid())
        .chain(["shading/forward".to_owned(), "output".to_owned()]);
    let passes: Vec<_> = names.map(|name| PassTime { name, ms: 1.0 }).collect();
    let steps = Steps::of(&passes);
    assert_eq!(steps.0, [1.0, 4.0, 2.0, 6.0, 6.0, 2.0, 1.0, 1.0]);
    assert_eq!((steps.frame(), steps.culling()), (23.0, 20.0));
    assert_eq!(steps.visibility(), 5.0);
    let json = serde_json::to_value(steps).unwrap();
    assert_eq!((&json["tree"], &json["prepass"]), (&6.0.into(), &1.0.into()));
}
