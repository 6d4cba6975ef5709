//! Colour scales of debug views.

use super::{DOUBLINGS, FASTEST, HOTTEST};
use crate::settings::DebugView;

/// Maps the colours of a debug view to values, and back. Positions on the scale run from 0 at the first colour to 1 at
/// the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The quantity and its unit.
    pub what: &'static str,
    law: Law,
    colors: Colors,
}

/// Maps positions to values.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    /// 0 at 0, the given value at 1.
    Linear(f32),
    /// 2 to the power of this number times the position, minus 1.
    Doublings(f32),
    /// Metres; see `debug.wesl`.
    Distance,
}

/// Maps positions to colours.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Colors {
    /// `heat` of `common/color.wesl`.
    Heat,
    /// A grey level proportional to the position, as a byte.
    Gray,
    /// Linear light proportional to the position, sRGB-encoded.
    Light,
    /// A red level proportional to the position; other directions than right have other hues.
    Hue,
}

impl Scale {
    /// The scale of a view; none if its colours are not a one-dimensional scale.
    pub fn of(view: DebugView) -> Option<Self> {
        let (what, law, colors) = match view {
            DebugView::Depth => ("m from the camera plane", Law::Distance, Colors::Gray),
            DebugView::Roughness => ("perceptual roughness", Law::Linear(1.0), Colors::Gray),
            DebugView::LightCount => ("listed lights", Law::Linear(HOTTEST), Colors::Heat),
            DebugView::RayCount => ("shadow rays", Law::Linear(HOTTEST), Colors::Heat),
            DebugView::LightsPerPixel => ("lights in reach", Law::Doublings(DOUBLINGS), Colors::Heat),
            DebugView::ClusterLights => ("lights of the cluster", Law::Doublings(DOUBLINGS), Colors::Heat),
            DebugView::ClusterFragments => ("fragments of the cluster", Law::Doublings(DOUBLINGS), Colors::Heat),
            DebugView::Visibility => ("fraction of listed lights", Law::Linear(1.0), Colors::Gray),
            DebugView::Motion => ("pixels to the right", Law::Linear(FASTEST), Colors::Hue),
            DebugView::Occlusion => ("ambient visibility", Law::Linear(1.0), Colors::Light),
            DebugView::Normal
            | DebugView::GeometricNormal
            | DebugView::BaseColor
            | DebugView::ClusterIndex
            | DebugView::Indirect
            | DebugView::Nan => return None,
        };
        Some(Self { what, law, colors })
    }

    /// True if equal steps are equal factors and not equal differences.
    pub fn is_logarithmic(&self) -> bool {
        !matches!(self.law, Law::Linear(_))
    }

    /// The value at a position.
    pub fn value(&self, position: f32) -> f32 {
        match self.law {
            Law::Linear(highest) => position * highest,
            Law::Doublings(doublings) => (position * doublings).exp2() - 1.0,
            Law::Distance => (6.0 - 10.0 * position).exp2(),
        }
    }

    /// The position of a value.
    pub fn place(&self, value: f32) -> f32 {
        match self.law {
            Law::Linear(highest) => value / highest,
            Law::Doublings(doublings) => (1.0 + value).log2() / doublings,
            Law::Distance => 0.6 - 0.1 * value.log2(),
        }
    }

    /// The sRGB display colour at a position, which is clamped to the scale.
    pub fn color(&self, position: f32) -> [u8; 3] {
        let position = position.clamp(0.0, 1.0);
        let byte = |value: f32| (255.0 * value).round() as u8;
        match self.colors {
            Colors::Heat => heat(position).map(byte),
            Colors::Gray => [byte(position); 3],
            Colors::Hue => [byte(position), 0, 0],
            Colors::Light if position <= 0.003_130_8 => [byte(12.92 * position); 3],
            Colors::Light => [byte(1.055 * position.powf(1.0 / 2.4) - 0.055); 3],
        }
    }
}

impl std::fmt::Display for Scale {
    /// One line: `shadow rays, linear: 0 is black, 10 and more red`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let law = if self.is_logarithmic() { "logarithmic" } else { "linear" };
        let last = match self.colors {
            Colors::Heat => "red",
            Colors::Gray | Colors::Light => "white",
            Colors::Hue => "red (down is lime, left cyan, up violet)",
        };
        let [low, high] = [0.0, 1.0].map(|position| self.value(position));
        match self.law {
            Law::Linear(1.0) => write!(f, "{}, {law}: 0 is black, 1 {last}", self.what),
            Law::Distance => write!(f, "{}, {law}: {low} and more is black, {high} and less {last}", self.what),
            Law::Linear(_) | Law::Doublings(_) => {
                write!(f, "{}, {law}: {low} is black, {high} and more {last}", self.what)
            }
        }
    }
}

/// CPU reference of `heat` in `common/color.wesl`.
fn heat(position: f32) -> [f32; 3] {
    const RAMP: [[f32; 3]; 6] =
        [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
    let x = 5.0 * position;
    let i = (x as usize).min(4);
    [0, 1, 2].map(|c| RAMP[i][c] + (RAMP[i + 1][c] - RAMP[i][c]) * (x - i as f32))
}
