//! Whether one set of values lies above another: the rank-sum test `[MannWhitney1947]`, exact.

/// The probability that so many pairs or more, a value of `above` over one of `below`, are found by chance: where every order of all the
/// values is equally likely. 1 where a set is empty.
///
/// It asks for no distribution of the values: one value that is far off counts as one. Equal values count as not above, which makes the
/// probability larger.
pub fn chance(below: &[f64], above: &[f64]) -> f64 {
    let pairs = above.iter().map(|a| below.iter().filter(|b| a > b).count()).sum::<usize>();
    let orders = orders(below.len(), above.len());
    orders[pairs..].iter().sum::<f64>() / orders.iter().sum::<f64>()
}

/// The smallest probability that sets of these sizes can have: of all values of the one above all of the other.
pub fn least_chance(below: usize, above: usize) -> f64 {
    1.0 / orders(below, above).iter().sum::<f64>()
}

/// In how many orders of `n` and `m` values there are 0, 1, … n m pairs in which one of the `m` is above.
fn orders(n: usize, m: usize) -> Vec<f64> {
    // Of i and j values: the highest is one of the m, above all i, or one of the n.
    let mut of = vec![vec![Vec::new(); m + 1]; n + 1];
    for i in 0..=n {
        for j in 0..=m {
            let mut counts = vec![0.0; i * j + 1];
            if i == 0 || j == 0 {
                counts[0] = 1.0;
            } else {
                let (from_m, from_n): (&Vec<f64>, &Vec<f64>) = (&of[i][j - 1], &of[i - 1][j]);
                from_m.iter().enumerate().for_each(|(pairs, count)| counts[pairs + i] += count);
                from_n.iter().enumerate().for_each(|(pairs, count)| counts[pairs] += count);
            }
            of[i][j] = counts;
        }
    }
    of.pop().and_then(|mut row| row.pop()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_those_of_the_tables() {
        assert_eq!(orders(2, 2), [1.0, 1.0, 2.0, 1.0, 1.0]);
        assert_eq!(orders(3, 5).iter().sum::<f64>(), 56.0);
        assert_eq!(least_chance(7, 7), 1.0 / 3432.0);
        assert_eq!((chance(&[], &[1.0]), chance(&[1.0], &[])), (1.0, 1.0));
    }

    #[test]
    fn the_chance_is_that_of_all_orders() {
        // Every way to choose which three of seven values are the upper set's.
        let values: Vec<f64> = (0..7).map(|i| f64::from(i) * 1.7).collect();
        let sets: Vec<(Vec<f64>, Vec<f64>)> = (0..128u32)
            .filter(|set| set.count_ones() == 3)
            .map(|set| (0..7).partition(|i| set & (1 << i) == 0))
            .map(|(below, above): (Vec<usize>, Vec<usize>)| {
                (below.iter().map(|i| values[*i]).collect(), above.iter().map(|i| values[*i]).collect())
            })
            .collect();
        for level in [0.03, 0.1, 0.3, 0.6] {
            let found = sets.iter().filter(|(below, above)| chance(below, above) <= level).count();
            assert!(found as f64 / sets.len() as f64 <= level + 1e-12, "{found} at {level}");
        }
        assert_eq!(chance(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]), 0.05);
        assert_eq!(chance(&[4.0, 5.0, 6.0], &[1.0, 2.0, 3.0]), 1.0);
        assert_eq!(chance(&[1.0, 1.0], &[1.0, 1.0]), 1.0, "what is equal is not above");
    }
}
