//! Square views from lights, whose texels are rays that carry their flux: for techniques that trace light from its source.
//!
//! Lights and emissive triangles share the texels by flux. A point light has the six faces of a cube, a wide spot five of them, others one
//! view. A view that would get less than a texel gets one with a probability, and a weight of its inverse: the mean over frames is
//! unbiased.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};
use lanternfish::{
    gpu_scene::GpuScene,
    lights::{Light, tree::EmissiveTriangle},
    shaders::Shaders,
};
use lanternfish_gpu::{Bindings, BufferPart, Frame, GpuError, SharedStruct, gpu_struct};
use lanternfish_scene::Bounds;

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::of(&crate::shaders::SHADERS, &[], &[SharedStruct::of::<LightView>(), SharedStruct::of::<LightViewSet>()]);

gpu_struct! {
    /// The uniform parameters of the views.
    pub struct LightViewSet {
        /// Number of views.
        count: u32,
        /// Index of the frame among those averaged into one image.
        frame_index: u32,
        /// Radius of a sphere around the scene's centre that holds all geometry, m.
        scene_radius: f32,
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// A square view from a light.
    pub struct LightView {
        /// Axis across, world space: half the view's width at distance 1, or in metres for parallel rays.
        right: Vec3,
        /// Index of the light; or of the triangle, in the order of the BVH's leaves.
        light: u32,
        /// The other axis across.
        up: Vec3,
        /// Index of its first texel.
        first: u32,
        /// Direction of view, unit.
        forward: Vec3,
        /// Texels along an edge.
        side: u32,
        /// Start of the rays, or the middle of the square in which they start; world space, m.
        origin: Vec3,
        /// Inverse of the probability that the view is selected.
        weight: f32,
        /// Distance of the near plane if the view is rasterized, m.
        near: f32,
        /// Distance of the far plane, m, for parallel rays; otherwise 0.
        far: f32,
        /// [`Source`].
        source: u32,
        /// Unused.
        _pad: u32,
    }
}

/// The start of a view's rays: the constants of `rays.wesl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// At one point.
    Cone,
    /// On a plane, parallel.
    Parallel,
    /// On a disk or rectangle.
    Area,
    /// On an emissive triangle.
    Triangle,
}

/// Number of texels a view may have along an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Squares {
    /// A power of two: blocks of texels are contiguous.
    PowersOfTwo,
    /// Any number: texels are distributed more evenly over lights.
    Any,
}

/// The views of all lights, the largest first.
#[derive(Debug, Default)]
pub(crate) struct LightViews {
    pub views: Vec<LightView>,
    /// Luminous flux of all lights, lm.
    pub flux: f32,
    /// True if views were selected at random; another frame selects others.
    pub is_by_chance: bool,
}

/// The views of the current scene; distributed again if its lights have changed, and in each frame if views are selected at random.
#[derive(Debug, Default)]
pub(crate) struct KeptLightViews {
    /// [`GpuScene::revision`], total texels, and the frame of the mean.
    made_of: Option<(u64, u32, u32)>,
    views: LightViews,
}

impl KeptLightViews {
    /// Updates the views to those of this frame of a mean.
    pub fn renew(&mut self, scene: &GpuScene, texels: u32, squares: Squares, frame_index: u32) {
        let made_of = (scene.revision(), texels, if self.views.is_by_chance { frame_index } else { 0 });
        if self.made_of != Some(made_of) {
            self.views = LightViews::new(
                &scene.lights().on_host,
                scene.emissive_triangles(),
                scene.bounds(),
                texels,
                squares,
                frame_index,
            );
            self.made_of = Some((made_of.0, made_of.1, if self.views.is_by_chance { frame_index } else { 0 }));
        }
    }

    /// The current views.
    pub fn views(&self) -> &LightViews {
        &self.views
    }
}

/// Views on the device.
#[derive(Debug)]
pub(crate) struct LightViewBuffers {
    set: BufferPart,
    views: wgpu::Buffer,
}

impl LightViewBuffers {
    /// Bindings of `rays.wesl`, in addition to the scene's.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("light_view_set", &self.set).buffer("light_views", &self.views)
    }
}

/// Tangent of a spot's outer angle from which on it has several views.
const WIDE_SPOT: f32 = 2.0;

impl LightViews {
    /// Distributes `texels` texels, at least 2. Views that would get less than one are selected at random in every frame. `triangles`: the
    /// emissive ones, by their brightest channel.
    pub fn new(
        lights: &[Light],
        triangles: &[EmissiveTriangle],
        bounds: &Bounds,
        texels: u32,
        squares: Squares,
        frame_index: u32,
    ) -> Self {
        let mut views = Vec::new();
        let mut powers = Vec::new();
        for (index, light) in lights.iter().enumerate() {
            let of_light = views_of(light, index as u32, bounds);
            let power = flux_of(light, bounds) / of_light.len() as f32;
            powers.extend(of_light.iter().map(|_| power));
            views.extend(of_light);
        }
        for EmissiveTriangle { triangle, emitter } in triangles {
            let sides = if emitter.cone.cos_spread < 0.0 { 2.0 } else { 1.0 };
            powers.push(sides * PI * emitter.power);
            views.push(LightView {
                light: *triangle,
                source: Source::Triangle as u32,
                weight: 1.0,
                ..Default::default()
            });
        }
        // A light without flux has no view.
        let mut sends = powers.iter().map(|power| *power > 0.0);
        views.retain(|_| sends.next() == Some(true));
        powers.retain(|power| *power > 0.0);
        let flux: f32 = powers.iter().sum();
        if flux <= 0.0 || !flux.is_finite() {
            return Self::default();
        }
        let mut expected: Vec<f32> = powers.iter().map(|power| texels as f32 * (power / flux)).collect();
        // The capacity holds the selected views for any start of the walk.
        expected
            .iter_mut()
            .filter(|expected| **expected < 1.0)
            .for_each(|expected| *expected *= 1.0 - 1.0 / texels as f32);
        let mut left = texels;
        // A view is selected where the prefix sum of probabilities passes an integer. The start differs in every frame, by the golden
        // ratio.
        let mut chances = (0.5 + 0.618_033_988_749_895 * f64::from(frame_index)).fract();
        let is_by_chance = expected.iter().any(|expected| *expected < 1.0);
        for (view, expected) in views.iter_mut().zip(&expected) {
            if *expected >= 1.0 {
                view.side = match squares {
                    Squares::PowersOfTwo => 1 << (expected.sqrt().log2().floor() as u32),
                    Squares::Any => expected.sqrt() as u32,
                };
            } else {
                let before = chances;
                chances += f64::from(*expected);
                (view.side, view.weight) = (u32::from(chances.floor() > before.floor()), 1.0 / expected);
            }
            view.side *= u32::from(view.side * view.side <= left);
            left -= view.side * view.side;
        }
        // The rest goes to the views with the least of their expected texels.
        let may_double = |i: &usize| expected[*i] >= 1.0 && squares == Squares::PowersOfTwo;
        let mut poorest: Vec<usize> = (0..views.len()).filter(may_double).collect();
        let lack = |views: &[LightView], i: usize| expected[i] / (views[i].side * views[i].side).max(1) as f32;
        poorest.sort_by(|a, b| lack(&views, *b).total_cmp(&lack(&views, *a)).then(a.cmp(b)));
        for i in poorest {
            let more = 3 * views[i].side * views[i].side;
            if more <= left && lack(&views, i) >= 2.0 {
                views[i].side *= 2;
                left -= more;
            }
        }
        views.retain(|view| view.side > 0);
        // The largest first: with powers of two, every block of 4^k texels is aligned.
        views.sort_by_key(|view| std::cmp::Reverse(view.side));
        let mut first = 0;
        for view in &mut views {
            view.first = first;
            first += view.side * view.side;
        }
        Self { views, flux, is_by_chance }
    }

    /// Number of texels all views have.
    pub fn texels(&self) -> u32 {
        self.views.last().map_or(0, |view| view.first + view.side * view.side)
    }

    /// The views on the device, for one frame.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        frame_index: u32,
    ) -> Result<LightViewBuffers, GpuError> {
        let scene_radius = radius_of(scene.bounds());
        let set = LightViewSet { count: self.views.len() as u32, frame_index, scene_radius, _pad: 0 };
        // A binding cannot be empty.
        let none = [LightView::default()];
        let views = if self.views.is_empty() { &none } else { self.views.as_slice() };
        Ok(LightViewBuffers { set: frame.uniform(&set), views: frame.storage_of("indirect/light_views", views)? })
    }
}

/// Near plane of a light's view, as a fraction of the scene's radius.
const NEAR_FRACTION: f32 = 1e-4;

/// Distances of the planes of a light's view: from its origin, and from the start of parallel rays, which have a far plane. `radius`: the
/// scene's, m.
fn planes(is_parallel: bool, radius: f32) -> (f32, f32) {
    if is_parallel { (0.9 * radius, 3.1 * radius) } else { (NEAR_FRACTION * radius, 0.0) }
}

fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Luminous flux, lm: of a directional light, that on a disk as wide as the scene. Ranges are ignored.
fn flux_of(light: &Light, bounds: &Bounds) -> f32 {
    extent_of(light, bounds) * luminance(light.intensity).max(0.0)
}

/// Mean radiance in a closed box around the scene whose walls reflect all light once, nits, in the unit of the device.
pub(crate) fn bounced(scene: &GpuScene) -> Vec3 {
    let [x, y, z] = scene.bounds().size().max(Vec3::splat(1e-6)).to_array();
    let lights = scene.lights().on_host.iter().map(|light| extent_of(light, scene.bounds()) * light.intensity);
    let sent = |EmissiveTriangle { emitter, .. }: &EmissiveTriangle| {
        let sides = if emitter.cone.cos_spread < 0.0 { 2.0 } else { 1.0 };
        Vec3::splat(sides * PI * emitter.power)
    };
    let flux: Vec3 = lights.chain(scene.emissive_triangles().iter().map(sent)).sum();
    flux / (PI * 2.0 * (x * y + y * z + z * x))
}

/// Flux of a light over its intensity, sr.
fn extent_of(light: &Light, bounds: &Bounds) -> f32 {
    match light.kind {
        0 => 4.0 * PI,
        1 => {
            let cos_inner = light.cos_outer + 1.0 / light.inverse_cos_span;
            // The mean of a squared ramp is 1/3.
            2.0 * PI * ((1.0 - cos_inner).max(0.0) + (cos_inner - light.cos_outer) / 3.0)
        }
        2 => PI * radius_of(bounds).powi(2),
        3 => PI * PI * light.radius * light.radius,
        _ => PI * 4.0 * light.radius * light.tan_outer,
    }
}

/// Radius of a sphere that holds the scene, m.
pub(crate) fn radius_of(bounds: &Bounds) -> f32 {
    if bounds.is_empty() { 1.0 } else { (0.5 * bounds.size().length()).max(1e-6) }
}

fn views_of(light: &Light, index: u32, bounds: &Bounds) -> Vec<LightView> {
    let (near, far) = planes(light.kind == 2, radius_of(bounds));
    let view = |axes: Mat3, half_width: f32, origin: Vec3| LightView {
        right: half_width * axes.x_axis,
        light: index,
        up: half_width * axes.y_axis,
        first: 0,
        forward: axes.z_axis,
        side: 0,
        origin,
        weight: 1.0,
        near,
        far,
        source: match light.kind {
            0 | 1 => Source::Cone as u32,
            2 => Source::Parallel as u32,
            _ => Source::Area as u32,
        },
        _pad: 0,
    };
    let along = |forward: Vec3| {
        let right = forward.any_orthonormal_vector();
        Mat3::from_cols(right, forward.cross(right), forward)
    };
    match light.kind {
        0 => faces(Mat3::IDENTITY).map(|axes| view(axes, 1.0, light.position)).to_vec(),
        1 if light.tan_outer > WIDE_SPOT => {
            let faces = faces(along(light.direction));
            // The face behind is omitted.
            faces[..5].iter().map(|axes| view(*axes, 1.0, light.position)).collect()
        }
        1 => vec![view(along(light.direction), light.tan_outer, light.position)],
        2 => vec![view(along(light.direction), radius_of(bounds), bounds.center())],
        _ => vec![view(along(light.direction), 1.0, light.position)],
    }
}

/// The faces of a cube, in the space of these axes; the last looks against the third axis.
fn faces(axes: Mat3) -> [Mat3; 6] {
    let Mat3 { x_axis: x, y_axis: y, z_axis: z } = axes;
    [[x, y, z], [y, z, x], [z, x, y], [z, y, -x], [x, z, -y], [y, x, -z]].map(|[a, b, c]| Mat3::from_cols(a, b, c))
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::Settings;

    use super::*;

    fn light(light: &lanternfish_scene::Light) -> Light {
        Light::new(light, &Settings::default().light_storage())
    }

    fn bounds() -> Bounds {
        let mut bounds = Bounds::EMPTY;
        bounds.add_point(Vec3::ZERO);
        bounds.add_point(Vec3::new(4.0, 2.0, 3.0));
        bounds
    }

    /// Views cover the lit directions of a light, each once.
    #[test]
    fn views_are_squares_that_fit_and_share_by_flux() {
        let bright = light(&lanternfish_scene::Light::point(Vec3::ONE, Vec3::splat(30.0)));
        let dim = light(&lanternfish_scene::Light::point(Vec3::X, Vec3::splat(10.0)));
        let sun = light(&lanternfish_scene::Light::directional(Vec3::NEG_Y, Vec3::splat(1.0)));
        for (lights, texels) in
            [(vec![sun], 4096), (vec![bright, dim], 65536), (vec![dim; 3], 4096), (vec![dim; 5000], 4096)]
        {
            let map = LightViews::new(&lights, &[], &bounds(), texels, Squares::PowersOfTwo, 0);
            let used: u32 = map.views.iter().map(|view| view.side * view.side).sum();
            assert!(used <= texels && used * 2 >= texels, "{used} of {texels}");
            for view in &map.views {
                assert!(view.side.is_power_of_two() && view.first % (view.side * view.side) == 0, "{view:?}");
            }
            // In the mean, the flux of the views is that of the lights.
            let of_view = |view: &LightView| {
                let light = &lights[view.light as usize];
                view.weight * flux_of(light, &bounds()) / if light.kind == 0 { 6.0 } else { 1.0 }
            };
            let counted: f32 = map.views.iter().map(of_view).sum();
            assert!((counted / map.flux - 1.0).abs() < 0.01, "{counted} of {}", map.flux);
        }
        let map = LightViews::new(&[bright, dim], &[], &bounds(), 65536, Squares::PowersOfTwo, 0);
        let texels_of = |light| map.views.iter().filter(|v| v.light == light).map(|v| v.side * v.side).sum::<u32>();
        // Powers of two are coarse.
        assert!(texels_of(0) > texels_of(1), "{} {}", texels_of(0), texels_of(1));
        assert!(LightViews::new(&[], &[], &bounds(), 4096, Squares::Any, 0).views.is_empty());
    }

    /// A view with less than a texel is selected in the expected number of frames.
    #[test]
    fn over_frames_every_light_is_selected_at_its_expected_rate() {
        let dim = light(&lanternfish_scene::Light::point(Vec3::X, Vec3::splat(10.0)));
        let lights = vec![dim; 2000];
        let mut selected = vec![0; lights.len()];
        for frame in 0..100 {
            let map = LightViews::new(&lights, &[], &bounds(), 4096, Squares::PowersOfTwo, frame);
            assert!(map.is_by_chance);
            map.views.iter().for_each(|view| selected[view.light as usize] += 1);
        }
        // 4,096 texels for 12,000 faces: two of a light's six in each frame.
        let (least, most) = (selected.iter().min().unwrap(), selected.iter().max().unwrap());
        assert!((195..=205).contains(least) && (195..=215).contains(most), "{least} to {most} of 204");
    }

    /// The faces of one lamp are equal if sides need not be powers of two; any number of texels is distributed.
    #[test]
    fn faces_of_a_lamp_share_evenly() {
        let lamp = light(&lanternfish_scene::Light::point(Vec3::ONE, Vec3::splat(30.0)));
        let dark = light(&lanternfish_scene::Light::point(Vec3::ONE, Vec3::ZERO));
        for texels in [8, 100, 4096, 5000] {
            let views = LightViews::new(&[lamp, dark], &[], &bounds(), texels, Squares::Any, 0);
            assert!(views.views.iter().all(|view| view.side == views.views[0].side && view.light == 0), "{texels}");
            assert!(views.views.len() == 6 && !views.is_by_chance);
            assert!(views.texels() <= texels && 2 * views.texels() > texels, "{} of {texels}", views.texels());
        }
        let few = LightViews::new(&[lamp], &[], &bounds(), 2, Squares::Any, 0);
        assert!(few.is_by_chance && few.texels() >= 1, "{few:?}");
    }

    /// Every direction lies in one face of a cube; a wide spot's half of them lies in its faces.
    #[test]
    fn faces_of_a_cube_hold_every_direction_once() {
        let holds = |axes: &Mat3, d: Vec3| {
            let p = axes.transpose() * d;
            p.z > 0.0 && p.x.abs() < p.z && p.y.abs() < p.z
        };
        for i in 0..500 {
            let (z, angle) = (2.0 * (i as f32 + 0.5) / 500.0 - 1.0, 2.399_963_1 * i as f32);
            let r = (1.0 - z * z).sqrt();
            let d = Vec3::new(r * angle.cos(), r * angle.sin(), z);
            let faces = faces(Mat3::IDENTITY);
            assert_eq!(faces.iter().filter(|axes| holds(axes, d)).count(), 1, "{d}");
            assert!(!holds(&faces[5], d) || d.z < 0.0, "{d}");
        }
    }
}
