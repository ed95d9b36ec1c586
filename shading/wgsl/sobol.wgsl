// Turns a sample index and a dimension into a point of an Owen-scrambled Sobol sequence; twin of sobol.rs.

struct SobolSample {
    seed: u32,
    reversed_index: u32,
    dimension: u32,
}

// The sequence named by seed (low and high half) and stream.
fn sobol_sequence(seed_low: u32, seed_high: u32, stream: u32) -> u32 {
    let low = sobol_mix(seed_low ^ sobol_mix(stream + 0x51F39D2Bu));
    return sobol_mix(seed_high ^ low);
}

fn sobol_sample(sequence: u32, index: u32) -> SobolSample {
    return SobolSample(sequence, reverseBits(index), 0u);
}

// Two numbers in [0, 1) of the sample's dimension; the caller counts dimensions.
fn sobol_2d(sample: SobolSample) -> vec2f {
    let hash = sobol_mix(sample.seed + sample.dimension * 0x9E3779B9u);
    let index = reverseBits(sobol_laine_karras(sample.reversed_index, hash));
    return vec2f(
        sobol_scramble(index, hash * 0x85EBCA6Bu),
        sobol_scramble(sobol_pascal(index), hash * 0xC2B2AE35u),
    );
}

fn sobol_scramble(reversed_digits: u32, seed: u32) -> f32 {
    return sobol_unit(reverseBits(sobol_laine_karras(reversed_digits, seed)));
}

fn sobol_pascal(index: u32) -> u32 {
    var x = index;
    x ^= (x >> 1u) & 0x55555555u;
    x ^= (x >> 2u) & 0x33333333u;
    x ^= (x >> 4u) & 0x0F0F0F0Fu;
    x ^= (x >> 8u) & 0x00FF00FFu;
    x ^= (x >> 16u) & 0x0000FFFFu;
    return x;
}

fn sobol_laine_karras(digits: u32, seed: u32) -> u32 {
    var x = digits;
    x ^= x * 0x3D20ADEAu;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526C56u;
    x ^= x * 0x53A22864u;
    return x;
}

fn sobol_mix(value: u32) -> u32 {
    var x = value;
    x ^= x >> 16u;
    x *= 0x7FEB352Du;
    x ^= x >> 15u;
    x *= 0x846CA68Bu;
    return x ^ (x >> 16u);
}

fn sobol_unit(bits: u32) -> f32 {
    return f32(bits >> 8u) * (1.0 / 16777216.0);
}
