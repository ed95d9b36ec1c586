//! Splits a whole number in proportion to weights, nobody going without.

/// Splits `total` in proportion to `weights`, each part at least one, by largest remainder.
pub(crate) fn apportion(weights: &[f64], total: u32) -> Vec<u32> {
    let n = weights.len();
    // Parts that deserve less than one get one; what is left is split among the others, which may make more of them
    // deserve less than one: at most n rounds, in practice two or three.
    let mut parts = vec![0u32; n];
    let mut open: Vec<usize> = (0..n).collect();
    let mut left = total.max(n as u32);
    loop {
        let sum: f64 = open.iter().map(|&i| weights[i]).sum();
        let quota = |i: usize, left: u32| if sum > 0.0 { weights[i] / sum * f64::from(left) } else { 1.0 };
        let before = open.len();
        let available = left;
        open.retain(|&i| {
            let keep = quota(i, available) >= 1.0;
            if !keep {
                parts[i] = 1;
                left -= 1;
            }
            keep
        });
        if open.len() == before {
            let mut remainders: Vec<(f64, usize)> = Vec::with_capacity(open.len());
            let mut given = 0;
            for &i in &open {
                let q = quota(i, left);
                parts[i] = q as u32;
                given += parts[i];
                remainders.push((q.fract(), i));
            }
            remainders.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let rest = left.saturating_sub(given) as usize;
            remainders
                .iter()
                .cycle()
                .take(if open.is_empty() { 0 } else { rest })
                .for_each(|&(_, i)| parts[i] += 1);
            return parts;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn shares_follow_the_areas() {
        assert_eq!(apportion(&[1.0, 2.0, 1.0], 8), [2, 4, 2]);
        assert_eq!(apportion(&[1.0, 1.0, 1.0], 10), [4, 3, 3]);
        assert_eq!(apportion(&[1e-9, 100.0], 50), [1, 49]);
        assert_eq!(apportion(&[1e-9, 100.0, 1e-9], 2), [1, 1, 1]);
        assert_eq!(apportion(&[0.0, 0.0], 7).iter().sum::<u32>(), 7);
        assert!(apportion(&[], 7).is_empty());
    }

    proptest! {
        #[test]
        fn the_sum_is_exact_and_nobody_goes_without(weights in prop::collection::vec(0.0f64..1e6, 1..40), total in 1u32..10_000) {
            let parts = apportion(&weights, total);
            prop_assert_eq!(parts.iter().sum::<u32>(), total.max(weights.len() as u32));
            prop_assert!(parts.iter().all(|&p| p >= 1));
        }
    }
}
