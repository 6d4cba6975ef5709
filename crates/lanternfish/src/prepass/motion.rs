//! The previous frame, for motion in the prepass.

use glam::{Mat4, UVec2};
use lanternfish_gpu::{Bindings, BufferPart, Feature, Frame, gpu_struct};

use crate::{
    error::RenderError,
    gpu_scene::{GeometryAt, GpuScene},
    texture::{PingPong, kept_layers},
    view::{PerView, View, ViewKey},
};

/// Motion since the previous frame is written or read.
pub(crate) const MOTION: Feature = Feature::new("motion");

/// Format of motion in uv, defined in `motion.wesl`. Its step is at most 1/1024 of the motion, so the error at 16
/// pixels is below 1/64 of a pixel; the smallest step is 2⁻²⁴.
pub(crate) const MOTION_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

gpu_struct! {
    /// A view in this frame and in the previous one, without subpixel jitter.
    pub struct ViewMotion {
        /// This frame.
        clip_from_view: Mat4,
        /// The previous frame.
        previous_clip_from_view: Mat4,
        /// The previous frame.
        previous_view_from_world: Mat4,
    }
}

/// Position, 3 × 32-bit float; normal, octahedral, 2 × 16 bits; all zero where there is no surface.
pub(crate) const PLACES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// The last views of a renderer's frames. The previous frame is the last one recorded with the view, complete or not.
#[derive(Debug, Default)]
pub(crate) struct ShownViews {
    shown: PerView<Shown>,
    keeps_places: bool,
}

#[derive(Debug)]
struct Shown {
    view: View,
    /// [`GpuScene::generation`].
    generation: u64,
    /// [`GpuScene::revision`].
    revision: u64,
    /// The index of the frame in its mean.
    frame_index: u32,
    /// Number of known earlier frames.
    frames: u32,
    /// Number of those since the scene changed.
    since_change: u32,
    /// See [`PreviousFrame::unchanged`].
    unchanged: u32,
    places: Option<PingPong>,
}

/// The previous frame of one view.
#[derive(Debug)]
pub(crate) struct FrameBefore<'s> {
    views: BufferPart,
    geometry: GeometryAt<'s>,
    history: Option<PreviousFrame>,
    places: Option<PingPong>,
    frames: u32,
}

/// Properties of the previous frame of a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreviousFrame {
    /// The index of the frame in its mean.
    pub rested: u32,
    /// True if the view was elsewhere.
    pub has_moved: bool,
    /// Number of frames since the scene changed; 0 if this frame is the first after a change.
    pub since_change: u32,
    /// Number of frames without a change before that change.
    pub unchanged: u32,
    /// True if triangles have moved.
    pub has_other_triangles: bool,
    /// Number of known frames of the view before this frame, at least 1.
    pub frames: u32,
}

/// The motion of a view's surfaces.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Motion of surfaces; undefined where there is none, which `motion_at` of `motion.wesl` handles.
    pub target: wgpu::TextureView,
    /// The previous frame; none if the view is new or shows another scene.
    pub(crate) before: Option<PreviousFrame>,
    /// Position and normal of the surface at each pixel, if anything is accumulated. Every pass that accumulates writes
    /// those of this frame.
    pub(crate) places: Option<PingPong>,
    views: BufferPart,
}

impl ShownViews {
    /// `keeps_places`: whether anything is accumulated along surfaces.
    pub fn new(keeps_places: bool) -> Self {
        Self { keeps_places, ..Self::default() }
    }

    /// Resets all views: the next frame has no predecessor.
    pub fn forget(&mut self) {
        self.shown.clear();
    }

    /// Returns the previous frame of a view and stores the current one. Without history the view is its own
    /// predecessor: a new view, another scene, or a scene that several renderers changed more than once between frames.
    pub fn follow<'s>(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &'s GpuScene,
        view: &View,
        key: ViewKey,
    ) -> Result<FrameBefore<'s>, RenderError> {
        let frame_index = view.frame_index;
        let view = view.centered();
        let (generation, revision) = (scene.generation(), scene.revision());
        scene.note_shown();
        let mut before = self.shown.take(frame, key);
        let places = before.as_mut().and_then(|before| before.places.take());
        let places = self.keeps_places.then(|| next_places(frame, places, view.size)).transpose()?;
        let history = before.and_then(|before| Some((scene.geometry_at(before.generation)?, before)));
        let (previous, geometry, before, frames) = match history {
            None => (view, scene.geometry_now(), None, 0),
            Some((geometry, shown)) => {
                let has_changed = shown.revision != revision || shown.generation != generation;
                let (since_change, unchanged) = match has_changed {
                    true => (0, shown.since_change),
                    false => (shown.since_change.saturating_add(1), shown.unchanged),
                };
                let has_other_triangles = shown.generation != generation;
                // A mean continues if the view is identical to the last bit.
                let has_moved = frame_index == 0 && !is_where(&view, &shown.view);
                let frames = shown.frames.saturating_add(1);
                let rested = shown.frame_index;
                let before = PreviousFrame { rested, has_moved, since_change, unchanged, has_other_triangles, frames };
                (shown.view, geometry, Some(before), frames)
            }
        };
        let [since_change, unchanged] = before.map_or([u32::MAX; 2], |before| [before.since_change, before.unchanged]);
        let left = places.clone();
        let shown = Shown { view, generation, revision, frame_index, frames, since_change, unchanged, places: left };
        self.shown.leave(frame, key, shown);
        let views = ViewMotion {
            clip_from_view: view.clip_from_view,
            previous_clip_from_view: previous.clip_from_view,
            previous_view_from_world: previous.view_from_world,
        };
        Ok(FrameBefore { views: frame.uniform(&views), geometry, history: before, places, frames })
    }
}

/// The places of the next frame of a view.
fn next_places(frame: &mut Frame<'_>, last: Option<PingPong>, size: UVec2) -> Result<PingPong, RenderError> {
    let label = "history/places";
    let new = |device: &wgpu::Device| kept_layers(device, label, size, PLACES_FORMAT, 1);
    Ok(PingPong::next(last, frame, size, (label, 16 * u64::from(size.x) * u64::from(size.y)), new)?)
}

/// True if a view is where another was, but for the last bits that shifts of frames of a mean leave.
fn is_where(view: &View, other: &View) -> bool {
    let matrices = |view: &View| [view.clip_from_view, view.view_from_world];
    matrices(view).iter().zip(matrices(other)).all(|(now, before)| now.abs_diff_eq(before, 1e-5))
}

impl FrameBefore<'_> {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("view_motion", &self.views).buffer("previous_instances", self.geometry.instances)
    }

    /// True if the scene has changed since then.
    pub fn has_just_changed(&self) -> bool {
        self.history.is_some_and(|before| before.since_change == 0)
    }

    /// True if anything is accumulated over frames.
    pub fn keeps_history(&self) -> bool {
        self.places.is_some()
    }

    /// Number of known earlier frames of the view.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Vertex positions of the previous frame.
    pub fn positions(&self) -> &wgpu::Buffer {
        self.geometry.positions
    }

    /// The motion texture with its previous frame.
    pub fn found(&self, target: wgpu::TextureView) -> Motion {
        Motion { target, before: self.history, places: self.places.clone(), views: self.views.clone() }
    }
}

impl Motion {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("motion_texture", &self.target).part("view_motion", &self.views)
    }
}
