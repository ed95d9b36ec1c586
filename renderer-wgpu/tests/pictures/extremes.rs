//! Impossible values, no light, very many lights, very small and very large pictures.

use crate::scenes::{self, LAMPS, Lit, layer};
use photonstream_protocol::VslRecord;
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Accumulation, GpuError, Renderer, Show, View};
use photonstream_shading::Kernel;

fn room(vsls: u32) -> Lit {
    scenes::cornell(LAMPS[1].1, &format!("vsls = {vsls}\npool_paths = 4096"))
}

/// Values that no simulator publishes never reach a pixel: the other lights' picture is what is shown, bit for bit,
/// and the records are counted.
#[test]
fn impossible_records_never_reach_a_pixel() {
    let mut lit = room(200);
    let dark = |r: &mut VslRecord| r.flux = [0.0; 3];
    let bad: [fn(&mut VslRecord); 12] = [
        |r| r.flux[0] = f32::NAN,
        |r| r.flux[1] = f32::INFINITY,
        |r| r.flux[2] = f32::NEG_INFINITY,
        |r| r.flux[0] = -1.0,
        |r| r.flux[1] = f32::MAX,
        |r| r.position[0] = f32::NAN,
        |r| r.position[2] = f32::INFINITY,
        |r| r.position[1] = f32::MAX,
        |r| r.normal = [f32::NAN; 3],
        |r| r.normal = [1.0; 3],
        |r| r.area = f32::NAN,
        |r| r.area = -1.0,
    ];
    for accumulation in Accumulation::ALL {
        let view = View { accumulation: *accumulation, ..lit.view(48, 48) };
        let Some(mut renderer) = lit.renderer() else { return };
        let mut without = lit.frame.clone();
        let mut with = lit.frame.clone();
        for (i, spoil) in bad.iter().enumerate() {
            dark(&mut without.vsls[i * 7]);
            spoil(&mut with.vsls[i * 7]);
        }
        (without.epoch, with.epoch) = (2, 3);
        renderer.set_frame(&without).unwrap();
        let expected = layer(&mut renderer, &view, LayerKind::Full);
        renderer.set_frame(&with).unwrap();
        let found = layer(&mut renderer, &view, LayerKind::Full);
        assert_eq!(found, expected, "{accumulation}");
        assert_eq!(renderer.refused_records().unwrap(), bad.len() as u32);
        for kind in [LayerKind::Vsl, LayerKind::Flux] {
            assert!(layer(&mut renderer, &view, kind).iter().all(|p| p.is_finite()), "{kind}");
        }
        for show in [Show::Discs, Show::Age, Show::Tiles] {
            renderer.draw(&View { show, ..view }).unwrap();
            assert!(renderer.pixels().unwrap().iter().all(|p| p.is_finite()), "{show:?}");
        }
    }
    // Every light as bright as may be published, and none with an area: the sum overflows, the picture does not.
    lit.frame.vsls.iter_mut().for_each(|r| (r.flux, r.area) = ([1e30; 3], 0.0));
    let Some(mut renderer) = lit.renderer() else { return };
    let view = lit.view(48, 48);
    let blinding = layer(&mut renderer, &view, LayerKind::Full);
    assert!(blinding.iter().all(|p| p.is_finite()) && blinding.iter().any(|p| p.x > 1e20));
}

/// No light at all is black, one light lights, 100 000 are as bright as 500 of the same sum. 32 × 32 pixels. Kernel `disc`: these
/// lights come without patches.
#[test]
fn no_light_one_light_and_a_hundred_thousand() {
    let lit = room(500);
    let Some(mut renderer) = lit.renderer() else { return };
    let view = View { kernel: Kernel::Disc, ..lit.view(32, 32) };
    let indirect = layer(&mut renderer, &view, LayerKind::Indirect);
    let mut frame = lit.frame.clone();
    let mut show = |renderer: &mut Renderer, vsls: Vec<VslRecord>, view: &View| {
        (frame.vsls, frame.epoch) = (vsls, frame.epoch + 1);
        renderer.set_frame(&frame).unwrap();
        layer(renderer, view, LayerKind::Indirect)
    };
    let nothing = show(&mut renderer, Vec::new(), &view);
    assert!(nothing.iter().all(|p| *p == glam::Vec3::ZERO));
    let brightest = *lit.frame.vsls.iter().max_by(|a, b| a.flux[0].total_cmp(&b.flux[0])).unwrap();
    let one = show(&mut renderer, vec![brightest], &view);
    assert!(one.iter().any(|p| p.x > 0.0) && one.iter().zip(&indirect).all(|(a, b)| a.x <= b.x * 1.0001));
    // Each light 200 times, with a 200th of its flux. A range is a share of the flux: none here.
    let many: Vec<_> = (0..100_000)
        .map(|i| {
            let mut record = lit.frame.vsls[i % lit.frame.vsls.len()];
            record.flux = record.flux.map(|f| f * (lit.frame.vsls.len() as f32 / 100_000.0));
            record
        })
        .collect();
    let found = show(&mut renderer, many, &view);
    // 100 000 additions in f32 round off 1e-4 at most.
    let error = scenes::rel_rmse(&found, &indirect, |_| true);
    assert!(error < 2e-4, "{error:e}");
}

/// Pictures of odd sizes are parts of the plane as the camera's formula says; a huge one is drawn or refused with its
/// limit, and the renderer goes on.
#[test]
fn odd_tiny_and_huge_pictures() {
    let lit = room(50);
    let Some(mut renderer) = lit.renderer() else { return };
    for (width, height) in [(1, 1), (1, 33), (257, 3), (17, 31)] {
        let view = lit.view(width, height);
        let found = layer(&mut renderer, &view, LayerKind::Depth);
        assert_eq!(found.len(), (width * height) as usize);
        let expected = lit.on_cpu(&view, &[LayerKind::Depth]).remove(0);
        let off = found.iter().zip(&expected).filter(|(a, b)| (**a - **b).x.abs() > 1e-4 * b.x).count();
        assert!(off * 100 <= found.len(), "{width}x{height}: {off}");
        for accumulation in Accumulation::ALL {
            let lit_pixels =
                layer(&mut renderer, &View { accumulation: *accumulation, ..view }, LayerKind::Full);
            assert!(lit_pixels.iter().all(|p| p.is_finite()));
        }
    }
    let huge = View { width: 7680, height: 4320, ..lit.view(1, 1) };
    match renderer.draw(&View { show: Show::Layer(LayerKind::Depth), ..huge }) {
        Ok(_) => {
            let pixels = renderer.pixels().unwrap();
            assert_eq!(pixels.len(), 7680 * 4320);
            let small = lit.view(1, 1);
            let centre = layer(&mut renderer, &small, LayerKind::Depth)[0];
            assert!((pixels[2160 * 7680 + 3840].x / centre.x - 1.0).abs() < 1e-3);
        }
        Err(GpuError::TooLarge { .. } | GpuError::OutOfMemory { .. }) => {}
        Err(error) => panic!("{error}"),
    }
    let beyond = View { width: 1 << 20, ..lit.view(1, 1) };
    let error = renderer.draw(&beyond).unwrap_err().to_string();
    assert!(error.contains("expected at most") && error.contains("--size"), "{error}");
    for wrong in [
        View { width: 0, ..huge },
        View { epsilon: f32::NAN, ..huge },
        View { interleave: 3, ..huge },
        View { interleave: 2, accumulation: Accumulation::Splat, ..huge },
    ] {
        assert!(matches!(renderer.draw(&wrong), Err(GpuError::Option { .. })));
    }
    assert!(layer(&mut renderer, &lit.view(8, 8), LayerKind::Full).iter().any(|p| p.x > 0.0));
}
