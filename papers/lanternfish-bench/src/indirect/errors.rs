//! Error measures of an image against others of the same view.

use lanternfish::RenderedImage;
use lanternfish_cli::images::{energy, flip};
use lanternfish_metrics::MetricsError;

use crate::table::Row;

/// Images and energies that an image is compared with.
#[derive(Clone, Copy, Debug)]
pub struct Baselines<'a> {
    /// The image with the same rays through the BVH.
    pub bvh: &'a RenderedImage,
    /// Sum of the radiance of the same image without indirect light.
    pub direct_energy: f64,
    /// Mean of many frames through the BVH, without filter.
    pub converged: &'a RenderedImage,
}

/// Returns the errors of an image: energy ratios, of all light and of indirect light alone, and LDR-FLIP against the same rays through the
/// BVH, which are errors of the deep images; and LDR-FLIP against the mean of many frames, which includes noise, blur and aliasing.
pub fn errors(rendering: &RenderedImage, baselines: &Baselines<'_>) -> Result<Row, MetricsError> {
    let Baselines { bvh, direct_energy: direct, converged } = *baselines;
    let (actual, expected) = (energy(rendering), energy(bvh));
    Ok(Row::default()
        .fixed("energy_ratio", "energy", 3, actual / expected)
        .fixed("indirect_energy_ratio", "of indirect", 3, (actual - direct) / (expected - direct))
        .fixed("flip", "FLIP to BVH", 4, flip(rendering, bvh)?)
        .fixed("converged_flip", "to many frames", 4, flip(rendering, converged)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendering(radiance: f32) -> RenderedImage {
        let texels = vec![[radiance, radiance, radiance, 1.0]; 64];
        RenderedImage { width: 8, height: 8, ..crate::testing::rendering(texels, (255.0 * radiance) as u8) }
    }

    #[test]
    fn an_image_has_no_error_against_itself_only() {
        let (bvh, converged) = (rendering(0.5), rendering(0.4));
        let baselines = Baselines { bvh: &bvh, direct_energy: 0.5 * energy(&bvh), converged: &converged };
        let of = |rendering: &RenderedImage| {
            let row = errors(rendering, &baselines).unwrap();
            ["energy_ratio", "indirect_energy_ratio", "flip", "converged_flip"].map(|key| row.f64(key))
        };
        let [energy, indirect, flip, noise] = of(&bvh);
        assert!([energy, indirect, flip] == [1.0, 1.0, 0.0] && noise > 0.0);
        // 10 % too bright, all of it from indirect light.
        let [energy, indirect, flip, converged] = of(&rendering(0.55));
        assert!((energy - 1.1).abs() < 1e-6 && (indirect - 1.2).abs() < 1e-6);
        assert!(flip > 0.0 && converged > noise);
        assert!(errors(&RenderedImage { width: 4, height: 16, ..rendering(0.5) }, &baselines).is_err());
    }
}
