//! A tree over emitters with a position, for sampling one of them by its importance for a surface `[Conty2018]`.
//!
//! 1. Build: split the emitters at the median along the longest side of the box of their centres, down to single emitters. All leaves
//!    are on the last level, whose size is a power of two. The depth is the binary logarithm of that size, even if many emitters
//!    coincide. Equal emitters give equal trees.
//! 2. Sample: descend from the root; at each node select a child in proportion to its importance ([`Bound::importance`]).
//! 3. Probability of an emitter: ascend from its leaf and multiply the probabilities of the selections.
//!
//! Node `i` has the children `2 i + 1` and `2 i + 2`, so that no child indices are stored or read.

mod bound;
mod emitter;
#[cfg(test)]
mod tests;

pub use bound::{Bound, Receiver};
pub use emitter::{Cone, Emitter};

use crate::Bounds;

/// A node of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Bound of the emitters below the node, or of the leaf's emitter.
    pub bound: Bound,
    /// Index of a leaf's emitter; 0 in other nodes.
    pub link: u32,
}

/// A sampling tree over emitters. Their indices are those of the list given to [`LightTree::new`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    nodes: Vec<Node>,
    leaves: Vec<u32>,
    depth: u32,
}

impl LightTree {
    /// Builds the tree over at most 2³⁰ emitters. Each must have a positive power and finite bounds; this is not checked.
    pub fn new(emitters: &[Emitter]) -> Self {
        if emitters.is_empty() {
            return Self::default();
        }
        let last_level = emitters.len().next_power_of_two();
        let nodes = vec![Node { bound: Bound::NONE, link: 0 }; 2 * last_level - 1];
        let mut tree = Self { nodes, leaves: vec![0; emitters.len()], depth: last_level.ilog2() };
        let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
        tree.build(emitters, &mut order, 0, tree.depth);
        tree
    }

    /// Fills a node and the `levels` below it; returns the joined emitter.
    fn build(&mut self, emitters: &[Emitter], order: &mut [u32], index: usize, levels: u32) -> Emitter {
        let joined = match *order {
            [emitter] if levels == 0 => {
                self.nodes[index].link = emitter;
                self.leaves[emitter as usize] = index as u32;
                emitters[emitter as usize]
            }
            [_] => self.build(emitters, order, 2 * index + 1, levels - 1),
            _ => {
                let (first, second) = halves(emitters, order);
                let first = self.build(emitters, first, 2 * index + 1, levels - 1);
                first.joined(&self.build(emitters, second, 2 * index + 2, levels - 1))
            }
        };
        self.nodes[index].bound = Bound::new(&joined);
        joined
    }

    /// The nodes, level by level from the root; empty without emitters.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Index in [`Self::nodes`] of each emitter's leaf, by the emitter's index.
    pub fn leaves(&self) -> &[u32] {
        &self.leaves
    }

    /// Number of levels below the root.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// True if there are no emitters.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Probability of the first child of an inner node; `None` if the importance of both is zero.
    fn first_chance(&self, index: usize, receiver: &Receiver) -> Option<f64> {
        let importance = |i: usize| f64::from(self.nodes[i].bound.importance(receiver));
        let (first, second) = (importance(2 * index + 1), importance(2 * index + 2));
        let sum = first + second;
        (sum > 0.0).then(|| first / sum)
    }

    /// Samples an emitter by the random number `u`, 0..1; returns its index and probability. `None`: no light arrives, or the descent
    /// ended at a node of zero importance. A single emitter is always selected.
    pub fn choose(&self, receiver: &Receiver, mut u: f64) -> Option<(u32, f64)> {
        let (mut index, mut chance) = (0, 1.0);
        self.nodes.first()?;
        for _ in 0..self.depth {
            let first = self.first_chance(index, receiver)?;
            index = 2 * index + 1;
            if u < first {
                u /= first;
                chance *= first;
            } else {
                u = (u - first) / (1.0 - first);
                chance *= 1.0 - first;
                index += 1;
            }
        }
        Some((self.nodes[index].link, chance))
    }

    /// The probability with which [`LightTree::choose`] selects `emitter`.
    pub fn chance(&self, receiver: &Receiver, emitter: u32) -> f64 {
        let (mut index, mut chance) = (self.leaves[emitter as usize] as usize, 1.0);
        while index != 0 {
            let parent = (index - 1) / 2;
            let Some(first) = self.first_chance(parent, receiver) else { return 0.0 };
            chance *= if index % 2 == 1 { first } else { 1.0 - first };
            index = parent;
        }
        chance
    }
}

/// Splits two or more emitters into the lower and the upper half along the longest side of the box of their centres.
fn halves<'a>(emitters: &[Emitter], order: &'a mut [u32]) -> (&'a mut [u32], &'a mut [u32]) {
    let center = |e: u32| emitters[e as usize].bounds.center();
    let mut centers = Bounds::EMPTY;
    order.iter().for_each(|e| centers.add_point(center(*e)));
    let axis = centers.size().max_position();
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |a, b| center(*a)[axis].total_cmp(&center(*b)[axis]).then(a.cmp(b)));
    order.split_at_mut(middle)
}
