//! A tree over emitters that have a place, from which one is chosen by what it may send to a surface `[Conty2018]`.
//!
//! 1. Build: halve the emitters at their median along the longest side of the box of their centres. Depth is the logarithm of the
//!    count, whatever lies on one spot; the same emitters give the same tree.
//! 2. Choose: walk down, at each node to either child by its importance, a bound of what it may send ([`Emitter::importance`]).
//! 3. The chance of an emitter: climb from its leaf, and multiply.

mod emitter;
#[cfg(test)]
mod tests;

pub use emitter::{Cone, Emitter, Receiver};

use crate::Bounds;

/// A node of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// What shines below it.
    pub emitters: Emitter,
    /// Of an inner node, the second child's index, the first being next; of a leaf, the emitter's.
    pub link: u32,
    /// Whether it is one emitter.
    pub is_leaf: bool,
    /// Index of the node above; the root's is its own.
    pub parent: u32,
}

/// Emitters, and how one of them is chosen. They are numbered as they were given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    nodes: Vec<Node>,
    leaves: Vec<u32>,
}

impl LightTree {
    /// Over at most 2³¹ emitters, each of a power above 0 and with finite bounds.
    pub fn new(emitters: &[Emitter]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * emitters.len()), leaves: vec![0; emitters.len()] };
        let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
        if !order.is_empty() {
            tree.build(emitters, &mut order, 0);
        }
        tree
    }

    fn build(&mut self, emitters: &[Emitter], order: &mut [u32], parent: u32) -> Emitter {
        let index = self.nodes.len();
        if let [emitter] = *order {
            let own = emitters[emitter as usize];
            self.nodes.push(Node { emitters: own, link: emitter, is_leaf: true, parent });
            self.leaves[emitter as usize] = index as u32;
            return own;
        }
        let center = |e: u32| emitters[e as usize].bounds.center();
        let mut centers = Bounds::EMPTY;
        order.iter().for_each(|e| centers.add_point(center(*e)));
        let axis = centers.size().max_position();
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |a, b| center(*a)[axis].total_cmp(&center(*b)[axis]).then(a.cmp(b)));
        let (first, second) = order.split_at_mut(middle);
        self.nodes.push(Node { emitters: emitters[first[0] as usize], link: 0, is_leaf: false, parent });
        let a = self.build(emitters, first, index as u32);
        self.nodes[index].link = self.nodes.len() as u32;
        let b = self.build(emitters, second, index as u32);
        self.nodes[index].emitters = a.joined(&b);
        self.nodes[index].emitters
    }

    /// From the root on, each inner node followed by its first child.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Of each emitter, the index of its leaf.
    pub fn leaves(&self) -> &[u32] {
        &self.leaves
    }

    /// Whether there are no emitters.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Chance of the first child of an inner node; `None` where neither matters.
    fn first_chance(&self, index: usize, receiver: &Receiver) -> Option<f64> {
        let importance = |i: usize| f64::from(self.nodes[i].emitters.importance(receiver));
        let (first, second) = (importance(index + 1), importance(self.nodes[index].link as usize));
        let sum = first + second;
        (sum > 0.0).then(|| first / sum)
    }

    /// An emitter and its chance; `u` in 0..1. `None`: nothing arrives, or the walk ended where nothing does. A single emitter is always
    /// chosen.
    pub fn choose(&self, receiver: &Receiver, mut u: f64) -> Option<(u32, f64)> {
        let (mut index, mut chance) = (0, 1.0);
        self.nodes.first()?;
        while !self.nodes[index].is_leaf {
            let first = self.first_chance(index, receiver)?;
            if u < first {
                u /= first;
                chance *= first;
                index += 1;
            } else {
                u = (u - first) / (1.0 - first);
                chance *= 1.0 - first;
                index = self.nodes[index].link as usize;
            }
        }
        Some((self.nodes[index].link, chance))
    }

    /// The chance that [`LightTree::choose`] gives `emitter`.
    pub fn chance(&self, receiver: &Receiver, emitter: u32) -> f64 {
        let (mut index, mut chance) = (self.leaves[emitter as usize] as usize, 1.0);
        while index != 0 {
            let parent = self.nodes[index].parent as usize;
            let Some(first) = self.first_chance(parent, receiver) else { return 0.0 };
            chance *= if index == parent + 1 { first } else { 1.0 - first };
            index = parent;
        }
        chance
    }
}
