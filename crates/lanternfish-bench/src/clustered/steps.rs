//! Passes grouped into the steps of clustered shading [VanGelderen2020, fig. 6.7, fig. 6.8].

use lanternfish_gpu::PassTime;
use serde::{Serialize, Serializer};

use crate::run::sorted;

/// Milliseconds of each step, all views and grids together, in the order of [`NAMES`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps(pub [f64; 8]);

/// The steps: the depth prepass; counting the fragments of every cluster; making the list of visible clusters; moving lights to cluster
/// space, sorting them, and building the tree over them; counting the lights of every cluster, and finding where each list starts; writing
/// the lists of lights; shading, of transparent surfaces too; all other passes: sky and output.
pub const NAMES: [&str; 8] = ["prepass", "mark", "compact", "sort + tree", "count", "write", "shading", "other"];

impl Steps {
    /// The steps of a frame, from its passes in the order in which they ran.
    pub fn of(passes: &[PassTime]) -> Self {
        // Two scans bear one name: after `flag` and after `count`.
        let mut counting = false;
        Self(sorted(passes, |name| {
            let clustered = name.strip_prefix("light_culling/clustered/");
            counting = match clustered {
                Some("count") => true,
                Some("flag" | "mark" | "mark_drawn") => false,
                _ => counting,
            };
            Some(match clustered {
                Some("mark" | "mark_drawn") => 1,
                Some("count") => 4,
                Some("write") => 5,
                Some("flag" | "compact") => 2,
                Some("scan" | "scan_add") if counting => 4,
                Some("scan" | "scan_add") => 2,
                Some(_) => 3,
                None if name == "prepass" => 0,
                None if name.starts_with("shading/") => 6,
                None => 7,
            })
        }))
    }

    /// Milliseconds of what the thesis calls visibility: the depth pass, and counting the fragments of clusters
    /// [VanGelderen2020, fig. 6.8].
    pub fn visibility(&self) -> f64 {
        self.0[0] + self.0[1]
    }

    /// Milliseconds of finding the lights: everything but drawing.
    pub fn culling(&self) -> f64 {
        self.0[1..6].iter().sum()
    }

    pub fn frame(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// An object; its keys are the last words of [`NAMES`].
impl Serialize for Steps {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(NAMES.map(|name| name.rsplit(' ').next().unwrap_or(name)).into_iter().zip(self.0))
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
    assert_eq!(steps.0, [1.0, 4.0, 8.0, 6.0, 4.0, 2.0, 1.0, 1.0]);
    assert_eq!((steps.frame(), steps.culling()), (27.0, 24.0));
    assert_eq!(steps.visibility(), 5.0);
    let json = serde_json::to_value(steps).unwrap();
    assert_eq!((&json["tree"], &json["prepass"]), (&6.0.into(), &1.0.into()));
}
