//! Shader twins of Rust functions give the same numbers on the device.

use glam::{Vec2, Vec3};
use photonstream_renderer_wgpu::{Gpu, test_gpu};
use photonstream_shading::{
    Camera, Kernel, LightShape, basis, culling, octahedral, sampling,
    sobol::Sequence,
    tone::{self, ToneMap},
    wgsl,
};

/// Inputs of each twin.
const N: usize = 4096;

/// Evaluates `body` (WGSL statements that turn `x: array<f32, 16>` into `y: array<f32, 4>`) on the device for each input.
fn on_device(gpu: &Gpu, parts: &[&str], body: &str, inputs: &[[f32; 16]]) -> Vec<[f32; 4]> {
    let text = format!(
        "{}\n{}\n@group(0) @binding(0) var<storage, read> inputs: array<array<f32, 16>>;
@group(0) @binding(1) var<storage, read_write> outputs: array<array<f32, 4>>;
@compute @workgroup_size(64) fn evaluate(@builtin(global_invocation_id) id: vec3u) {{
    let x = inputs[id.x];
    var y = array<f32, 4>();
    {body}
    outputs[id.x] = y;
}}",
        wgsl::constants(),
        parts.join("\n")
    );
    let device = &gpu.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("evaluate"),
        compilation_options: Default::default(),
        cache: None,
    });
    let buffer = |size: usize, usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: size as u64,
            usage,
            mapped_at_creation: false,
        })
    };
    use wgpu::BufferUsages as Usage;
    let source = buffer(size_of_val(inputs), Usage::STORAGE | Usage::COPY_DST);
    let bytes = inputs.len() * 16;
    let target = buffer(bytes, Usage::STORAGE | Usage::COPY_SRC);
    let read = buffer(bytes, Usage::COPY_DST | Usage::MAP_READ);
    gpu.queue.write_buffer(&source, 0, bytemuck::cast_slice(inputs));
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: source.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: target.as_entire_binding() },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(inputs.len() as u32 / 64, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&target, 0, &read, 0, bytes as u64);
    gpu.queue.submit([encoder.finish()]);
    read.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait().unwrap();
    let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read.get_mapped_range(..).unwrap());
    found
}

/// Uniform numbers in [0, 1), 16 for each of `N` inputs; seed 9.
pub(crate) fn uniform() -> Vec<[f32; 16]> {
    let inputs = (0..N as u64).map(|i| {
        let mut sample = Sequence::new(9, 0).sample(i);
        std::array::from_fn(|_| sample.next_1d())
    });
    inputs.collect()
}

/// `expected` on this side is `body` on the device: to a relative error of 1e-5 against the size of the result (its
/// largest component, and at least `least`, where results cross zero).
pub(crate) fn check(
    name: &str,
    parts: &[&str],
    body: &str,
    least: f32,
    inputs: &[[f32; 16]],
    expected: impl Fn(&[f32; 16]) -> [f32; 4],
) {
    let Some(gpu) = test_gpu::gpu() else { return };
    let found = on_device(&gpu, parts, body, inputs);
    let mut distinct = 0;
    for (input, found) in inputs.iter().zip(found) {
        let expected = expected(input);
        let size = expected.iter().fold(least, |m, e| m.max(e.abs()));
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() <= 1e-5 * size, "{name} of {input:?}: {found:?}, expected {expected:?}");
        }
        distinct += usize::from(expected != [0.0; 4]);
    }
    assert!(distinct * 4 > inputs.len(), "{name}: hardly an input says anything");
}

pub(crate) fn vector(x: &[f32; 16], at: usize) -> Vec3 {
    Vec3::new(x[at], x[at + 1], x[at + 2])
}

fn direction(x: &[f32; 16], at: usize) -> Vec3 {
    sampling::sphere([x[at], x[at + 1]]).normalize()
}

fn out(v: Vec3, last: f32) -> [f32; 4] {
    [v.x, v.y, v.z, last]
}

#[test]
fn kernel() {
    let inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = [0.0; 16];
            // A light before the receiver that mostly faces it, from near to far.
            let d = direction(x, 0) * (10f32).powf(4.0 * x[2] - 3.0);
            y[..3].copy_from_slice(&d.to_array());
            y[3..6].copy_from_slice(&(d.normalize() + direction(x, 3) * 0.9).normalize().to_array());
            y[6..9].copy_from_slice(&(-d.normalize() + direction(x, 5) * 0.9).normalize().to_array());
            (y[9], y[10], y[11], y[12]) =
                (x[7] * 0.01, x[8], x[9], if x[10] < 0.2 { 0.0 } else { x[11] * 1e-3 });
            y
        })
        .collect();
    let body = "let d = vec3f(x[0], x[1], x[2]);
        y[0] = kernel_transfer(d, vec3f(x[3], x[4], x[5]), vec3f(x[6], x[7], x[8]), x[9]);";
    check("kernel_transfer", &[wgsl::KERNEL], body, 1e-6, &inputs, |x| {
        [Kernel::Disc.transfer(vector(x, 0), vector(x, 3), vector(x, 6), x[9]), 0.0, 0.0, 0.0]
    });
    check(
        "kernel_range_sq",
        &[wgsl::KERNEL],
        "y[0] = kernel_range_sq(x[10], x[11], x[12]);",
        0.0,
        &inputs,
        |x| {
            let range = photonstream_shading::kernel::range_sq(x[10], x[11], x[12]);
            [range.min(f32::MAX), 0.0, 0.0, 0.0]
        },
    );
}

#[test]
fn camera() {
    let eye = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-0.3, 0.2, 0.1), Vec3::Y, 55.0).unwrap();
    let inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = *x;
            y[3..6].copy_from_slice(&eye.forward.to_array());
            y[6..9].copy_from_slice(&eye.right.to_array());
            y[9..12].copy_from_slice(&eye.up.to_array());
            (y[0], y[1]) = (x[0] * 640.0, x[1] * 480.0);
            y
        })
        .collect();
    let body = format!(
        "let camera = Camera(vec3f(0.0), {:?}f, vec3f(x[3], x[4], x[5]), 0.0, vec3f(x[6], x[7], x[8]), 0.0, vec3f(x[9], x[10], x[11]), 0.0);
        let d = camera_direction(camera, vec2f(x[0], x[1]), vec2u(640u, 480u));
        y = array<f32, 4>(d.x, d.y, d.z, 0.0);",
        eye.tan_half_fov
    );
    check("camera_direction", &[wgsl::CAMERA], &body, 0.0, &inputs, |x| {
        out(eye.direction(x[0], x[1], 640, 480), 0.0)
    });
}

#[test]
fn octahedral_normals() {
    let inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = [0.0; 16];
            y[..3].copy_from_slice(&direction(x, 0).to_array());
            (y[3], y[4]) = (2.0 * x[2] - 1.0, 2.0 * x[3] - 1.0);
            y
        })
        .collect();
    let body = "let p = octahedral_encode(vec3f(x[0], x[1], x[2])); y = array<f32, 4>(p.x, p.y, 0.0, 0.0);";
    check("octahedral_encode", &[wgsl::OCTAHEDRAL], body, 0.0, &inputs, |x| {
        let p = octahedral::encode(vector(x, 0));
        [p.x, p.y, 0.0, 0.0]
    });
    let body = "let n = octahedral_decode(vec2f(x[3], x[4])); y = array<f32, 4>(n.x, n.y, n.z, 0.0);";
    check("octahedral_decode", &[wgsl::OCTAHEDRAL], body, 0.0, &inputs, |x| {
        out(octahedral::decode(Vec2::new(x[3], x[4])), 0.0)
    });
}

/// Lots are the same bit for bit, N = 4 096 indices and beginnings as halves of 16 bits, and beginnings of all ones, zeros and
/// each length between; what depends on the distance within 1e-6, a few roundings.
#[test]
fn lots() {
    let mut inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = *x;
            (0..4).for_each(|i| y[i] = (x[i] * 65_536.0).floor());
            (y[4], y[5], y[6]) = (x[4] * 10.0, x[5] * 30.0, if x[6] < 0.2 { 0.0 } else { x[6] * 1e-2 });
            (y[7], y[8]) = (x[7] * 5.0, x[7] * 5.0 + x[8] * 10.0);
            y
        })
        .collect();
    for (bit, x) in (0..=32u32).zip(&mut inputs) {
        let first = u32::MAX.checked_shr(bit).unwrap_or(0);
        x[..4].copy_from_slice(&[(first >> 16) as f32, (first & 0xffff) as f32, 0.0, 0.0]);
    }
    let Some(gpu) = test_gpu::gpu() else { return };
    let body = "let first = u32(x[0]) << 16u | u32(x[1]);
        y[0] = culling_lot(u32(x[2]) << 16u | u32(x[3]), first);";
    let found = on_device(&gpu, &[wgsl::CULLING], body, &inputs);
    let whole = |high: f32, low: f32| (high as u32) << 16 | low as u32;
    for (found, x) in found.iter().zip(&inputs) {
        let expected = culling::lot(whole(x[2], x[3]), whole(x[0], x[1]));
        assert_eq!(found[0].to_bits(), expected.to_bits(), "{x:?}: {} against {expected}", found[0]);
    }
    let body = "y[0] = culling_weight(x[4], x[5], x[6]); y[1] = culling_greatest_variance(x[4], x[7], x[8]);";
    check("culling_weight", &[wgsl::CULLING], body, 1e-6, &inputs, |x| {
        [culling::weight(x[4], x[5], x[6]), culling::greatest_variance(x[4], x[7], x[8]), 0.0, 0.0]
    });
}

/// Samples are the same bit for bit: nothing in them rounds.
#[test]
fn sobol() {
    let inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = *x;
            for (i, scale) in [(0, 4e9f32), (1, 4e9), (2, 1e6), (3, 1e6), (4, 6.0)] {
                y[i] = f32::from_bits((x[i] * scale) as u32);
            }
            y
        })
        .collect();
    let body = "let bits = bitcast<vec4u>(vec4f(x[0], x[1], x[2], x[3]));
        var s = sobol_sample(sobol_sequence(bits.x, bits.y, bits.z), bits.w);
        s.dimension = bitcast<u32>(x[4]);
        let p = sobol_2d(s);
        y = array<f32, 4>(p.x, p.y, 0.0, 0.0);";
    let expected = |x: &[f32; 16]| {
        let seed = u64::from(x[0].to_bits()) | u64::from(x[1].to_bits()) << 32;
        let mut sample = Sequence::new(seed, x[2].to_bits()).sample(x[3].to_bits().into());
        (0..x[4].to_bits()).for_each(|_| {
            sample.next_1d();
        });
        let [a, b] = sample.next_2d();
        [a, b, 0.0, 0.0]
    };
    check("sobol_2d", &[wgsl::SOBOL], body, 0.0, &inputs, expected);
    let Some(gpu) = test_gpu::gpu() else { return };
    let found = on_device(&gpu, &[wgsl::SOBOL], body, &inputs);
    let exact = found.iter().zip(&inputs).filter(|(f, x)| **f == expected(x)).count();
    // Bit patterns that are no numbers, or too small for the device's floats, may not survive the way there.
    assert!(exact * 10 >= N * 9, "{exact}");
}

#[test]
fn tone() {
    let inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = *x;
            for c in &mut y[..3] {
                *c = 10f32.powf(8.0 * *c - 5.0);
            }
            (y[3], y[4]) = ((x[3] * 3.0).floor(), 8.0 * x[4] - 4.0);
            y
        })
        .collect();
    let body = "let c = tone_apply(u32(x[3]), vec3f(x[0], x[1], x[2]), x[4]); y = array<f32, 4>(c.x, c.y, c.z, 0.0);";
    check("tone_apply", &[wgsl::TONE], body, 1e-3, &inputs, |x| {
        out(ToneMap::ALL[x[3] as usize].apply(vector(x, 0), x[4]), 0.0)
    });
    // Rust rounds to 8 bits: half a step, and the rounding of pow.
    let Some(gpu) = test_gpu::gpu() else { return };
    let unit = uniform();
    let body = "let c = tone_to_srgb(vec3f(x[0], x[1], x[2])); y = array<f32, 4>(c.x, c.y, c.z, 0.0);";
    for (x, found) in unit.iter().zip(on_device(&gpu, &[wgsl::TONE], body, &unit)) {
        let expected = tone::to_srgb8(vector(x, 0));
        for (f, e) in found.iter().zip(expected) {
            assert!((f * 255.0 - f32::from(e)).abs() <= 0.501, "{x:?}: {found:?} {expected:?}");
        }
    }
}

#[test]
fn light() {
    let shapes: Vec<(LightShape, [f32; 8])> = vec![
        (LightShape::Point { position: Vec3::new(0.1, 1.9, 0.3) }, [0.0; 8]),
        (
            LightShape::Spot {
                position: Vec3::new(0.1, 1.9, 0.3),
                direction: Vec3::new(0.36, -0.8, 0.48),
                versine_inner: 0.1,
                versine_outer: 0.6,
            },
            [0.0; 8],
        ),
        (LightShape::Directional { direction: Vec3::new(0.36, -0.8, 0.48) }, [0.0; 8]),
        (
            LightShape::Parallelogram {
                corner: Vec3::new(-0.3, 1.9, -0.2),
                edge_u: Vec3::new(0.6, 0.0, 0.0),
                edge_v: Vec3::new(0.0, 0.1, 0.5),
            },
            [0.0; 8],
        ),
        (
            LightShape::Triangle {
                corner: Vec3::new(-0.3, 1.9, -0.2),
                edge_u: Vec3::new(0.6, 0.0, 0.0),
                edge_v: Vec3::new(0.0, 0.1, 0.5),
            },
            [0.0; 8],
        ),
    ];
    for (shape, _) in shapes {
        let inputs: Vec<_> = uniform()
            .iter()
            .map(|x| {
                let mut y = *x;
                (y[0], y[1], y[2]) = (2.0 * x[0] - 1.0, 1.7 * x[1], 2.0 * x[2] - 1.0);
                y
            })
            .collect();
        let body = format!(
            "let light = {};
            let found = light_illuminate(light, vec3f(x[0], x[1], x[2]), vec2f(x[3], x[4]));
            if found.irradiance > 0.0 {{
                y = array<f32, 4>(found.wi.x, found.wi.y, found.wi.z, found.irradiance);
            }}",
            literal(&shape)
        );
        let name = format!("light_illuminate of kind {}", wgsl::light_kind(&shape));
        // Where a beam ends, the last bit decides between nothing and next to nothing.
        check(&name, &[wgsl::LIGHT], &body, 1.0, &inputs, |x| {
            shape.illuminate(vector(x, 0), [x[3], x[4]]).map_or([0.0; 4], |i| out(i.wi, i.irradiance.x))
        });
    }
}

/// A light as a WGSL expression.
fn literal(shape: &LightShape) -> String {
    let v = |v: Vec3| format!("vec3f({:?}f, {:?}f, {:?}f)", v.x, v.y, v.z);
    let (mut position, mut direction, mut edges, mut versines, mut offset) =
        (Vec3::ZERO, Vec3::ZERO, [Vec3::ZERO; 2], [0.0f32; 2], 0.0f32);
    match *shape {
        LightShape::Point { position: p } => position = p,
        LightShape::Spot { position: p, direction: d, versine_inner, versine_outer } => {
            (position, direction, versines) = (p, d, [versine_inner, versine_outer]);
        }
        LightShape::Directional { direction: d } => direction = d,
        LightShape::Sky { .. } | LightShape::Mesh { .. } => {
            panic!("skies and meshes are many lights in shaders")
        }
        LightShape::Parallelogram { corner, edge_u, edge_v }
        | LightShape::Triangle { corner, edge_u, edge_v } => {
            (position, direction, edges) = (corner, shape.emitter_normal(), [edge_u, edge_v]);
            let corners = [corner, corner + edge_u, corner + edge_v];
            let magnitude = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f32::max);
            offset = magnitude * photonstream_shading::surface::RELATIVE_OFFSET;
        }
    }
    format!(
        "Light({}, {}u, {}, {:?}f, {}, {:?}f, {}, {:?}f, vec3f(1.0), 0u, 0u, 0u, 0u, 0u)",
        v(position),
        wgsl::light_kind(shape),
        v(direction),
        versines[0],
        v(edges[0]),
        versines[1],
        v(edges[1]),
        offset
    )
}

/// Quadrilaterals before, across and below a receiver's horizon, from a thousandth of their size away to ten sizes. The sum over
/// edges cancels in thin slices of light: against 0.01.
#[test]
fn patch() {
    let inputs: Vec<_> = uniform()
        .iter()
        .map(|x| {
            let mut y = [0.0; 16];
            let normal = direction(x, 0);
            let (u, v) = basis::tangents(normal);
            // Counter-clockwise as the lit side sees them, around a place before which the receiver lies.
            let away = direction(x, 2) * (10f32).powf(4.0 * x[4] - 3.0);
            let centre = away - normal * (normal.dot(away) + 0.001 + away.length());
            for (k, (a, b)) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate() {
                let corner = centre + u * a * (0.5 + x[5]) + v * b * (0.5 + x[6]);
                y[3 * k..3 * k + 3].copy_from_slice(&corner.to_array());
            }
            y[12..15].copy_from_slice(&direction(x, 7).to_array());
            y
        })
        .collect();
    let body = "for (var i = 0u; i < 4u; i++) {
            patch_corners[i] = vec3f(x[3u * i], x[3u * i + 1u], x[3u * i + 2u]);
        }
        y[0] = patch_form_factor(4u, vec3f(x[12], x[13], x[14]));";
    check("patch_form_factor", &[wgsl::PATCH], body, 0.01, &inputs, |x| {
        let corners = [0, 3, 6, 9].map(|at| vector(x, at));
        let mut middle = Vec3::ZERO;
        [photonstream_shading::patch::form_factor(&corners, vector(x, 12), &mut middle), 0.0, 0.0, 0.0]
    });
}
