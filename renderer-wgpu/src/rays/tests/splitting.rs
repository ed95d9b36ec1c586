//! Turns work that no single dispatch may do into the claim that nothing of it is lost.

use super::*;
use photonstream_scene::{Object, bvh::SceneBvh};

/// 10 000 lights for a tile of 8 × 4 pixels: about 200 000 turns of loops a pixel, three times what Mesa 22 runs in one
/// invocation. Tolerance: rounding of sums of 10 000 terms in f32.
#[test]
fn no_light_of_many_is_lost() {
    let Some(gpu) = gpu() else { return };
    let scene = config("cornell-box.toml");
    let vsls = scattered_vsls(&scene, 10_000);
    let (found, traced) = Picture::new(&gpu, &scene, [8, 4]).indirect(&vsls, 0.0, 0, 0);
    let error = relative_rmse(&found, &expected(&scene, &vsls, [8, 4], LayerKind::Indirect, 1, WHOLE));
    assert!(error <= 1e-3, "{error:e}");
    assert!(traced.dispatches >= 10_000 / 64 && !traced.stopped, "{traced:?}");
}

/// With a budget the weights of all lights are summed first: with nearly as many rays as lights the picture is nearly
/// exact, so none is left out there either. 70 000 lights, of which each pixel asks 16 or so; N = 32 pixels, mean of all.
#[test]
fn no_light_of_many_goes_unweighed() {
    let Some(gpu) = gpu() else { return };
    let scene = config("cornell-box.toml");
    let few = scattered_vsls(&scene, 70);
    // The same lights a thousand times, each of a thousandth of the flux: the same picture.
    let thousand = (0..70_000).filter_map(|i| few.get(i % 70)).map(|v| Vsl { flux: v.flux * 1e-3, ..v });
    let many = VslSet::new(thousand).unwrap();
    let mut picture = Picture::new(&gpu, &scene, [8, 4]);
    let exact = picture.indirect(&few, 0.0, 0, 0).0;
    let found = picture.indirect(&many, 0.0, 2_000, 0).0;
    let sum = |pixels: &[Vec3]| pixels.iter().map(|p| f64::from(p.element_sum())).sum::<f64>();
    // Stratified over lights of equal weight: a light gets its share within one of 2 000 samples, 70 / 2 000 at most.
    assert!((sum(&found) / sum(&exact) - 1.0).abs() < 0.01, "{} of {}", sum(&found), sum(&exact));
}

/// A point light seen through 60 000 triangles that lie before it like the leaves of a book with a corner torn off: a
/// ray through the corner enters every box and hits nothing, in more than 65 535 turns; one beside it is stopped.
#[test]
fn long_rays_are_suspended_and_go_on() {
    let Some(gpu) = gpu() else { return };
    let mut scene = scene(
        r#"
        [camera]
        position_m = [0.5, 0.9, 0.51]
        target_m = [0.5, 0, 0.5]
        vertical_fov_deg = 60
        [material.grey]
        albedo = 0.5
        [object.floor]
        material = "grey"
        quad = { corner_m = [-1, 0, 2], edge_u_m = [3, 0, 0], edge_v_m = [0, 0, -3] }
        [light.lamp]
        power_w = 10
        point = { position_m = [0.5, 500, 0.5] }
        "#,
    );
    const LEAVES: u32 = 60_000;
    let origin = scene.origin_m.as_vec3();
    let mut geometry = (*scene.geometry).clone();
    let mut triangles = geometry.triangles.to_vec();
    for leaf in 0..LEAVES {
        let y = 1.0 + leaf as f32 / LEAVES as f32;
        let first = geometry.vertices.len() as u32;
        geometry
            .vertices
            .extend([(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, z)| Vec3::new(x, y, z) - origin));
        triangles.push([first, first + 1, first + 2]);
        geometry.normals.push(Vec3::NEG_Y);
    }
    geometry.rest_vertices = geometry.vertices.clone().into();
    geometry.object_of = vec![geometry.object_of[0]; triangles.len()].into();
    geometry.triangles = triangles.into();
    let all = 0..geometry.triangles.len() as u32;
    let floor: &mut Object = &mut scene.objects[0];
    floor.triangles = all.clone();
    scene.bvh = SceneBvh::build(&geometry.vertices, &geometry.triangles, &[all]);
    scene.geometry = Arc::new(geometry);
    let size = [16, 12];
    let (found, traced) = Picture::new(&gpu, &scene, size).direct(&scene, 1);
    let reference = expected(&scene, &VslSet::default(), size, LayerKind::Direct, 1, WHOLE);
    let lit = reference.iter().filter(|e| e.is_some_and(|e| e != Vec3::ZERO)).count();
    assert!(lit > 20 && lit < reference.len() - 20, "{lit} of {} pixels are lit", reference.len());
    let error = relative_rmse(&found, &reference);
    assert!(error <= 1e-3, "{error:e}");
    assert!(traced.dispatches > u64::from(65_535 / RAY_TURNS), "{traced:?}");
    assert_eq!(traced.rays, reference.iter().flatten().count() as u64, "a suspended ray is one ray");
}

/// Bands of rows give the same bits as one band; an odd size, so that the last band and the last groups are partial.
#[test]
fn bands_of_rows_make_one_picture() {
    let Some(gpu) = gpu() else { return };
    let scene = config("two-rooms.toml");
    let vsls = scattered_vsls(&scene, 100);
    let size = [37, 23];
    let mut picture = Picture::new(&gpu, &scene, size);
    for budget in [0, 8] {
        picture.rays.band_bytes = 64 << 20;
        picture.rays.workspace = None;
        let whole = picture.indirect(&vsls, 0.0, budget, 3).0;
        let noise = picture.rays.noise(&gpu).unwrap();
        picture.rays.restart_noise();
        picture.rays.band_bytes = 5 * 37 * u64::from(RAY_STACK) * 8;
        picture.rays.workspace = None;
        let banded = picture.indirect(&vsls, 0.0, budget, 3).0;
        assert_eq!(whole, banded, "{budget}");
        assert_eq!(noise, picture.rays.noise(&gpu).unwrap());
        picture.rays.restart_noise();
    }
}
