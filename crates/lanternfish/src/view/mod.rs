//! The view: a camera and an image size, as shaders read them. `view.wesl` defines every space.

pub mod frustum;
mod jitter;
pub(crate) mod matrices;
mod per_view;
pub mod rotations;

use glam::{Affine3A, Mat4, UVec2, Vec2, Vec3, Vec4};
use lanternfish_gpu::{Bindings, BufferPart, Frame, SharedStruct, gpu_struct};
use lanternfish_scene::{Bounds, Camera, Projection};

use self::frustum::ViewFrustum;
pub use self::jitter::jitter_of_frame;
pub(crate) use self::{
    jitter::sobol_point,
    per_view::{PerView, ViewKey},
};
use crate::shaders::Shaders;

gpu_struct! {
    /// A view as shaders read it.
    pub struct View {
        /// Reverse-Z: depth 1 at the near plane.
        clip_from_view: Mat4,
        /// World to camera.
        view_from_world: Mat4,
        /// Camera to world.
        world_from_view: Mat4,
        /// Position of the eye, world space, m.
        eye: Vec3,
        /// 1 for an orthographic projection.
        orthographic: u32,
        /// Size of the image, pixels.
        size: UVec2,
        /// A distance beyond the scene from any point in it, m: the length of rays to directional lights.
        far: f32,
        /// Samples per pixel.
        samples: u32,
        /// Radiance of the background, nits.
        sky: Vec3,
        /// Index of this frame in the mean of an image, from 0.
        frame_index: u32,
        /// Index for random numbers, from 0: frames with different indices have different noise.
        random_index: u32,
        /// Index for random numbers of quantities whose history a scene change resets (shadows, ambient visibility).
        /// While the scene changes in every frame, there is no history to average the noise, and the index stays
        /// constant so that the noise does too.
        forgetful_index: u32,
        /// Width of the area over which textures are filtered, pixels.
        texture_width: f32,
        /// Distance between the points to which the rasterizer snaps vertices, pixels.
        vertex_grid: f32,
        /// Nits that are stored as 1.
        light_unit: f32,
        _pad: f32,
        _pad_more: Vec2,
    }
}

/// Variance of a trilinear filter over that of a box of its width: 3 if a mip level has just that width, less if the
/// texture is magnified.
const FILTER_VARIANCE: f32 = 2.5;
/// [`View::texture_width`] of a mean's second frame, whose points are those of the first: both together are as sharp as
/// a box.
const SECOND_WIDTH: f32 = 0.62;

/// [`View::vertex_grid`] of graphics cards. The renderer replaces it by the adapter's.
const USUAL_VERTEX_GRID: f32 = 1.0 / 256.0;

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(&[], &[SharedStruct::of::<View>()]);

impl View {
    /// The view of `camera` of a scene with `bounds` and under `sky` (nits), in an image of `size` pixels.
    pub fn new(camera: &Camera, size: UVec2, sky: Vec3, bounds: &Bounds) -> Self {
        let projection = tightened(camera, bounds);
        let clip_from_view = clip_from_view(&projection, size.x as f32 / size.y as f32);
        Self::of_matrices(clip_from_view, camera.world_from_camera, size, sky, bounds)
    }

    /// The view of a projection that passes [`matrices::check`].
    pub(crate) fn of_matrices(
        clip_from_view: Mat4,
        world_from_camera: Affine3A,
        size: UVec2,
        sky: Vec3,
        bounds: &Bounds,
    ) -> Self {
        let eye = Vec3::from(world_from_camera.translation);
        Self {
            clip_from_view,
            view_from_world: Mat4::from(world_from_camera.inverse()),
            world_from_view: Mat4::from(world_from_camera),
            eye,
            orthographic: u32::from(clip_from_view.w_axis.w == 1.0),
            size,
            far: 2.0 * bounds.size().length() + bounds.center().distance(eye) + 1.0,
            samples: 1,
            sky,
            frame_index: 0,
            random_index: 0,
            forgetful_index: 0,
            texture_width: 1.0,
            vertex_grid: USUAL_VERTEX_GRID,
            light_unit: 1.0,
            _pad: 0.0,
            _pad_more: Vec2::ZERO,
        }
    }

    /// The view of frame `frame_index` of a mean: the image is shifted by [`jitter_of_frame`]. With several samples per
    /// pixel by half of it, since each sample stands for a part of the pixel.
    pub fn of_frame(&self, frame_index: u32) -> Self {
        // The variance of a texture filter and that of the points of the frames so far add up to that of a pixel.
        let spread = self.jitter_extent() * self.jitter_extent() * (1.0 - 1.0 / (frame_index as f32 + 1.0));
        let texture_width = match frame_index {
            0 => 1.0,
            1 => SECOND_WIDTH,
            _ => ((1.0 - spread) / FILTER_VARIANCE).sqrt(),
        };
        let indices = Self { frame_index, random_index: frame_index, forgetful_index: frame_index, ..*self };
        let mut view = Self { texture_width, ..indices };
        view.shift(self.jitter_extent() * jitter_of_frame(frame_index));
        view
    }

    /// The view without subpixel jitter: the view that [`Self::of_frame`] was called on, except for rounding errors of
    /// the shift.
    pub(crate) fn centered(&self) -> Self {
        let mut view = Self { frame_index: 0, random_index: 0, forgetful_index: 0, texture_width: 1.0, ..*self };
        view.shift(-self.jitter_extent() * jitter_of_frame(self.frame_index));
        view
    }

    /// Edge of the square from which points of a pixel are chosen, pixels.
    pub(crate) fn jitter_extent(&self) -> f32 {
        if self.samples > 1 { 0.5 } else { 1.0 }
    }

    /// Shifts the image, pixels, x right and y down.
    pub(crate) fn shift(&mut self, pixels: Vec2) {
        // Pixels to NDC, where y is up. In perspective w = -z, so a shift in NDC is a change of the z column.
        let shift = pixels * Vec2::new(2.0, -2.0) / self.size.as_vec2();
        let (column, sign) = match self.orthographic == 1 {
            true => (&mut self.clip_from_view.w_axis, 1.0),
            false => (&mut self.clip_from_view.z_axis, -1.0),
        };
        *column += (sign * shift).extend(0.0).extend(0.0);
    }

    /// The view's frustum for clustering; near and far are as tight as `bounds` allows.
    pub fn frustum(&self, bounds: &Bounds) -> ViewFrustum {
        let (a, c, o) = (self.clip_from_view.x_axis.x, self.clip_from_view.z_axis, self.clip_from_view.w_axis);
        let b = self.clip_from_view.y_axis.y;
        let parallel = self.orthographic == 1;
        let slope = |ndc: f32, axis: usize, scale: f32| {
            if parallel { (ndc - o[axis]) / scale } else { (ndc + c[axis]) / scale }
        };
        let near = if parallel { (o.z - 1.0) / c.z } else { o.z / (1.0 + c.z) };
        let distances = bounds.corners().map(|corner| -self.view_from_world.transform_point3(corner).z);
        let most = distances.into_iter().fold(f32::NEG_INFINITY, f32::max);
        let least = distances.into_iter().fold(f32::INFINITY, f32::min);
        let near = if bounds.is_empty() { near } else { near.max(least * 0.999) };
        let far = if bounds.is_empty() { f32::NEG_INFINITY } else { most * 1.001 };
        let far = far.max(if parallel { near + 1e-3 } else { near * 1.01 });
        ViewFrustum {
            world_from_view: Affine3A::from_mat4(self.world_from_view),
            slopes: [slope(-1.0, 0, a), slope(1.0, 0, a), slope(-1.0, 1, b), slope(1.0, 1, b)],
            near,
            far,
            parallel,
            size: self.size,
        }
    }

    /// Uploads the view for the current frame, bound as `view`.
    pub fn record(&self, frame: &mut Frame<'_>) -> ViewBuffer {
        ViewBuffer { part: frame.uniform(self) }
    }

    /// Uploads the view to a buffer of its own.
    #[cfg(any(test, feature = "testing"))]
    pub(crate) fn upload(&self, device: &wgpu::Device) -> ViewBuffer {
        ViewBuffer { part: BufferPart::whole(lanternfish_gpu::uniform_buffer_of(device, "view", self)) }
    }
}

/// The uniform buffer of a [`View`].
#[derive(Clone, Debug)]
pub struct ViewBuffer {
    part: BufferPart,
}

impl ViewBuffer {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("view", &self.part)
    }
}

/// The camera's projection; the near and far planes of an orthographic one are fitted to the scene. Its depth is linear
/// between the planes, and a large range would be too coarse for the start points of shadow rays.
pub(crate) fn tightened(camera: &Camera, bounds: &Bounds) -> Projection {
    let Projection::Orthographic { half_height, near, far } = camera.projection else { return camera.projection };
    let camera_from_world = camera.world_from_camera.inverse();
    let distances = bounds.corners().map(|corner| -camera_from_world.transform_point3(corner).z);
    let margin = 1e-3 * bounds.size().length() + 1e-6;
    let nearest = distances.into_iter().fold(f32::INFINITY, f32::min) - margin;
    let farthest = distances.into_iter().fold(f32::NEG_INFINITY, f32::max) + margin;
    if bounds.is_empty() || nearest >= far || farthest <= near {
        return camera.projection;
    }
    Projection::Orthographic { half_height, near: near.max(nearest), far: far.min(farthest) }
}

/// Reverse-Z projection [Elagabani2025, eq. 2.1, corrected]: depth = near / distance, so 1 at the near plane and 0 at
/// infinity; for orthographic views (far − distance) / (far − near).
pub(crate) fn clip_from_view(projection: &Projection, aspect: f32) -> Mat4 {
    match *projection {
        Projection::Perspective { fov_y, near } => {
            let scale = 1.0 / (0.5 * fov_y).tan();
            Mat4::from_cols(
                Vec4::new(scale / aspect, 0.0, 0.0, 0.0),
                Vec4::new(0.0, scale, 0.0, 0.0),
                Vec4::new(0.0, 0.0, 0.0, -1.0),
                Vec4::new(0.0, 0.0, near, 0.0),
            )
        }
        Projection::Frustum { left, right, bottom, top, near } => {
            let (width, height) = (right - left, top - bottom);
            Mat4::from_cols(
                Vec4::new(2.0 / width, 0.0, 0.0, 0.0),
                Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
                Vec4::new((right + left) / width, (top + bottom) / height, 0.0, -1.0),
                Vec4::new(0.0, 0.0, near, 0.0),
            )
        }
        Projection::Orthographic { half_height, near, far } => {
            let span = far - near;
            Mat4::from_cols(
                Vec4::new(1.0 / (half_height * aspect), 0.0, 0.0, 0.0),
                Vec4::new(0.0, 1.0 / half_height, 0.0, 0.0),
                Vec4::new(0.0, 0.0, 1.0 / span, 0.0),
                Vec4::new(0.0, 0.0, far / span, 1.0),
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(projection: Projection, distance: f32) -> f32 {
        let clip = clip_from_view(&projection, 1.5) * Vec4::new(0.0, 0.0, -distance, 1.0);
        clip.z / clip.w
    }

    #[test]
    fn depth_is_one_at_the_near_plane_and_falls_with_distance() {
        let perspective = Projection::Perspective { fov_y: 1.0, near: 0.1 };
        assert_eq!(depth(perspective, 0.1), 1.0);
        assert!((depth(perspective, 10.0) - 0.01).abs() < 1e-7);
        let orthographic = Projection::Orthographic { half_height: 2.0, near: 1.0, far: 5.0 };
        assert!((depth(orthographic, 1.0) - 1.0).abs() < 1e-6 && depth(orthographic, 5.0).abs() < 1e-6);
    }

    #[test]
    fn frames_have_subpixel_jitter() {
        let size = UVec2::new(64, 32);
        for projection in [
            Projection::Perspective { fov_y: 1.0, near: 0.1 },
            Projection::Frustum { left: -0.5, right: 0.7, bottom: -0.2, top: 0.4, near: 0.1 },
            Projection::Orthographic { half_height: 2.0, near: 0.0, far: 20.0 },
        ] {
            let camera = Camera::look_at(Vec3::new(1.0, 2.0, 9.0), Vec3::ZERO, projection);
            let view = View::new(&camera, size, Vec3::ZERO, &Bounds::EMPTY);
            assert_eq!(view.of_frame(0), view);
            let pixel = |view: &View, p: Vec3| {
                let clip = view.clip_from_view * (view.view_from_world * p.extend(1.0));
                (Vec2::new(clip.x, -clip.y) / clip.w * 0.5 + 0.5) * size.as_vec2()
            };
            for (frame, p) in [(1, Vec3::ZERO), (2, Vec3::new(0.5, -1.0, 3.0)), (77, Vec3::new(-3.0, 2.0, -40.0))] {
                let moved = view.of_frame(frame);
                let actual = pixel(&moved, p) - pixel(&view, p);
                assert!(
                    (actual - jitter_of_frame(frame)).abs().max_element() < 1e-4,
                    "{projection:?} {frame}: {actual}"
                );
                assert_eq!(moved.frame_index, frame);
            }
        }
    }

    #[test]
    fn the_top_of_the_view_is_at_half_the_field_of_view() {
        let fov_y = 1.2f32;
        let p = Vec4::new(0.0, (0.5 * fov_y).tan() * 7.0, -7.0, 1.0);
        let clip = clip_from_view(&Projection::Perspective { fov_y, near: 0.1 }, 2.0) * p;
        assert!((clip.y / clip.w - 1.0).abs() < 1e-6);
    }
}
