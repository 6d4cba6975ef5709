//! The scenes: shots of `quality`, at another size and with other lights.

use lanternfish::settings::{Materials, Settings};
use lanternfish_cli::{error::CliError, parse::Size};
use lanternfish_scene::{Camera, Scene};

use super::Bench;
use crate::{
    document::LeftOut,
    quality::shots::{SHOTS, Shot},
};

/// A view of a scene, ready to be rendered.
#[derive(Clone)]
pub struct View {
    pub name: &'static str,
    pub scene: Scene,
    pub camera: Camera,
    /// Settings of direct light.
    pub look: Settings,
    pub size: Size,
}

/// Name of a scene, name of its shot, lights of light rain in place of the shot's, and materials.
type Source = (&'static str, &'static str, Option<u32>, Materials);

const SPONZA: Source = ("sponza", "sponza-ten", None, Materials::File);
const ATRIUM: Source = ("atrium, 1000 lights", "atrium", Some(1000), Materials::File);
const MATTE: Source = ("atrium, 1000 lights, matte", "atrium", Some(1000), Materials::Lambert);
const HALL: Source = ("hall", "hall", None, Materials::File);
const CORNELL: Source = ("cornell", "cornell", None, Materials::File);
const CITY: Source = ("candela-city", "candela-city", None, Materials::File);

pub const PRICE: &[Source] = &[SPONZA, ATRIUM, HALL, MATTE];
pub const RIGHT: &[Source] = &[CORNELL, HALL, ATRIUM, SPONZA, CITY];
pub const MOTION: &[Source] = &[("atrium", "atrium", None, Materials::File), SPONZA, CORNELL];

impl Bench {
    /// The requested ones of these scenes, of this height in pixels. Those without their file are listed as left out.
    pub fn views(&mut self, sources: &[Source], height: u32) -> Result<Vec<View>, CliError> {
        let is_wanted = |name: &str| self.scenes.is_empty() || self.scenes.iter().any(|words| name.contains(words));
        let mut views = Vec::new();
        for (name, shot, rain, materials) in sources.iter().copied().filter(|source| is_wanted(source.0)) {
            let mut shot: Shot = *SHOTS.iter().find(|known| known.name == shot).expect("a shot of `quality`");
            if let Some(rain) = rain {
                shot = shot.with_rain(rain);
            }
            if let Some(reason) = shot.missing(&self.assets) {
                let what = name.to_owned();
                if !self.left_out.iter().any(|left_out| left_out.what == what) {
                    self.left_out.push(LeftOut { what, reason });
                }
                continue;
            }
            let (scene, camera) = shot.load(&self.assets)?;
            let height = self.size.map_or(if self.is_quick { 36 } else { height }, |size| size.height);
            let shape = if shot.size.width == shot.size.height { (1, 1) } else { (16, 9) };
            let width = match self.size {
                Some(size) if shape != (1, 1) => size.width,
                _ => height * shape.0 / shape.1,
            };
            let look = shot.settings().with_materials(materials);
            views.push(View { name, scene, camera, look, size: Size { width, height } });
        }
        Ok(views)
    }
}
