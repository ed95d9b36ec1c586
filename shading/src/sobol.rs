//! Turns a sample index and a dimension into a point of an Owen-scrambled Sobol sequence; counter-based, no state.
//!
//! Each request gives the first two dimensions of the Sobol sequence (a (0, 2)-sequence in base 2), its index shuffled
//! and its digits scrambled by hashes of seed and dimension: pairs of dimensions are padded, each pair stratified on
//! its own. Point `i` depends on `(seed, stream, dimension, i)` alone, never on who asks.
//!
//! Source: Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, with the hash of Vegdahl, "Building a
//! Better LK Hash", 2021; deviates: two padded dimensions of closed form instead of four by table.

/// One reproducible sequence of sample points: a light's photons, or a pixel's rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    seed: u32,
}

/// One point of a [`Sequence`]; its dimensions are taken in order.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    seed: u32,
    reversed_index: u32,
    dimension: u32,
}

impl Sequence {
    /// The sequence named by `seed` and `stream`; different streams are scrambled independently.
    pub fn new(seed: u64, stream: u32) -> Self {
        let low = mix(seed as u32 ^ mix(stream.wrapping_add(0x51F3_9D2B)));
        Self { seed: mix((seed >> 32) as u32 ^ low) }
    }

    /// Point `index`. The digits repeat after 2³² points; each further block is scrambled anew.
    #[inline]
    pub fn sample(self, index: u64) -> Sample {
        let block = (index >> 32) as u32;
        let seed = if block == 0 { self.seed } else { mix(self.seed ^ mix(block)) };
        Sample { seed, reversed_index: (index as u32).reverse_bits(), dimension: 0 }
    }
}

/// Many points side by side, all at the same dimension: what [`Sample`] gives one by one, eight at a time where the
/// processor can.
#[derive(Clone, Debug, Default)]
pub struct SampleBlock {
    seeds: Vec<u32>,
    reversed_indices: Vec<u32>,
    dimension: u32,
}

impl SampleBlock {
    /// Empties the block and sets the dimension that its points take next.
    pub fn restart(&mut self, dimension: u32) {
        self.seeds.clear();
        self.reversed_indices.clear();
        self.dimension = dimension;
    }

    /// Adds a point. Its own count of dimensions taken is ignored: the block's counts.
    #[inline]
    pub fn push(&mut self, sample: Sample) {
        self.seeds.push(sample.seed);
        self.reversed_indices.push(sample.reversed_index);
    }

    /// Point `i`, at the block's dimension.
    #[inline]
    pub fn get(&self, i: usize) -> Sample {
        Sample { seed: self.seeds[i], reversed_index: self.reversed_indices[i], dimension: self.dimension }
    }

    /// Number of dimensions that the block's points have taken.
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// Passes over a dimension that nobody needs.
    pub fn skip_dimension(&mut self) {
        self.dimension = self.dimension.wrapping_add(1);
    }

    /// [`Sample::next_1d`] of every point into `numbers`, one for each.
    pub fn next_1d(&mut self, numbers: &mut Vec<f32>) {
        numbers.clear();
        numbers.resize(self.seeds.len(), 0.0);
        let offset = dimension_offset(self.dimension);
        let points = self.seeds.iter().zip(&self.reversed_indices);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (number, (&seed, &reversed)) in numbers.iter_mut().zip(points) {
                    let (hash, index) = shuffle(seed, offset, reversed);
                    *number = scramble(index, hash.wrapping_mul(FIRST));
                }
            },
        );
        self.dimension = self.dimension.wrapping_add(1);
    }

    /// [`Sample::next_2d`] of every point, the first numbers into `first`, the second into `second`.
    pub fn next_2d(&mut self, first: &mut Vec<f32>, second: &mut Vec<f32>) {
        for numbers in [&mut *first, &mut *second] {
            numbers.clear();
            numbers.resize(self.seeds.len(), 0.0);
        }
        let offset = dimension_offset(self.dimension);
        let points = self.seeds.iter().zip(&self.reversed_indices);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for ((a, b), (&seed, &reversed)) in first.iter_mut().zip(second.iter_mut()).zip(points) {
                    let (hash, index) = shuffle(seed, offset, reversed);
                    *a = scramble(index, hash.wrapping_mul(FIRST));
                    *b = scramble(pascal(index), hash.wrapping_mul(SECOND));
                }
            },
        );
        self.dimension = self.dimension.wrapping_add(1);
    }
}

impl Sample {
    /// The next number in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let (hash, index) = self.next_dimension();
        scramble(index, hash.wrapping_mul(FIRST))
    }

    /// The next two numbers in [0, 1), stratified together.
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        let (hash, index) = self.next_dimension();
        [
            scramble(index, hash.wrapping_mul(0x85EB_CA6B)),
            scramble(pascal(index), hash.wrapping_mul(0xC2B2_AE35)),
        ]
    }

    /// A hash for the next dimension, and the sample's index shuffled by it.
    #[inline]
    fn next_dimension(&mut self) -> (u32, u32) {
        let offset = dimension_offset(self.dimension);
        self.dimension = self.dimension.wrapping_add(1);
        shuffle(self.seed, offset, self.reversed_index)
    }
}

/// Factors that make two scrambles of one hash.
const FIRST: u32 = 0x85EB_CA6B;
const SECOND: u32 = 0xC2B2_AE35;

/// What tells a dimension's hash from those of its neighbours.
#[inline(always)]
fn dimension_offset(dimension: u32) -> u32 {
    dimension.wrapping_mul(0x9E37_79B9)
}

/// The hash of a dimension, and a point's index shuffled by it.
#[inline(always)]
fn shuffle(seed: u32, offset: u32, reversed_index: u32) -> (u32, u32) {
    let hash = mix(seed.wrapping_add(offset));
    (hash, laine_karras(reversed_index, hash).reverse_bits())
}

/// The van der Corput sequence in base 2: Sobol's first dimension, not scrambled.
#[inline]
pub fn van_der_corput(index: u32) -> f32 {
    unit(index.reverse_bits())
}

/// Owen-scrambles digits given least significant first, and maps them to [0, 1).
#[inline(always)]
fn scramble(reversed_digits: u32, seed: u32) -> f32 {
    unit(laine_karras(reversed_digits, seed).reverse_bits())
}

/// Pascal's triangle modulo 2 times `index`: the digits, least significant first, of Sobol's second dimension.
///
/// Bit j is the parity of the bits k of `index` with C(k, j) odd, which by Lucas' theorem are the supersets k ⊇ j:
/// a sum over supersets, one step for each of the five bits of an index of a bit.
#[inline(always)]
fn pascal(index: u32) -> u32 {
    let mut x = index;
    x ^= (x >> 1) & 0x5555_5555;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 4) & 0x0F0F_0F0F;
    x ^= (x >> 8) & 0x00FF_00FF;
    x ^= (x >> 16) & 0x0000_FFFF;
    x
}

/// A bijection in which bit k of the result depends on bits 0..=k of `x` only: an Owen scramble of reversed digits.
#[inline(always)]
fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    x ^= x.wrapping_mul(0x53A2_2864);
    x
}

/// A 32-bit finaliser ("lowbias32" of Wellons' hash prospector).
#[inline(always)]
fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7FEB_352D);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

#[inline(always)]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_dimension_matches_its_direction_numbers() {
        let mut v = [1u32 << 31; 32];
        for k in 1..32 {
            v[k] = v[k - 1] ^ (v[k - 1] >> 1);
        }
        for index in (0..100_000u32).chain([u32::MAX, 0x8000_0000, 0xDEAD_BEEF]) {
            let by_table = (0..32).filter(|k| index >> k & 1 == 1).fold(0, |x, k| x ^ v[k]);
            assert_eq!(pascal(index).reverse_bits(), by_table);
        }
    }

    /// A (0, 2)-sequence puts exactly one of every 2^m consecutive aligned points into each elementary interval, and
    /// Owen scrambling keeps that: the defining property, for each of the first 8 requests and three seeds.
    #[test]
    fn every_elementary_interval_holds_one_point() {
        const M: u32 = 8;
        for seed in [0u64, 1, 0xFEED_FACE_CAFE_BEEF] {
            for dimension in 0..8 {
                for block in [0u64, 5, (1 << 32) >> M] {
                    let points: Vec<[f32; 2]> = (0..1u64 << M)
                        .map(|i| {
                            let mut sample = Sequence::new(seed, 3).sample((block << M) + i);
                            (0..dimension).for_each(|_| _ = sample.next_2d());
                            sample.next_2d()
                        })
                        .collect();
                    for a in 0..=M {
                        let mut seen = vec![false; 1 << M];
                        for p in &points {
                            let x = (p[0] * (1 << a) as f32) as usize;
                            let y = (p[1] * (1 << (M - a)) as f32) as usize;
                            let cell = &mut seen[x << (M - a) | y];
                            assert!(!*cell, "two points in one interval");
                            *cell = true;
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_block_gives_what_its_points_give() {
        let sequence = Sequence::new(5, 6);
        // Across the end of the first 2³² points, and not a multiple of any vector's length.
        let mut one_by_one: Vec<Sample> =
            ((1u64 << 32) - 500..(1 << 32) + 531).map(|i| sequence.sample(i)).collect();
        let mut block = SampleBlock::default();
        block.restart(0);
        one_by_one.iter().for_each(|&s| block.push(s));
        let (mut a, mut b) = (vec![], vec![]);
        for _ in 0..5 {
            block.next_1d(&mut a);
            assert!(one_by_one.iter_mut().zip(&a).all(|(s, &x)| s.next_1d() == x));
            block.next_2d(&mut a, &mut b);
            assert!(one_by_one.iter_mut().zip(a.iter().zip(&b)).all(|(s, (&x, &y))| s.next_2d() == [x, y]));
            assert_eq!(block.get(7).next_1d(), one_by_one[7].clone().next_1d());
        }
    }

    #[test]
    fn dimensions_and_streams_are_uncorrelated() {
        // Correlation of N = 65 536 padded pairs: σ = 1/√N = 0.0039 for independent numbers; 5 σ.
        let n = 1 << 16;
        let correlation = |f: &dyn Fn(u64) -> (f32, f32)| {
            (0..n).map(f).map(|(a, b)| (f64::from(a) - 0.5) * (f64::from(b) - 0.5) * 12.0).sum::<f64>()
                / n as f64
        };
        let pair = |i: u64, stream: u32, skip: u32| {
            let mut s = Sequence::new(7, stream).sample(i);
            (0..skip).for_each(|_| _ = s.next_2d());
            s.next_2d()
        };
        for skip in 1..6 {
            assert!(correlation(&|i| (pair(i, 0, 0)[0], pair(i, 0, skip)[0])).abs() < 0.02);
            assert!(correlation(&|i| (pair(i, 0, 0)[1], pair(i, skip, 0)[1])).abs() < 0.02);
        }
    }

    #[test]
    fn numbers_stay_below_one_and_depend_on_the_counter_alone() {
        assert_eq!(unit(u32::MAX), crate::sampling::ONE_MINUS_EPSILON);
        let sequence = Sequence::new(1, 2);
        let mut a = sequence.sample(12345);
        let mut b = sequence.sample(12345);
        assert_eq!((a.next_1d(), a.next_2d()), (b.next_1d(), b.next_2d()));
        assert_ne!(sequence.sample(1).next_2d(), sequence.sample(1 + (1 << 32)).next_2d());
    }
}
