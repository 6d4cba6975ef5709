//! Deep images of some sets of directions, one after the other from frame to frame: a history knows them all.

use glam::{Quat, Vec3};

use super::cells::CellRadiances;
use crate::{
    context::ViewContext,
    deep_images::{
        KeptDeepImages,
        directions::{Directions, rotation_of_turn},
    },
    error::RenderError,
    settings::DeepImageSettings,
};

/// Sets while the view moves and there is a history. More: nearer to all directions, and as many times the memory of images.
pub(super) const MOST: u32 = 4;

/// Images whose directions are turned as those of no other set.
#[derive(Debug)]
pub(super) struct Set {
    pub images: KeptDeepImages,
    pub cells: CellRadiances,
}

/// The sets so far: each is made for the first frame that asks for it.
#[derive(Debug)]
pub(super) struct Sets {
    /// As they are without any rotation.
    directions: Directions,
    settings: DeepImageSettings,
    sets: Vec<Set>,
    most: u32,
}

impl Set {
    fn new(device: &wgpu::Device, settings: DeepImageSettings) -> Result<Self, RenderError> {
        Ok(Self { images: KeptDeepImages::new(device, settings)?, cells: CellRadiances::default() })
    }
}

impl Sets {
    /// Compiles the passes of the first set, of `most`.
    pub fn new(device: &wgpu::Device, settings: DeepImageSettings, most: u32) -> Result<Self, RenderError> {
        let directions = Directions::new(settings.directions)
            .map_err(|error| RenderError::Directions { what: error.to_string() })?;
        Ok(Self { directions, settings, sets: vec![Set::new(device, settings)?], most })
    }

    /// The first set, which every frame by itself asks for.
    pub fn first(&self) -> &Set {
        &self.sets[0]
    }

    /// Forgets all images.
    pub fn forget(&mut self) {
        self.sets.truncate(1);
        self.sets[0].images.forget();
        self.sets[0].cells.forget();
    }

    /// The set that a frame asks for, and how it is turned: as the frame says, another way for each set, and, where there is a sun, a little more,
    /// so that one of its directions is towards it.
    pub fn get(
        &mut self,
        device: &wgpu::Device,
        ViewContext { scene, view, rotation, .. }: &ViewContext<'_>,
    ) -> Result<(&mut Set, Quat), RenderError> {
        // Frames of a mean turn all images.
        let turn = if view.frame_index == 0 { view.forgetful_index % self.most } else { 0 };
        let turned = if turn == 0 { *rotation } else { *rotation * rotation_of_turn(turn) };
        let turned = match scene.environment_light().sun {
            Some(sun) => turned_towards(&self.directions.rotated(turned), sun),
            None => turned,
        };
        while self.sets.len() <= turn as usize {
            self.sets.push(Set::new(device, self.settings)?);
        }
        Ok((&mut self.sets[turn as usize], turned))
    }
}

/// The rotation of the set turned on, so that its nearest axis is along `direction` (unit, world space).
fn turned_towards(directions: &Directions, direction: Vec3) -> Quat {
    let (image, reversed) = directions.nearest(direction);
    let axis = directions.axes()[image as usize];
    let nearest = if reversed { -axis } else { axis };
    (Quat::from_rotation_arc(nearest, direction) * directions.rotation()).normalize()
}
