//! Frame requests of a program: views as plain arrays, and the targets of their images.

use glam::{Mat4, UVec2};
use lanternfish_scene::Camera;

use crate::{error::RenderError, view};

/// A view and the target of its image.
#[derive(Clone, Copy, Debug)]
pub struct ViewRequest<'a> {
    /// The key of the view: unique among the views of a frame, the same in every frame.
    pub key: u64,
    /// Clip space from view space, column-major. Reverse-Z: depth is near / distance for perspective (infinite far plane) and (far −
    /// distance) / (far − near) for an orthographic projection. The view looks down −z, +y is up.
    pub clip_from_view: [[f32; 4]; 4],
    /// World space from view space, column-major: a rotation and a translation, m.
    pub world_from_view: [[f32; 4]; 4],
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The source of the lit surfaces.
    pub surface: SurfaceSource<'a>,
    /// The target of the image.
    pub target: Target<'a>,
}

/// The source of a view's lit surfaces.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum SurfaceSource<'a> {
    /// The scene, rasterized by the renderer.
    #[default]
    Own,
    /// A G-buffer of the caller, for [`Target::Demodulated`]. The scene still casts shadows and indirect light onto these surfaces. Textures have
    /// the size of the view, one sample per pixel and the usage `TEXTURE_BINDING`.
    Given {
        /// Depth in the convention of [`ViewRequest::clip_from_view`], 0 where there is no surface. A depth format, viewed with the depth
        /// aspect only.
        depth: &'a wgpu::TextureView,
        /// xyz: world-space normal of any length, on the viewer's side of the surface; (0, 0, 0) where there is no surface. w: perceptual
        /// roughness. A format with signed numbers, such as `Rgba16Float`.
        normal_roughness: &'a wgpu::TextureView,
    },
}

/// The target of a view's image. Textures have the size of the view and the usage `RENDER_ATTACHMENT`.
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub enum Target<'a> {
    /// Stored until the next frame, for [`crate::Renderer::read`].
    #[default]
    Own,
    /// A display image in a texture of any colour format: exposed, tone-mapped and sRGB-encoded (by the texture if its format is sRGB). The
    /// format is that of the texture view. The target always receives the last complete frame of this key, rounded to 8 bits; black before
    /// the first.
    Display(&'a wgpu::TextureView, wgpu::TextureFormat),
    /// Linear Rec. 709, nits; alpha is the coverage of surfaces. An incomplete frame leaves the texture unchanged.
    Radiance(&'a wgpu::TextureView),
    /// Demodulated light for a program that does its own shading: the radiance that a white Lambertian surface would reflect to the viewer,
    /// linear Rec. 709, nits. Multiplied by an albedo it gives diffuse radiance. Emission, highlights, transparent surfaces and the sky are
    /// left to the program. Alpha is 1 where there is a surface. Needs one sample per pixel, `accumulate 1` and no debug view. An
    /// incomplete frame leaves the textures unchanged.
    Demodulated {
        /// Shadowed direct light of the listed lights.
        direct: &'a wgpu::TextureView,
        /// Light from other surfaces and from the environment, as estimated by [`crate::indirect::Indirect`] and
        /// [`crate::occlusion::Occlusion`].
        indirect: &'a wgpu::TextureView,
    },
}

impl<'a> ViewRequest<'a> {
    /// A view of the scene through a camera, with the target of its image. It equals the view of [`crate::Renderer::render`], except for an
    /// orthographic camera: `render` fits its near and far planes to the scene.
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

    /// Checks the view and its textures against the limits of this device.
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
            Target::Demodulated { direct, indirect } => {
                self.check_target(direct, direct.texture().format(), features)?;
                self.check_target(indirect, indirect.texture().format(), features)
            }
        }
    }

    fn check_surface(&self, features: wgpu::Features) -> Result<(), RenderError> {
        let SurfaceSource::Given { depth, normal_roughness } = self.surface else { return Ok(()) };
        if !matches!(self.target, Target::Demodulated { .. }) {
            let what = "a G-buffer of the caller needs the target `Target::Demodulated`".to_owned();
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
                () if !is_right => format!("{:?} is not an allowed format", texture.format()),
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

    /// Describes the size mismatch of a texture and the view, if there is one.
    fn misfit(&self, view: &wgpu::TextureView) -> Option<String> {
        let texture = view.texture();
        let ([width, height], size) = (self.size, UVec2::new(texture.width(), texture.height()));
        // A texture view does not expose its mip level, so the size of a texture with several levels is not checked.
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
            () if !is_color || !can_be => Some(format!("{format:?} is not a renderable colour format")),
            () if !texture.usage().contains(drawn_to) => {
                Some("its texture lacks the usage RENDER_ATTACHMENT".to_owned())
            }
            () => self.misfit(to),
        };
        fault.map_or(Ok(()), |what| Err(RenderError::Target { key: self.key, what }))
    }

    /// `clip_from_view` and `world_from_view`.
    pub(crate) fn matrices(&self) -> [Mat4; 2] {
        [self.clip_from_view, self.world_from_view].map(|columns| Mat4::from_cols_array_2d(&columns))
    }
}
