//! What a program of its own asks of a frame: views as plain arrays, and where their images go.

use glam::{Mat4, UVec2};
use lanternfish_scene::Camera;

use crate::{error::RenderError, view};

/// A view, and where its image goes.
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
    /// Which surfaces are lit.
    pub surface: SurfaceSource<'a>,
    /// Where the image goes.
    pub target: Target<'a>,
}

/// Which surfaces of a view are lit.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum SurfaceSource<'a> {
    /// Those of the scene: it is drawn.
    #[default]
    Own,
    /// Those that the caller has drawn, for [`Target::Sums`]. What they shadow, and what reflects light onto them, is the scene. Textures
    /// are of the size of the view, with one sample a pixel and the usage `TEXTURE_BINDING`.
    Given {
        /// Depth as [`ViewRequest::clip_from_view`] has it, 0 where nothing is; of a format that has depth, and of its depth alone.
        depth: &'a wgpu::TextureView,
        /// xyz: normal, world space, of any length, on the viewer's side of the surface; 0, 0, 0: nothing is there. w: perceptual
        /// roughness. Of a format that has numbers below 0, such as `Rgba16Float`.
        normal_roughness: &'a wgpu::TextureView,
    },
}

/// Where the image of a view goes. Textures are of the size of the view, and may be drawn to (`RENDER_ATTACHMENT`).
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum Target<'a> {
    /// It is kept until the next frame, for [`crate::Renderer::read`].
    #[default]
    Own,
    /// As a display shows it, into a texture of any format of colours: the image is exposed, tone-mapped and sRGB-encoded, by the
    /// texture where its format is such. The format is that of the view of the texture. What is written is always the last frame of this
    /// key that was whole, rounded to 8 bits; black before the first.
    Display(&'a wgpu::TextureView, wgpu::TextureFormat),
    /// Linear Rec. 709, nits; alpha is the share that surfaces cover. The texture stays as it is where the frame is not whole.
    Radiance(&'a wgpu::TextureView),
    /// For a program that shades by itself: what a white surface that scatters evenly would send to the viewer, linear Rec. 709, nits.
    /// Times an albedo it is the diffuse light of any; emission, highlights, blended surfaces and the sky are the program's. Alpha is 1
    /// where a surface is. It needs one sample a pixel, `accumulate 1` and no debug view. The textures stay as they are where the frame is
    /// not whole.
    Sums {
        /// Of light straight from the listed lights, shadowed.
        direct: &'a wgpu::TextureView,
        /// Of light from other surfaces and from the environment, as far as [`crate::indirect::Indirect`] and
        /// [`crate::occlusion::Occlusion`] find it.
        indirect: &'a wgpu::TextureView,
    },
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
            surface: SurfaceSource::Own,
            target,
        }
    }

    /// An error unless there is such a view, on this device, and its textures fit it.
    pub(crate) fn check(&self, device: &wgpu::Device) -> Result<(), RenderError> {
        let (limit, features) = (device.limits().max_texture_dimension_2d, device.features());
        let [width, height] = self.size;
        if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
            return Err(RenderError::Size { width, height, limit });
        }
        let [clip_from_view, world_from_view] = self.matrices();
        view::matrices::check(clip_from_view, world_from_view).map_err(|what| RenderError::Camera { what })?;
        self.check_surface(features)?;
        match self.target {
            Target::Own => Ok(()),
            Target::Display(to, format) => self.check_target(to, format, features),
            Target::Radiance(to) => self.check_target(to, to.texture().format(), features),
            Target::Sums { direct, indirect } => {
                self.check_target(direct, direct.texture().format(), features)?;
                self.check_target(indirect, indirect.texture().format(), features)
            }
        }
    }

    fn check_surface(&self, features: wgpu::Features) -> Result<(), RenderError> {
        let SurfaceSource::Given { depth, normal_roughness } = self.surface else { return Ok(()) };
        if !matches!(self.target, Target::Sums { .. }) {
            let what = "surfaces of the caller's are lit as sums alone: `Target::Sums`".to_owned();
            return Err(RenderError::Target { key: self.key, what });
        }
        for (name, view, is_depth) in [("depth", depth, true), ("normal_roughness", normal_roughness, false)] {
            let texture = view.texture();
            let aspect = is_depth.then_some(wgpu::TextureAspect::DepthOnly);
            let kind = texture.format().sample_type(aspect, Some(features));
            let is_right = match kind {
                Some(wgpu::TextureSampleType::Depth) => is_depth,
                Some(wgpu::TextureSampleType::Float { .. }) => !is_depth,
                _ => false,
            };
            let fault = match () {
                () if !is_right => format!("{:?} is not what it may be of", texture.format()),
                () if !texture.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING) => {
                    "its texture lacks the usage TEXTURE_BINDING".to_owned()
                }
                () => match self.misfit(view) {
                    Some(what) => what,
                    None => continue,
                },
            };
            return Err(RenderError::Target { key: self.key, what: format!("{name}: {fault}") });
        }
        Ok(())
    }

    /// What keeps a texture from having the view's pixels, if anything.
    fn misfit(&self, view: &wgpu::TextureView) -> Option<String> {
        let texture = view.texture();
        let ([width, height], size) = (self.size, UVec2::new(texture.width(), texture.height()));
        // Of a level of a larger texture the view does not say which it is.
        let fits = texture.mip_level_count() > 1 || size == UVec2::new(width, height);
        if texture.sample_count() != 1 {
            return Some("it has several samples a pixel".to_owned());
        }
        (!fits).then(|| format!("it has {} x {} pixels, the view {width} x {height}", size.x, size.y))
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
        let fault = match () {
            () if !is_color || !can_be => Some(format!("{format:?} is no format of colours that can be drawn to")),
            () if !texture.usage().contains(drawn_to) => {
                Some("its texture lacks the usage RENDER_ATTACHMENT".to_owned())
            }
            () => self.misfit(to),
        };
        fault.map_or(Ok(()), |what| Err(RenderError::Target { key: self.key, what }))
    }

    /// `clip_from_view`, `world_from_view`.
    pub(crate) fn matrices(&self) -> [Mat4; 2] {
        [self.clip_from_view, self.world_from_view].map(|columns| Mat4::from_cols_array_2d(&columns))
    }
}
