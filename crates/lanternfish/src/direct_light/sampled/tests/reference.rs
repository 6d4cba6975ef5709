//! Probabilities of candidates by the host, in double precision, from the nodes of the trees on the device.

use glam::{DVec3, Vec3};

/// Numbers of `tile_paths.wesl` and of `candidates.wesl`.
const NEAR_RADII: f64 = 4.0;
const MOST_SUNS: u32 = 4;

/// A surface that receives light.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub p: Vec3,
    pub normal: Vec3,
    pub wo: Vec3,
    pub perceptual_roughness: f32,
}

/// The trees, and the parameters of the draws.
pub struct Trees {
    words: Vec<u32>,
    /// Number of candidates.
    pub draws: u32,
}

/// A sphere with a bound of normals.
#[derive(Clone, Copy)]
struct Around {
    p: DVec3,
    reach: f64,
    n: DVec3,
    spread: f64,
}

impl Around {
    fn surface(surface: &Surface) -> Self {
        Self { p: surface.p.into(), reach: 0.0, n: surface.normal.into(), spread: 0.0 }
    }

    fn tile(surfaces: &[Surface]) -> Self {
        let positions = || surfaces.iter().map(|surface| DVec3::from(surface.p));
        let normals = || surfaces.iter().map(|surface| DVec3::from(surface.normal));
        let low = positions().reduce(DVec3::min).unwrap();
        let high = positions().reduce(DVec3::max).unwrap();
        let (p, n) = (0.5 * (low + high), normals().sum::<DVec3>().normalize());
        let reach = positions().map(|q| q.distance(p)).fold(0.0, f64::max);
        Self { p, reach, n, spread: normals().map(|other| other.distance(n)).fold(0.0, f64::max) }
    }
}

/// One of the two trees: its root, its levels below the root, and what is added to the numbers of its leaves.
#[derive(Clone, Copy)]
struct Tree {
    root: u32,
    depth: u32,
    first_emitter: u32,
}

impl Trees {
    /// From the words that the probe `tree` writes: of the layout, then of the nodes.
    pub fn new(words: Vec<u32>, draws: u32) -> Self {
        Self { words, draws }
    }

    pub fn light_count(&self) -> u32 {
        self.words[7]
    }

    fn word(&self, node: u32, i: usize) -> u32 {
        self.words[8 * (node as usize + 1) + i]
    }

    fn center(&self, node: u32) -> DVec3 {
        let at = |i| f64::from(f32::from_bits(self.word(node, i)));
        DVec3::new(at(0), at(1), at(2))
    }

    /// `importance_around` of `light_tree.wesl`.
    fn importance(&self, node: u32, of: &Around) -> f64 {
        let low = |i| f64::from(f32::from_bits(self.word(node, i) << 16));
        let high = |i| f64::from(f32::from_bits(self.word(node, i) & 0xffff_0000));
        let (power, inverse_range) = (low(3), high(3));
        let half = DVec3::new(low(4), high(4), low(5));
        let cone_spread = high(5);
        let [x, y, z, cos_reach] = self.word(node, 6).to_le_bytes().map(|byte| f64::from(byte as i8) / 127.0);
        let towards = self.center(node) - of.p;
        let radius = half.length() + of.reach;
        let squared = towards.length_squared().max(radius * radius).max(1e-12);
        let distance = squared.sqrt();
        let away = (towards.abs() - half - of.reach).max(DVec3::ZERO) * inverse_range;
        let along = away.length_squared();
        let sine = radius / distance;
        let facing = of.n.dot(towards) / distance + sine + of.spread;
        let forwards = -DVec3::new(x, y, z).dot(towards) / distance;
        let leaving = forwards + sine + cone_spread;
        let reaching = forwards.max(0.0) + sine + cone_spread;
        if along >= 1.0 || facing.min(leaving) < -1e-3 || reaching < cos_reach - 1e-3 {
            return 0.0;
        }
        power * (1.0 - along * along).max(0.01) * facing.clamp(0.02, 1.0) * leaving.clamp(0.02, 1.0) / squared
    }

    fn trees(&self, has_emission: bool) -> Vec<Tree> {
        let mut trees = Vec::new();
        if self.light_count() > self.draws / 2 && self.words[3] > 0 {
            trees.push(Tree { root: self.words[2], depth: self.words[4], first_emitter: 0 });
        }
        if has_emission && self.words[0] > 0 {
            trees.push(Tree { root: 0, depth: self.words[1], first_emitter: self.light_count() });
        }
        trees
    }

    /// Calls `leaf` with every emitter below a node and the probability with which a walk that starts there ends at it; the walk ends at nodes where
    /// `is_end` is true, too, and calls `end` with them.
    fn walk(
        &self,
        tree: Tree,
        (node, chance): (u32, f64),
        of: &Around,
        is_end: &dyn Fn(u32) -> bool,
        end: &mut dyn FnMut(u32, f64),
    ) {
        let first_leaf = (1 << tree.depth) - 1;
        if chance == 0.0 {
            return;
        }
        if node >= first_leaf || is_end(tree.root + node) {
            return end(node, chance);
        }
        let children = [2 * node + 1, 2 * node + 2];
        let importances = children.map(|child| self.importance(tree.root + child, of));
        let sum: f64 = importances.iter().sum();
        for (child, importance) in children.into_iter().zip(importances) {
            if sum > 0.0 {
                self.walk(tree, (child, chance * importance / sum), of, is_end, end);
            }
        }
    }

    /// Probability with which each emitter, lights before triangles, is among the candidates of a surface of a tile; without a tile it walks alone.
    pub fn chances(
        &self,
        surface: &Surface,
        tile: Option<&[Surface]>,
        has_emission: bool,
        emitters: usize,
    ) -> Vec<f64> {
        let mut chances = vec![0.0; emitters];
        let (own, draws) = (Around::surface(surface), f64::from(self.draws));
        let around = tile.map_or(own, Around::tile);
        let trees = self.trees(has_emission);
        let roots: Vec<f64> = trees.iter().map(|tree| self.importance(tree.root, &around)).collect();
        let sum: f64 = roots.iter().sum();
        for (tree, root) in trees.into_iter().zip(roots) {
            let is_near = |node: u32| {
                let distance = self.center(node).distance(around.p);
                tile.is_none() || distance < NEAR_RADII * around.reach
            };
            let mut ends = Vec::new();
            self.walk(tree, (0, root / sum), &around, &is_near, &mut |node, chance| ends.push((node, chance)));
            for end in ends {
                self.walk(tree, end, &own, &|_| false, &mut |leaf, chance| {
                    let emitter = tree.first_emitter + self.word(tree.root + leaf, 7);
                    chances[emitter as usize] += (draws * chance).min(1.0);
                });
            }
        }
        let suns = self.words[6];
        if self.light_count() <= self.draws / 2 {
            chances[..self.light_count() as usize].fill(1.0);
        } else {
            for i in 0..suns {
                let light = self.word(self.words[5] + i, 7);
                chances[light as usize] = f64::from(suns.min(MOST_SUNS)) / f64::from(suns);
            }
        }
        chances
    }
}
