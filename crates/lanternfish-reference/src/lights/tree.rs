//! A tree over emitters with a place: the chance of each follows what it may send to a point [Conty2018].
//!
//! 1. Build: halve the emitters at the middle of the longest side of the box of their centres.
//! 2. Choose: walk down, at each node to either child by its importance: a bound of what it may send.

use glam::Vec3A;
use lanternfish_scene::{Bounds, Light};
use obvhs::triangle::Triangle;

/// What the tree knows of an emitter, or of all below a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounded {
    bounds: Bounds,
    /// Radiant intensity, or radiance times area, of the brightest channel.
    power: f32,
    /// Nothing arrives farther from the box than this, m.
    range: f32,
}

impl Bounded {
    /// `radius`: of the light itself, which may be seen where its centre is not.
    pub fn of_light(light: &Light, range: f32, radius: f32) -> Self {
        let bounds = Bounds { min: light.position - radius, max: light.position + radius };
        Self { bounds, power: light.intensity.max_element(), range }
    }

    /// `power`: radiance times area.
    pub fn of_triangle(triangle: &Triangle, power: f32) -> Self {
        let mut bounds = Bounds::EMPTY;
        [triangle.v0, triangle.v1, triangle.v2].into_iter().for_each(|v| bounds.add_point(v.into()));
        Self { bounds, power, range: f32::INFINITY }
    }

    fn joined(&self, other: &Self) -> Self {
        let mut bounds = self.bounds;
        bounds.add_bounds(&other.bounds);
        Self { bounds, power: self.power + other.power, range: self.range.max(other.range) }
    }

    /// What may arrive at `p` on a surface with normal `n`, up to a factor. Zero only where nothing does.
    fn importance(&self, p: Vec3A, n: Vec3A) -> f32 {
        let (min, max) = (Vec3A::from(self.bounds.min), Vec3A::from(self.bounds.max));
        let nearest = p.clamp(min, max);
        if p.distance_squared(nearest) >= self.range * self.range {
            return 0.0;
        }
        // Smallest angle between the normal and anything in the sphere around the box.
        let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
        let towards = center - p;
        let (squared, radius_squared) = (towards.length_squared(), half.length_squared());
        let mut cosine = 1.0;
        if squared > radius_squared && squared > 0.0 {
            let to_center = (n.dot(towards) / squared.sqrt()).clamp(-1.0, 1.0);
            let sin_spread = (radius_squared / squared).min(1.0).sqrt();
            let cos_spread = (1.0 - sin_spread * sin_spread).max(0.0).sqrt();
            if to_center < cos_spread {
                let sin_center = (1.0 - to_center * to_center).max(0.0).sqrt();
                cosine = to_center * cos_spread + sin_center * sin_spread;
            }
        }
        // Transmitting surfaces get light from behind, and rounding must not lose what grazes.
        let facing = cosine.max(0.02);
        self.power * facing / squared.max(radius_squared).max(1e-12)
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    emitters: Bounded,
    /// Inner: index of the second child, the first being next; leaf: the emitter.
    link: u32,
    leaf: bool,
}

#[derive(Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// For each emitter, which way its leaf lies: bit i is the turn at depth i.
    ways: Vec<u64>,
}

impl Tree {
    pub fn new(emitters: Vec<Bounded>) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * emitters.len()), ways: vec![0; emitters.len()] };
        let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
        if !order.is_empty() {
            tree.build(&emitters, &mut order, 0, 0);
        }
        tree
    }

    /// Halving keeps the depth at the logarithm of the count: a way always fits its 64 bits.
    fn build(&mut self, emitters: &[Bounded], order: &mut [u32], depth: u32, way: u64) -> Bounded {
        let index = self.nodes.len();
        if let [emitter] = *order {
            let own = emitters[emitter as usize];
            self.nodes.push(Node { emitters: own, link: emitter, leaf: true });
            self.ways[emitter as usize] = way;
            return own;
        }
        let mut centers = Bounds::EMPTY;
        order.iter().for_each(|e| centers.add_point(emitters[*e as usize].bounds.center()));
        let axis = centers.size().max_position();
        let key = |e: &u32| emitters[*e as usize].bounds.center()[axis];
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let (first, second) = order.split_at_mut(middle);
        self.nodes.push(Node { emitters: emitters[first[0] as usize], link: 0, leaf: false });
        let a = self.build(emitters, first, depth + 1, way);
        self.nodes[index].link = self.nodes.len() as u32;
        let b = self.build(emitters, second, depth + 1, way | 1 << depth);
        self.nodes[index].emitters = a.joined(&b);
        self.nodes[index].emitters
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Chance of the first child of node `index`; `None` where neither matters.
    fn first_chance(&self, index: usize, p: Vec3A, n: Vec3A) -> Option<f64> {
        let importance = |i: usize| f64::from(self.nodes[i].emitters.importance(p, n));
        let (first, second) = (importance(index + 1), importance(self.nodes[index].link as usize));
        let sum = first + second;
        (sum > 0.0).then(|| first / sum)
    }

    /// An emitter and its chance; `u` in 0..1.
    pub fn choose(&self, p: Vec3A, n: Vec3A, mut u: f64) -> Option<(u32, f64)> {
        let (mut index, mut chance) = (0, 1.0);
        if self.nodes.first()?.emitters.importance(p, n) == 0.0 {
            return None;
        }
        while !self.nodes[index].leaf {
            let first = self.first_chance(index, p, n)?;
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

    /// The chance that [`Tree::choose`] gives `emitter`.
    pub fn chance(&self, p: Vec3A, n: Vec3A, emitter: u32) -> f64 {
        let (mut index, mut chance, mut way) = (0, 1.0, self.ways[emitter as usize]);
        while !self.nodes[index].leaf {
            let Some(first) = self.first_chance(index, p, n) else { return 0.0 };
            let second = way & 1 == 1;
            chance *= if second { 1.0 - first } else { first };
            index = if second { self.nodes[index].link as usize } else { index + 1 };
            way >>= 1;
        }
        chance
    }
}
