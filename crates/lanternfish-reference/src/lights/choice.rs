//! Selection of an emitter.

use glam::{DVec3, Vec3A};
use lanternfish_scene::light_tree::{Emitter, LightTree, Receiver};

/// Selection of an emitter for a point. Emitters are numbered: first the infinite ones, then the bounded ones.
#[derive(Default)]
pub(super) struct Choice {
    /// Number of infinite emitters, which have equal probabilities.
    infinite: u32,
    /// Tree over the bounded emitters. Its probability is that of one infinite emitter.
    tree: LightTree,
}

impl Choice {
    /// Uniform selection among `count` emitters.
    pub fn uniform(count: u32) -> Self {
        Self { infinite: count, tree: LightTree::default() }
    }

    /// Uniform selection among the first `infinite` emitters and a tree over the bounded ones.
    pub fn tree(infinite: u32, bounded: &[Emitter]) -> Self {
        Self { infinite, tree: LightTree::new(bounded) }
    }

    /// Selects an emitter for the surface at `p` with normal `n`, and returns it with its probability. `None` if no light arrives there.
    pub fn choose(&self, p: Vec3A, n: DVec3, u: f64) -> Option<(u32, f64)> {
        let slots = self.slots();
        let scaled = u * f64::from(slots);
        let slot = (scaled as u32).min(slots.checked_sub(1)?);
        if slot < self.infinite {
            return Some((slot, 1.0 / f64::from(slots)));
        }
        let (emitter, chance) = self.tree.choose(&receiver(p, n), scaled - f64::from(slot))?;
        Some((self.infinite + emitter, chance / f64::from(slots)))
    }

    /// Probability with which [`Choice::choose`] selects `emitter`.
    pub fn chance(&self, p: Vec3A, n: DVec3, emitter: u32) -> f64 {
        let within = match emitter.checked_sub(self.infinite) {
            None => 1.0,
            Some(bounded) => self.tree.chance(&receiver(p, n), bounded),
        };
        within / f64::from(self.slots())
    }

    /// Number of equally likely alternatives: each infinite emitter, and the tree.
    fn slots(&self) -> u32 {
        self.infinite + u32::from(!self.tree.is_empty())
    }
}

/// A receiver for the light tree. Light from behind counts, because surfaces may transmit and shading normals may differ from the triangle's.
pub(crate) fn receiver(p: Vec3A, n: DVec3) -> Receiver {
    Receiver { p: p.into(), normal: n.as_vec3(), is_transmitting: true }
}
