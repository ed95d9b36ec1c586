//! Turns places into how far the closest other one of each is.

use glam::{DVec3, Vec3};

/// Places are looked through along this unit vector: askew, so that walls and floors along the axes do not fall together.
const ALONG: DVec3 = DVec3::new(0.48, 0.6, 0.64);

/// The square of the distance of each place to the closest other one, m²; infinite for one alone.
///
/// On surfaces it takes about N^1.5 comparisons: each place is compared with those before and after it, until they are
/// farther along [`ALONG`] than the closest one is.
pub(super) fn squared_distances(places: &[Vec3]) -> Vec<f32> {
    let mut sorted: Vec<(f64, usize)> =
        places.iter().enumerate().map(|(index, place)| (place.as_dvec3().dot(ALONG), index)).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut nearest = vec![f32::INFINITY; places.len()];
    for (number, &(along, index)) in sorted.iter().enumerate() {
        let mut closest = f32::INFINITY;
        let mut compare = |&(other, of): &(f64, usize)| {
            let is_near = (other - along).powi(2) < f64::from(closest);
            if is_near {
                closest = closest.min(places[index].distance_squared(places[of]));
            }
            is_near
        };
        // Stops at the first that is too far.
        let _ = sorted[number + 1..].iter().all(&mut compare);
        let _ = sorted[..number].iter().rev().all(&mut compare);
        nearest[index] = closest;
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_shading::sobol::Sequence;

    /// 500 places in a cube and 500 on its floor, of a million metres' offset or none: the same as comparing all with all.
    #[test]
    fn the_closest_are_found() {
        for offset in [0.0, 1e6] {
            let place = |index: u32| {
                let mut sample = Sequence::new(3, 7).sample(index.into());
                let ([x, y], [z, _]) = (sample.next_2d(), sample.next_2d());
                Vec3::new(x + offset, if index.is_multiple_of(2) { y } else { 0.0 }, z)
            };
            let places: Vec<Vec3> = (0..1000).map(place).collect();
            let found = squared_distances(&places);
            for (i, (a, found)) in places.iter().zip(found).enumerate() {
                let others = places.iter().enumerate().filter(|(j, _)| *j != i);
                let expected = others.map(|(_, b)| a.distance_squared(*b)).fold(f32::INFINITY, f32::min);
                assert_eq!(found, expected, "{i}");
            }
        }
        assert_eq!(squared_distances(&[Vec3::ONE; 2]), [0.0; 2]);
        assert_eq!(squared_distances(&[Vec3::ONE]), [f32::INFINITY]);
        assert!(squared_distances(&[]).is_empty());
    }
}
