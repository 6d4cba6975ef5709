//! One emitter of many.

use glam::{DVec3, Vec3A};
use lanternfish_scene::light_tree::{Emitter, LightTree, Receiver};

/// How an emitter is chosen at a place. Emitters are numbered: first those that surround the scene, then those with a place.
#[derive(Default)]
pub(super) struct Choice {
    /// Chosen each alike.
    infinite: u32,
    /// Over the others: as likely as one of the infinite ones.
    tree: LightTree,
}

impl Choice {
    /// Each of `count` emitters alike.
    pub fn uniform(count: u32) -> Self {
        Self { infinite: count, tree: LightTree::default() }
    }

    /// The `infinite` first ones each alike, those with a place by a tree.
    pub fn tree(infinite: u32, bounded: &[Emitter]) -> Self {
        Self { infinite, tree: LightTree::new(bounded) }
    }

    /// An emitter for the surface at `p` with normal `n`, and its chance. `None`: nothing arrives there.
    pub fn choose(&self, p: Vec3A, n: DVec3, u: f64) -> Option<(u32, f64)> {
        let fractions = self.fractions();
        let scaled = u * f64::from(fractions);
        let fraction = (scaled as u32).min(fractions.checked_sub(1)?);
        if fraction < self.infinite {
            return Some((fraction, 1.0 / f64::from(fractions)));
        }
        let (emitter, chance) = self.tree.choose(&receiver(p, n), scaled - f64::from(fraction))?;
        Some((self.infinite + emitter, chance / f64::from(fractions)))
    }

    /// The chance that [`Choice::choose`] gives `emitter`.
    pub fn chance(&self, p: Vec3A, n: DVec3, emitter: u32) -> f64 {
        let within = match emitter.checked_sub(self.infinite) {
            None => 1.0,
            Some(bounded) => self.tree.chance(&receiver(p, n), bounded),
        };
        within / f64::from(self.fractions())
    }

    fn fractions(&self) -> u32 {
        self.infinite + u32::from(!self.tree.is_empty())
    }
}

/// Some surfaces transmit, and shading normals lean: light from behind counts.
pub(crate) fn receiver(p: Vec3A, n: DVec3) -> Receiver {
    Receiver { p: p.into(), normal: n.as_vec3(), is_transmitting: true }
}
