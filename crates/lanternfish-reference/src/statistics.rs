//! Statistical tests of distributions.

/// p-value of Pearson's χ² test of `counts` against the `expected` fractions. Cells with an expected count below 5 are pooled. Returns 0 if
/// a cell with an expected fraction of 0 has a count.
///
/// The tail of χ² is Wilson and Hilferty's normal approximation, accurate to a few per cent of p from five cells on.
pub(crate) fn chi_square(counts: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(counts.len(), expected.len());
    let total = counts.iter().sum::<u64>() as f64;
    let fractions: f64 = expected.iter().sum();
    assert!((fractions - 1.0).abs() < 0.01, "the expected fractions sum to {fractions}");
    let (mut statistic, mut cells, mut pooled) = (0.0, 0, (0.0, 0.0));
    let mut add = |count: f64, expected: f64| {
        statistic += (count - expected) * (count - expected) / expected;
        cells += 1;
    };
    for (count, fraction) in counts.iter().zip(expected) {
        let (count, expected) = (*count as f64, fraction / fractions * total);
        if expected <= 0.0 && count > 0.0 {
            return 0.0;
        }
        if expected < 5.0 {
            pooled = (pooled.0 + count, pooled.1 + expected);
        } else {
            add(count, expected);
        }
    }
    if pooled.1 >= 5.0 {
        add(pooled.0, pooled.1);
    }
    assert!(cells >= 5, "{cells} cells: too few for the test");
    let degrees = f64::from(cells - 1);
    let variance = 2.0 / (9.0 * degrees);
    let z = ((statistic / degrees).cbrt() - (1.0 - variance)) / variance.sqrt();
    normal_tail(z)
}

/// Upper tail of a normal distribution: its fraction beyond `z` standard deviations above the mean (Abramowitz and Stegun 26.2.17; absolute
/// error below 1e-7).
fn normal_tail(z: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * z.abs());
    let polynomial =
        t * (0.319_381_530 + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let tail = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt() * polynomial;
    if z >= 0.0 { tail } else { 1.0 - tail }
}

#[test]
fn chi_square_detects_deviations_and_nothing_else() {
    assert!((normal_tail(1.959_964) - 0.025).abs() < 1e-6 && (normal_tail(-1.0) - 0.841_344_7).abs() < 1e-6);
    // 16.92 with nine degrees of freedom is the 95 % point: 1,000 in ten cells, half of them off by 13.
    let even = [0.1; 10];
    let off = |by: u64| -> Vec<u64> { (0..10).map(|i| if i % 2 == 0 { 100 + by } else { 100 - by }).collect() };
    assert!((chi_square(&off(13), &even) - 0.05).abs() < 0.01, "{}", chi_square(&off(13), &even));
    assert!(chi_square(&off(2), &even) > 0.9);
    assert!(chi_square(&off(40), &even) < 1e-10);
    assert_eq!(chi_square(&[10, 10, 10, 10, 10, 1], &[0.2, 0.2, 0.2, 0.2, 0.2, 0.0]), 0.0);
}
