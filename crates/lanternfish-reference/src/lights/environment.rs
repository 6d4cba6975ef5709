//! Light from the environment: a constant radiance, or an image.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use lanternfish_scene::{Environment, Scene};

/// The environment and its importance sampling.
pub(crate) enum Sky {
    /// Constant radiance, nits.
    Constant(Vec3),
    /// Distributions over rows, and over the columns of each row, by power.
    Image { rows: Table, columns: Vec<Table> },
}

/// A discrete distribution over cells.
pub(crate) struct Table {
    /// Cumulative probability of each cell, up to 1.
    cumulative: Vec<f64>,
    sum: f64,
}

impl Table {
    fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let mut cumulative: Vec<f64> = weights
            .map(|weight| {
                sum += weight;
                sum
            })
            .collect();
        // A row without light is never selected: all its probabilities are zero.
        cumulative.iter_mut().for_each(|c| *c /= sum.max(f64::MIN_POSITIVE));
        Self { cumulative, sum }
    }

    /// Samples a cell, and a position in it, 0..1.
    fn choose(&self, u: f64) -> (usize, f64) {
        let cell = self.cumulative.partition_point(|c| *c <= u).min(self.cumulative.len() - 1);
        let before = if cell == 0 { 0.0 } else { self.cumulative[cell - 1] };
        let chance = self.chance(cell);
        (cell, if chance > 0.0 { ((u - before) / chance).clamp(0.0, 1.0 - f64::EPSILON) } else { 0.5 })
    }

    fn chance(&self, cell: usize) -> f64 {
        self.cumulative[cell] - if cell == 0 { 0.0 } else { self.cumulative[cell - 1] }
    }
}

impl Sky {
    pub fn new(scene: &Scene) -> Self {
        let Some(image) = scene.environment.as_ref().filter(|image| image.pixels.iter().any(|p| *p != Vec3::ZERO))
        else {
            return Self::Constant(if scene.environment.is_some() { Vec3::ZERO } else { scene.sky });
        };
        let columns: Vec<Table> =
            (0..image.height).map(|y| Table::new((0..image.width).map(|x| weight(image, x, y)))).collect();
        let height = image.height as f64;
        let solid_angle = |y: usize| (PI * y as f64 / height).cos() - (PI * (y + 1) as f64 / height).cos();
        let rows = Table::new(columns.iter().enumerate().map(|(y, row)| row.sum * solid_angle(y)));
        Self::Image { rows, columns }
    }

    pub fn is_dark(&self) -> bool {
        matches!(self, Self::Constant(Vec3::ZERO))
    }

    /// Radiance that arrives from `direction`, nits.
    pub fn radiance(&self, scene: &Scene, direction: DVec3) -> Vec3 {
        match (self, &scene.environment) {
            (Self::Image { .. }, Some(image)) => image.radiance(direction.as_vec3()),
            (Self::Constant(radiance), _) => *radiance,
            (Self::Image { .. }, None) => Vec3::ZERO,
        }
    }

    /// Samples a direction. Returns it with its radiance, nits, and its density, 1/sr.
    pub fn sample(&self, scene: &Scene, u: f64, v: f64) -> Option<(DVec3, Vec3, f64)> {
        let wi = match (self, &scene.environment) {
            (Self::Image { rows, columns }, Some(image)) => {
                let (y, part_y) = rows.choose(u);
                let (x, part_x) = columns[y].choose(v);
                // Uniform in the cosine of the polar angle within the row.
                let cosine = |y: f64| (PI * y / image.height as f64).cos();
                let (above, below) = (cosine(y as f64), cosine((y + 1) as f64));
                let polar = (above + (below - above) * part_y).clamp(-1.0, 1.0).acos();
                let across = (x as f64 + part_x) / image.width as f64;
                image.direction(across as f32, (polar / PI) as f32).as_dvec3().normalize()
            }
            _ => {
                let z = 1.0 - 2.0 * u;
                let ring = (1.0 - z * z).max(0.0).sqrt();
                let (sin, cos) = (2.0 * PI * v).sin_cos();
                DVec3::new(ring * cos, z, ring * sin)
            }
        };
        let pdf = self.pdf(scene, wi);
        (pdf > 0.0).then(|| (wi, self.radiance(scene, wi), pdf))
    }

    /// Density of [`Sky::sample`], 1/sr.
    pub fn pdf(&self, scene: &Scene, wi: DVec3) -> f64 {
        let (Self::Image { rows, columns }, Some(image)) = (self, &scene.environment) else { return 0.25 / PI };
        let (u, v) = image.uv(wi.as_vec3());
        let cell = |at: f32, count: usize| ((at * count as f32) as usize).min(count - 1);
        let (x, y) = (cell(u, image.width), cell(v, image.height));
        let height = image.height as f64;
        let band = (PI * y as f64 / height).cos() - (PI * (y + 1) as f64 / height).cos();
        rows.chance(y) * columns[y].chance(x) * image.width as f64 / (2.0 * PI * band)
    }
}

/// Mean of the brightest channel over a pixel. Bilinear interpolation between pixel centres blends neighbours into a pixel's area.
fn weight(image: &Environment, x: usize, y: usize) -> f64 {
    let tent = [0.125, 0.75, 0.125];
    let mut sum = 0.0;
    for (j, row_fraction) in tent.iter().enumerate() {
        let row = (y + j).saturating_sub(1).min(image.height - 1);
        for (i, fraction) in tent.iter().enumerate() {
            let column = (x + image.width + i - 1) % image.width;
            sum += fraction * row_fraction * f64::from(image.pixels[row * image.width + column].max_element());
        }
    }
    sum
}
