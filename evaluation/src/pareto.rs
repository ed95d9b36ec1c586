//! Turns points of time and error into those that no other point beats: the Pareto front.

/// Indices of the points (time, error) of which no other is as fast and as good, and better in one; fastest first. Of equal
/// points the first; points that are not finite never.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| points[i].0.is_finite() && points[i].1.is_finite()).collect();
    order.sort_by(|&i, &j| points[i].0.total_cmp(&points[j].0).then(points[i].1.total_cmp(&points[j].1)));
    let mut best = f64::INFINITY;
    order.retain(|&i| {
        let is_better = points[i].1 < best;
        best = best.min(points[i].1);
        is_better
    });
    order
}

/// Index of the smallest error among the points (time, error) that take at most `budget`.
pub fn best_within(points: &[(f64, f64)], budget: f64) -> Option<usize> {
    front(points).into_iter().take_while(|&i| points[i].0 <= budget).last()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_set() {
        let points = [
            (4.0, 0.2), // on the front
            (1.0, 0.5), // on the front
            (2.0, 0.6), // slower and worse than the second
            (4.0, 0.3), // as slow as the first, and worse
            (9.0, 0.2), // as good as the first, and slower
            (9.0, 0.1), // on the front
            (f64::NAN, 0.0),
            (0.5, f64::INFINITY),
            (1.0, 0.5), // equal to the second
        ];
        assert_eq!(front(&points), [1, 0, 5]);
        assert_eq!(best_within(&points, 0.9), None);
        assert_eq!(best_within(&points, 8.0), Some(0));
        assert_eq!(best_within(&points, 9.0), Some(5));
        assert!(front(&[]).is_empty());
    }
}
