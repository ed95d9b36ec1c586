//! Turns points of a plane into their convex hull, and a hull into one with fewer corners and the same area.

use glam::DVec2;

/// The corners of the convex hull, counter-clockwise; fewer than three where the points have no extent.
///
/// Source: Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
pub(super) fn convex(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.retain(|p| p.is_finite());
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

/// A hull of at most `most` corners: the corners that cut off least go first, and the rest is scaled about its centre until
/// it has its area again. Corners that only rounding makes go, too.
pub(super) fn with_at_most(most: usize, mut hull: Vec<DVec2>) -> Vec<DVec2> {
    /// Of the area: the owner table's own rounding.
    const ROUNDING: f64 = 1e-5;
    let before = area(&hull);
    while hull.len() > 3 {
        let n = hull.len();
        let cut = |i: usize| {
            let [a, b, c] = [hull[(i + n - 1) % n], hull[i], hull[(i + 1) % n]];
            (b - a).perp_dot(c - b)
        };
        let least = (0..n).min_by(|&a, &b| cut(a).total_cmp(&cut(b))).unwrap_or(0);
        if n <= most && cut(least) > before * ROUNDING {
            break;
        }
        hull.remove(least);
    }
    if hull.len() < 3 || before <= 0.0 {
        return Vec::new();
    }
    let centre = hull.iter().sum::<DVec2>() / hull.len() as f64;
    let scale = (before / area(&hull)).sqrt();
    hull.iter().map(|p| centre + (p - centre) * scale).collect()
}

fn area(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    (0..n).map(|i| polygon[i].perp_dot(polygon[(i + 1) % n])).sum::<f64>() * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_within_and_on_edges_are_no_corners() {
        let grid = || (0..25).map(|i| DVec2::new(f64::from(i % 5), f64::from(i / 5)));
        let hull = convex(grid().collect());
        assert_eq!(hull, [DVec2::ZERO, DVec2::new(4.0, 0.0), DVec2::splat(4.0), DVec2::new(0.0, 4.0)]);
        // Rounding in the last place neither loses a corner nor leaves one.
        for turn in 0..360 {
            let turned = |p: DVec2| DVec2::from_angle(f64::from(turn) * 0.01745).rotate(p);
            let hull = with_at_most(8, convex(grid().map(turned).collect()));
            assert!(hull.len() == 4 && (area(&hull) - 16.0).abs() < 1e-12, "{turn}: {hull:?}");
        }
        assert!(with_at_most(8, convex(vec![DVec2::ONE; 7])).is_empty());
        assert!(with_at_most(8, convex((0..9).map(|i| DVec2::splat(f64::from(i))).collect())).is_empty());
        assert!(with_at_most(8, convex(vec![DVec2::NAN; 3])).is_empty());
    }

    #[test]
    fn fewer_corners_keep_the_area() {
        let circle: Vec<DVec2> = (0..30).map(|i| DVec2::from_angle(f64::from(i) * 0.2094)).collect();
        let before = convex(circle);
        let after = with_at_most(8, before.clone());
        assert_eq!((before.len(), after.len()), (30, 8));
        assert!((area(&after) / area(&before) - 1.0).abs() < 1e-12);
    }
}
