//! Turns the points of all paths and what has changed into bits of the points at which segments end that met it.
//!
//! The points are taken as they lie in memory, whichever paths they belong to, 64 at a time and without branches: of
//! short paths one by one the mispredicted ends of loops cost more than the tests. The few segments that come near are
//! then tested as [`Disturbance::first_met`] does: the first bit of a path that is set says the same, exactly.

use crate::{
    change::{ALL, at_most},
    disturbance::{Disturbance, Obstacle},
    trail::{EMITTED, ESCAPED, Vertex},
};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Points to a word.
const WORD: usize = u64::BITS as usize;

/// What stands for each point of a word: its bit in the word's half.
const FLAGS: [u32; WORD] = {
    let mut flags = [0; WORD];
    let mut i = 0;
    while i < WORD {
        flags[i] = 1 << (i % (WORD / 2));
        i += 1;
    }
    flags
};

/// Words in one unit of parallel work.
const WORDS_AT_ONCE: usize = 256;

/// More ranges of triangles than this are joined at first: each costs a test for every point.
const MOST_RANGES: usize = 4;

/// Which stored points end a segment that met what has changed; of segments that go on from a changed triangle only some
/// are told, as their path is known.
#[derive(Clone, Debug)]
pub(crate) struct Encounters {
    /// A bit for each point, from the lowest, and at least one bit more.
    words: Vec<u64>,
}

impl Encounters {
    /// Looks at all pairs of adjacent points, on the present rayon pool. Points between paths may be any.
    pub(crate) fn find(disturbance: &Disturbance, points: &[Vertex]) -> Self {
        let mut words = vec![0; points.len() / WORD + 1];
        let look = Look::new(disturbance, points);
        words.par_chunks_mut(WORDS_AT_ONCE).enumerate().for_each(|(part, words)| {
            pulp::Arch::new().dispatch(Part { look: &look, first: part * WORDS_AT_ONCE * WORD, words });
        });
        Self { words }
    }

    /// How many points of those in `path`, one path's, come before the end of its first segment that met it, at most
    /// 254; [`ALL`] where none did. Where the points are [`WORD`] or fewer they are points of one word; else they
    /// begin with a word.
    #[inline]
    pub(crate) fn kept(&self, path: Range<usize>) -> u8 {
        let (word, shift) = (path.start / WORD, path.start % WORD);
        // No segment ends at the first point.
        let segments = path.len().saturating_sub(1);
        if segments < WORD {
            let bits = (self.words[word] >> shift >> 1) & ((1 << segments) - 1);
            // Whether there is any is not to be predicted: no branch.
            let none = if bits == 0 { ALL } else { 0 };
            return (bits.trailing_zeros() as u8 + 1) | none;
        }
        let whole = path.end / WORD;
        let last = self.words[whole] & ((1 << (path.end % WORD)) - 1);
        let between = self.words[word + 1..whole].iter().copied();
        let words = std::iter::once(self.words[word] & !1).chain(between).chain([last]);
        let met = words.zip((0..).step_by(WORD)).find(|&(bits, _)| bits != 0);
        met.map_or(ALL, |(bits, start)| at_most(start + bits.trailing_zeros() as usize))
    }
}

/// The coordinates of the points of one word, the last point before it first.
struct Column {
    x: [f32; WORD + 1],
    y: [f32; WORD + 1],
    z: [f32; WORD + 1],
    number: [u32; WORD + 1],
}

impl Default for Column {
    fn default() -> Self {
        let zero = [0.0; WORD + 1];
        Self { x: zero, y: zero, z: zero, number: [EMITTED; WORD + 1] }
    }
}

impl Column {
    #[inline(always)]
    fn set(&mut self, points: &[Vertex]) {
        for (i, point) in points.iter().enumerate().take(WORD + 1) {
            let ([x, y, z], number) = point.parts();
            (self.x[i], self.y[i], self.z[i], self.number[i]) = (x, y, z, number);
        }
    }
}

struct Look<'a> {
    disturbance: &'a Disturbance,
    points: &'a [Vertex],
    /// Every triangle that has changed is in one of them.
    ranges: Vec<Range<u32>>,
    /// No other is.
    is_exact: bool,
}

/// Words from that of the point `first`.
struct Part<'a> {
    look: &'a Look<'a>,
    first: usize,
    words: &'a mut [u64],
}

impl WithSimd for Part<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut column = Column::default();
        let mut open = Vec::with_capacity(self.words.len() * WORD / 8);
        for (word, first) in self.words.iter_mut().zip((self.first..).step_by(WORD)) {
            *word = self.look.word(simd, first, &mut column, &mut open);
        }
        for index in open {
            self.words[(index - self.first) / WORD] |= u64::from(self.look.is_met(index)) << (index % WORD);
        }
    }
}

impl<'a> Look<'a> {
    fn new(disturbance: &'a Disturbance, points: &'a [Vertex]) -> Self {
        let triangles = disturbance.triangles();
        let per_range = triangles.len().div_ceil(MOST_RANGES).max(1);
        let ranges = triangles.chunks(per_range).map(|part| part[0].start..part[part.len() - 1].end);
        Self { disturbance, points, ranges: ranges.collect(), is_exact: per_range == 1 }
    }

    /// The bits of the points from `first` that are certain, and the points of which another look has to decide.
    #[inline(always)]
    fn word<S: Simd>(&self, simd: S, first: usize, column: &mut Column, open: &mut Vec<usize>) -> u64 {
        let end = self.points.len().min(first + WORD);
        if first >= end {
            return 0;
        }
        if first == 0 || end < first + WORD {
            // At the edges of the storage.
            open.extend(first.max(1)..end);
            return 0;
        }
        column.set(&self.points[first - 1..end]);
        let (mut touched, mut near) = ([0; WORD], [0; WORD]);
        for range in &self.ranges {
            touch(simd, column, range, &mut touched);
        }
        for obstacle in self.disturbance.obstacles() {
            if obstacle.is_round() {
                come_near::<S, false>(simd, column, obstacle, &mut near);
            } else {
                come_near::<S, true>(simd, column, obstacle, &mut near);
            }
        }
        let (touched, near) = (bits(&touched), bits(&near));
        let met = if self.is_exact { touched } else { 0 };
        // The segment that goes on from what is certain is of the same path.
        let mut rest = (touched | near) & !(met | met << 1);
        while rest != 0 {
            open.push(first + rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
        met
    }

    fn is_met(&self, index: usize) -> bool {
        self.disturbance.is_met(&self.points[index - 1], &self.points[index])
    }
}

/// Sets those whose number is in `range`.
#[inline(always)]
fn touch<S: Simd>(simd: S, column: &Column, range: &Range<u32>, touched: &mut [u32; WORD]) {
    let (start, count) = (simd.splat_u32s(range.start), simd.splat_u32s(range.end - range.start));
    let numbers = S::as_simd_u32s(&column.number[1..]).0;
    let flags = S::as_simd_u32s(&FLAGS).0;
    for ((touched, &number), &flag) in S::as_mut_simd_u32s(touched).0.iter_mut().zip(numbers).zip(flags) {
        let is_inside = simd.less_than_u32s(simd.sub_u32s(number, start), count);
        *touched = simd.select_u32s(is_inside, flag, *touched);
    }
}

/// Sets those that end a segment which may cross `obstacle`, all that do among them: by its sphere, and its box if BOXED.
#[inline(always)]
fn come_near<S: Simd, const BOXED: bool>(
    simd: S,
    column: &Column,
    obstacle: &Obstacle,
    near: &mut [u32; WORD],
) {
    let lanes = |values| S::as_simd_f32s(values).0;
    let (ax, ay, az) = (lanes(&column.x[..WORD]), lanes(&column.y[..WORD]), lanes(&column.z[..WORD]));
    let (bx, by, bz) = (lanes(&column.x[1..]), lanes(&column.y[1..]), lanes(&column.z[1..]));
    let numbers = S::as_simd_u32s(&column.number[1..]).0;
    let flags = S::as_simd_u32s(&FLAGS).0;
    let [low, high] = obstacle.bounds();
    let (centre, radius) = obstacle.sphere();
    let (add, sub) = (|a, b| simd.add_f32s(a, b), |a, b| simd.sub_f32s(a, b));
    let (mul, splat) = (|a, b| simd.mul_f32s(a, b), |x| simd.splat_f32s(x));
    let dot = |ax, ay, az, bx, by, bz| add(add(mul(ax, bx), mul(ay, by)), mul(az, bz));
    let meets = |a, b, low, high| {
        let is_below = simd.less_than_or_equal_f32s(simd.min_f32s(a, b), splat(high));
        simd.and_m32s(is_below, simd.greater_than_or_equal_f32s(simd.max_f32s(a, b), splat(low)))
    };
    for (i, near) in S::as_mut_simd_u32s(near).0.iter_mut().enumerate() {
        let (ax, ay, az) = (ax[i], ay[i], az[i]);
        let (fx, fy, fz) = (sub(splat(centre[0]), ax), sub(splat(centre[1]), ay), sub(splat(centre[2]), az));
        let is_ray = simd.equal_u32s(numbers[i], simd.splat_u32s(ESCAPED));
        let is_begin = simd.equal_u32s(numbers[i], simd.splat_u32s(EMITTED));
        let (bx, by, bz) = (bx[i], by[i], bz[i]);
        let to = |a, b| simd.select_f32s(is_ray, b, sub(b, a));
        let (dx, dy, dz) = (to(ax, bx), to(ay, by), to(az, bz));
        let length_sq = simd.max_f32s(dot(dx, dy, dz, dx, dy, dz), splat(f32::MIN_POSITIVE));
        let share = simd.div_f32s(dot(fx, fy, fz, dx, dy, dz), length_sq);
        let most = simd.select_f32s(is_ray, splat(f32::MAX), splat(1.0));
        let share = simd.min_f32s(simd.max_f32s(share, splat(0.0)), most);
        let (ox, oy, oz) = (sub(fx, mul(share, dx)), sub(fy, mul(share, dy)), sub(fz, mul(share, dz)));
        let mut is_near = simd.less_than_or_equal_f32s(dot(ox, oy, oz, ox, oy, oz), splat(radius * radius));
        if BOXED {
            let (x, y) = (meets(ax, bx, low[0], high[0]), meets(ay, by, low[1], high[1]));
            let is_meeting = simd.and_m32s(simd.and_m32s(x, y), meets(az, bz, low[2], high[2]));
            is_near = simd.and_m32s(is_near, simd.or_m32s(is_meeting, is_ray));
        }
        let flag = simd.select_u32s(is_begin, simd.splat_u32s(0), flags[i]);
        *near = simd.select_u32s(is_near, flag, *near);
    }
}

/// Joins the flags that are set.
#[inline(always)]
fn bits(flags: &[u32; WORD]) -> u64 {
    let (low, high) = flags.split_at(WORD / 2);
    let join = |half: &[u32]| half.iter().fold(0, |bits, flag| bits | flag);
    u64::from(join(low)) | u64::from(join(high)) << (WORD / 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disturbance::tests::{Numbers, boxed};
    use glam::{Mat3A, Vec3};
    use photonstream_scene::Side;

    /// A path of `length` segments among 40 triangles, one in three of which leaves the scene in the end.
    fn path(numbers: &mut Numbers, length: usize) -> Vec<Vertex> {
        let mut path = vec![Vertex::emitted(numbers.point())];
        for segment in 0..length {
            let escapes = segment + 1 == length && numbers.next() > 0.3;
            path.push(if escapes {
                Vertex::escaped(numbers.point().normalize())
            } else {
                Vertex::hit(numbers.point(), (20.0 + 20.0 * numbers.next()) as u32, Side::Front, true)
            });
        }
        path
    }

    fn disturbance(numbers: &mut Numbers, case: usize) -> Disturbance {
        let ranges = [0, 1, 2, 8][case % 4];
        let obstacles = [1, 0, 2, 9][case / 4 % 4];
        let ranges = (0..ranges).map(|i| 5 * i + 1..5 * i + 2);
        let turned = |numbers: &mut Numbers| {
            // Each third is a cube, whose sphere is smaller than the box around it when it is turned.
            let half = if case.is_multiple_of(3) { Vec3::splat(0.2) } else { numbers.point().abs() * 0.3 };
            let turn = Mat3A::from_euler(glam::EulerRot::XYZ, numbers.next(), numbers.next(), numbers.next());
            boxed(numbers.point(), half, turn, 2.0)
        };
        Disturbance::new(ranges, (0..obstacles).map(|_| turned(numbers)).collect())
    }

    /// Of N = 48 changes times 700 paths (seed 3) of 0 to 9 segments, and some of up to 300, the bits say what each path
    /// alone does: exactly, with free blocks between them, and on the plainest instructions as on the best.
    #[test]
    fn the_bits_say_what_each_path_does() {
        let mut numbers = Numbers(3);
        let (mut concerned, mut left) = (0, 0);
        for case in 0..48 {
            let disturbance = disturbance(&mut numbers, case);
            // Blocks of powers of two, as the pool has them.
            let (mut points, mut paths) = (Vec::<Vertex>::new(), Vec::new());
            for i in 0..700 {
                let length = if i % 100 == 7 { 3 * i % 301 } else { (5.0 + 5.0 * numbers.next()) as usize };
                let path = path(&mut numbers, length);
                let start = points.len().next_multiple_of(path.len().next_power_of_two());
                points.resize(start, Vertex::default());
                points.extend(&path);
                points.resize(start + path.len().next_power_of_two(), Vertex::default());
                // One in eight is free, its points still there.
                if i % 8 != 3 {
                    paths.push(start..start + path.len());
                }
            }
            let found = Encounters::find(&disturbance, &points);
            let mut plain = vec![0; found.words.len()];
            let look = Look::new(&disturbance, &points);
            pulp::Scalar.vectorize(Part { look: &look, first: 0, words: &mut plain });
            assert_eq!(plain, found.words, "case {case}");
            for path in paths {
                let kept = disturbance.first_met(&points[path.clone()]).map_or(ALL, at_most);
                assert_eq!(found.kept(path.clone()), kept, "case {case}: {path:?}");
                concerned += u32::from(kept != ALL);
                left += u32::from(kept == ALL);
            }
        }
        assert!(concerned > 5000 && left > 5000, "{concerned} {left}");
    }

    /// Bits of points outside a path say nothing of it, wherever its block lies.
    #[test]
    fn only_a_path_s_own_segments_count() {
        for (start, length) in [(0, 1), (0, 64), (63, 1), (62, 2), (32, 20), (64, 65), (64, 128), (128, 200)]
        {
            let mut words = vec![u64::MAX; 7];
            for i in start + 1..start + length {
                words[i / WORD] &= !(1 << (i % WORD));
            }
            let mut encounters = Encounters { words };
            assert_eq!(encounters.kept(start..start + length), ALL, "{start} {length}");
            for i in start + 1..start + length {
                encounters.words[i / WORD] |= 1 << (i % WORD);
                assert_eq!(
                    encounters.kept(start..start + length),
                    (i - start) as u8,
                    "{start} {length}: {i}"
                );
                encounters.words[i / WORD] &= !(1 << (i % WORD));
            }
        }
        assert_eq!(Encounters { words: vec![u64::MAX] }.kept(0..0), ALL, "no path has no segment");
    }
}
