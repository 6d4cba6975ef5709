//! The scenes: shots of `quality`, at another size and with other lights.

use lanternfish::settings::Materials;
use lanternfish_cli::{error::CliError, parse::Size};

use super::InMotion;
use crate::{
    bench::is_requested,
    quality::shots::{self, SHOTS},
    view::View,
};

/// Name of a scene, name of its shot, lights of light rain in place of the shot's, and materials.
type Source = (&'static str, &'static str, Option<&'static str>, Materials);

const SPONZA: Source = ("sponza", "sponza-ten", None, Materials::File);
const ATRIUM: Source = ("atrium, 1000 lights", "atrium", Some("rain:1000"), Materials::File);
const MATTE: Source = ("atrium, 1000 lights, matte", "atrium", Some("rain:1000"), Materials::Lambert);
const HALL: Source = ("hall", "hall", None, Materials::File);
const CORNELL: Source = ("cornell", "cornell", None, Materials::File);
const CITY: Source = ("candela-city", "candela-city", None, Materials::File);

pub const PRICE: &[Source] = &[SPONZA, ATRIUM, HALL, MATTE];
pub const RIGHT: &[Source] = &[CORNELL, HALL, ATRIUM, SPONZA, CITY];
pub const MOTION: &[Source] = &[("atrium", "atrium", None, Materials::File), SPONZA, CORNELL];

impl InMotion<'_> {
    /// The requested ones of these scenes, of this height in pixels. Those without their file are listed as left out.
    pub fn views(&self, sources: &[Source], height: u32) -> Result<Vec<View>, CliError> {
        let (mut views, assets) = (Vec::new(), shots::assets(self.args.shared.clone()));
        for (name, shot, rain, materials) in sources.iter().filter(|source| is_requested(&self.args.scenes, source.0)) {
            let Some(shot) = SHOTS.iter().find(|known| known.name == *shot) else { continue };
            if let Some(reason) = shot.missing(&assets) {
                self.bench.leave_out(*name, reason);
                continue;
            }
            let height = self.args.size.map_or(if self.args.quick { 36 } else { height }, |size| size.height);
            let width = match self.args.size {
                _ if shot.size.width == shot.size.height => height,
                Some(size) => size.width,
                None => height * 16 / 9,
            };
            let mut view = shot.load(&assets, *rain)?;
            (view.name, view.look.materials.model, view.size) =
                ((*name).to_owned(), *materials, Size { width, height });
            views.push(view);
        }
        Ok(views)
    }
}

#[test]
fn every_scene_has_a_shot() {
    assert!([PRICE, RIGHT, MOTION].concat().iter().all(|(_, shot, ..)| SHOTS.iter().any(|known| known.name == *shot)));
}
