//! Turns many reflections into few: those near one another that look the same way and are of alike material become one.

use super::{
    grid::Grid,
    trace::{Kind, Reflection},
};
use glam::{DVec3, Vec3};

/// Cosine of the angle between the normals of what may be put together: 45°.
pub(super) const COS_TOGETHER: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Reflections put together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cluster {
    /// Sums over the reflections, in f64 so that their order does not show.
    position: DVec3,
    normal: DVec3,
    albedo: DVec3,
    /// How many they are.
    pub(super) population: u32,
    /// What the first of them is.
    pub(super) kind: Kind,
}

impl From<&Reflection> for Cluster {
    fn from(reflection: &Reflection) -> Self {
        Self {
            position: reflection.position.as_dvec3(),
            normal: reflection.normal.as_dvec3(),
            albedo: reflection.albedo.as_dvec3(),
            population: 1,
            kind: reflection.kind,
        }
    }
}

impl Cluster {
    /// The mean position, m.
    pub(super) fn position(&self) -> Vec3 {
        (self.position / f64::from(self.population)).as_vec3()
    }

    /// The unit vector of the mean normal. Normals of a cluster cannot cancel out: each lies within 45° of the mean of
    /// those before it.
    pub(super) fn normal(&self) -> Vec3 {
        self.normal.normalize().as_vec3()
    }

    /// The mean reflectance.
    pub(super) fn albedo(&self) -> Vec3 {
        (self.albedo / f64::from(self.population)).as_vec3()
    }

    fn add(&mut self, other: &Self) {
        self.position += other.position;
        self.normal += other.normal;
        self.albedo += other.albedo;
        self.population += other.population;
    }
}

/// Whether two places are so near (below `spacing_m`) and look so much the same way that one stands for both.
pub(super) fn are_together(a: (Vec3, Vec3), b: (Vec3, Vec3), spacing_m: f32) -> bool {
    a.0.distance_squared(b.0) < spacing_m * spacing_m && a.1.dot(b.1) >= COS_TOGETHER
}

/// Clusters of which no two of one kind are [together](are_together), and the cluster of each reflection.
///
/// Each reflection joins the nearest cluster that it is together with, by the mean of that so far; the clusters, those of
/// most reflections first, are put together in the same way until nothing changes.
pub(super) fn clusters(reflections: &[Reflection], spacing_m: f32) -> (Vec<Cluster>, Vec<u32>) {
    let single: Vec<Cluster> = reflections.iter().map(Cluster::from).collect();
    let (mut clusters, mut of) = gather(&single, spacing_m);
    loop {
        let mut order: Vec<u32> = (0..clusters.len() as u32).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(clusters[i as usize].population));
        let sorted: Vec<Cluster> = order.iter().map(|&i| clusters[i as usize]).collect();
        let (merged, into) = gather(&sorted, spacing_m);
        let mut renumbered = vec![0; order.len()];
        order.iter().zip(into).for_each(|(&old, new)| renumbered[old as usize] = new);
        of.iter_mut().for_each(|cluster| *cluster = renumbered[*cluster as usize]);
        let is_done = merged.len() == clusters.len();
        clusters = merged;
        if is_done {
            return (clusters, of);
        }
    }
}

/// One pass: what each part joins, in order.
fn gather(parts: &[Cluster], spacing_m: f32) -> (Vec<Cluster>, Vec<u32>) {
    let mut grid = Grid::new(spacing_m);
    let mut clusters: Vec<Cluster> = Vec::new();
    // Position and normal of the clusters so far: their means.
    let mut places: Vec<(Vec3, Vec3)> = Vec::new();
    let mut joined = Vec::with_capacity(parts.len());
    for part in parts {
        let here = (part.position(), part.normal());
        let nearest = grid
            .near(here.0)
            .filter(|&i| {
                are_together(places[i as usize], here, spacing_m)
                    && clusters[i as usize].kind.is_alike(&part.kind)
            })
            .min_by(|&i, &j| {
                let distance = |i: u32| places[i as usize].0.distance_squared(here.0);
                distance(i).total_cmp(&distance(j)).then(i.cmp(&j))
            });
        let number = match nearest {
            Some(number) => {
                let cluster = &mut clusters[number as usize];
                cluster.add(part);
                let place = &mut places[number as usize];
                grid.relocate(place.0, cluster.position(), number);
                *place = (cluster.position(), cluster.normal());
                number
            }
            None => {
                let number = clusters.len() as u32;
                grid.insert(here.0, number);
                clusters.push(*part);
                places.push(here);
                number
            }
        };
        joined.push(number);
    }
    (clusters, joined)
}
