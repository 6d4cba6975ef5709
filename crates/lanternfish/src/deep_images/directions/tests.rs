use super::*;
#[test]
fn probe() {
    let sets = [
        DirectionSet::StacksSlices { stacks: 13, slices: 13 },
        DirectionSet::StacksSlices { stacks: 64, slices: 64 },
        DirectionSet::StacksSlices { stacks: 1, slices: 4096 },
        DirectionSet::Cube { k: 4 },
        DirectionSet::Cube { k: 8 },
        DirectionSet::Cube { k: 36 },
        DirectionSet::ZonalEqualArea { count: 8 },
        DirectionSet::ZonalEqualArea { count: 32 },
        DirectionSet::ZonalEqualArea { count: 128 },
        DirectionSet::ZonalEqualArea { count: 169 },
        DirectionSet::ZonalEqualArea { count: 512 },
        DirectionSet::ZonalEqualArea { count: 4096 },
    ];
    for set in sets {
        let t = std::time::Instant::now();
        let d = Directions::new(set).unwrap();
        let t = t.elapsed();
        let n = d.cells[0];
        let lens: Vec<usize> = (0..3 * n * n).map(|c| cells::range(&d.cells, c).len()).collect();
        let mut random = crate::testing::Random::new(1);
        let walk: usize = (0..100_000).map(|_| lens[cells::cell_of(random.direction(), n) as usize]).sum();
        println!(
            "{set:?}: {} axes, edge {n}, mean {:.2} walked {:.2} max {} words {} {t:?}",
            d.len(),
            lens.iter().sum::<usize>() as f64 / lens.len() as f64,
            walk as f64 / 1e5,
            lens.iter().max().unwrap(),
            d.cells.len()
        );
    }
}
