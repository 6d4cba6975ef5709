//! What a program of its own asks of a frame: views as plain arrays, and where their pictures go.

use glam::{Mat4, UVec2};
use lanternfish_scene::Camera;

use crate::{error::RenderError, view};

/// A view, and where its picture goes.
#[derive(Clone, Copy, Debug)]
pub struct ViewRequest<'a> {
    /// Which view it is, from frame to frame: a number of the caller's, another for each view of a frame.
    pub key: u64,
    /// View space to clip space, by columns. Reverse-Z: depth is near / distance in perspective (the far plane is at infinity), and
    /// (far − distance) / (far − near) where rays are parallel. The view looks down −z, +y is up.
    pub clip_from_view: [[f32; 4]; 4],
    /// View space to world space, by columns: a rotation and a translation, m.
    pub world_from_view: [[f32; 4]; 4],
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Where the picture goes.
    pub target: Target<'a>,
}

/// Where the picture of a view goes. Textures are of the size of the view, and may be drawn to (`RENDER_ATTACHMENT`).
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum Target<'a> {
    /// It is kept until the next frame, for [`crate::Renderer::read`].
    #[default]
    Own,
    /// As a display shows it, into a texture of any format of colours: the picture is exposed, tone-mapped and sRGB-encoded, by the
    /// texture where its format is such. The format is that of the view of the texture. What is written is always the last frame of this
    /// key that was whole, rounded to 8 bits; black before the first.
    Display(&'a wgpu::TextureView, wgpu::TextureFormat),
    /// Linear Rec. 709, nits; alpha is the share that surfaces cover. The texture stays as it is where the frame is not whole.
    Radiance(&'a wgpu::TextureView),
}

impl<'a> ViewRequest<'a> {
    /// What a camera sees of the scene itself. It is what [`crate::Renderer::render`] sees, but for parallel rays: there, that one draws
    /// the camera's planes in to the scene.
    pub fn of_camera(key: u64, camera: &Camera, size: [u32; 2], target: Target<'a>) -> Self {
        let clip_from_view = view::clip_from_view(&camera.projection, size[0] as f32 / size[1] as f32);
        Self {
            key,
            clip_from_view: clip_from_view.to_cols_array_2d(),
            world_from_view: Mat4::from(camera.world_from_camera).to_cols_array_2d(),
            size,
            target,
        }
    }

    /// An error unless there is such a view, on a device whose textures have so many pixels a side at most, and its target fits it.
    pub(crate) fn check(&self, limit: u32, features: wgpu::Features) -> Result<(), RenderError> {
        let [width, height] = self.size;
        if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
            return Err(RenderError::Size { width, height, limit });
        }
        let [clip_from_view, world_from_view] = self.matrices();
        view::matrices::check(clip_from_view, world_from_view).map_err(|what| RenderError::Camera { what })?;
        match self.target {
            Target::Own => Ok(()),
            Target::Display(to, format) => self.check_target(to, format, features),
            Target::Radiance(to) => self.check_target(to, to.texture().format(), features),
        }
    }

    fn check_target(
        &self,
        to: &wgpu::TextureView,
        format: wgpu::TextureFormat,
        features: wgpu::Features,
    ) -> Result<(), RenderError> {
        let texture = to.texture();
        let drawn_to = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let is_color = matches!(format.sample_type(None, Some(features)), Some(wgpu::TextureSampleType::Float { .. }));
        let can_be = format.guaranteed_format_features(features).allowed_usages.contains(drawn_to);
        // Of a level of a larger texture the view does not say which it is.
        let size = UVec2::new(texture.width(), texture.height());
        let fits = texture.mip_level_count() > 1 || size == UVec2::from(self.size);
        let faults = [
            (!is_color || !can_be, format!("{format:?} is no format of colours that can be drawn to")),
            (!texture.usage().contains(drawn_to), "its texture lacks the usage RENDER_ATTACHMENT".to_owned()),
            (texture.sample_count() != 1, "it has several samples a pixel".to_owned()),
            (!fits, format!("it has {} x {} pixels, the view {} x {}", size.x, size.y, self.size[0], self.size[1])),
        ];
        let fault = faults.into_iter().find(|(is_fault, _)| *is_fault);
        fault.map_or(Ok(()), |(_, what)| Err(RenderError::Target { key: self.key, what }))
    }

    /// `clip_from_view`, `world_from_view`.
    pub(crate) fn matrices(&self) -> [Mat4; 2] {
        [self.clip_from_view, self.world_from_view].map(|columns| Mat4::from_cols_array_2d(&columns))
    }
}
