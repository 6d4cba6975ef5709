//! The scenes: shots of `quality` at another size.

use lanternfish_cli::{error::CliError, parse::Size};

use super::InMotion;
use crate::{
    bench::is_requested,
    quality::shots::{self, SHOTS},
    view::View,
};

/// Names of the shots.
const SCENES: [&str; 3] = ["atrium", "sponza-ten", "cornell"];

impl InMotion<'_> {
    /// The first requested scene, of this height in pixels. Those without their file are listed as left out.
    pub fn view(&self, height: u32) -> Result<Option<View>, CliError> {
        let assets = shots::assets(self.args.shared.clone());
        for name in SCENES.into_iter().filter(|name| is_requested(&self.args.scenes, name)) {
            let Some(shot) = SHOTS.iter().find(|known| known.name == name) else { continue };
            if let Some(reason) = shot.missing(&assets) {
                self.bench.leave_out(name, reason);
                continue;
            }
            let height = self.args.size.map_or(if self.args.quick { 36 } else { height }, |size| size.height);
            let width = match self.args.size {
                _ if shot.size.width == shot.size.height => height,
                Some(size) => size.width,
                None => height * 16 / 9,
            };
            let size = Size { width, height };
            return Ok(Some(View { size, ..shot.load(&assets, None)? }));
        }
        Ok(None)
    }
}

#[test]
fn every_scene_has_a_shot() {
    assert!(SCENES.iter().all(|name| SHOTS.iter().any(|known| known.name == *name)));
}
