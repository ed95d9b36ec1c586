//! Turns files of owners that were kept, broken and forged into what is computed without them.

use super::*;
use crate::vsl::VslId;
use photonstream_scene::{SceneConfig, Side};
use proptest::prelude::*;
use std::{fs, path::Path, sync::Arc};

/// A box seen from within, a ball, and a slanted quad of two sides, with `vsls` lights of a seed.
fn scene(vsls: u32, seed: u64, ball_scale: f64) -> Arc<Scene> {
    let text = format!(
        "camera = {{ position_m = [0, 0, 3], target_m = [0, 0, 0], vertical_fov_deg = 40 }}
        material.grey.albedo = 0.5
        streaming = {{ vsls = {vsls}, seed = {seed} }}
        light.lamp = {{ power_w = 1, point = {{ position_m = [0, 0.9, 0] }} }}
        object.ball = {{ material = \"grey\", scale = {ball_scale}, sphere = {{ radius_m = 0.4, segments = 9 }} }}
        object.room = {{ material = \"grey\", sides = \"back\", box = {{ size_m = [2, 2, 2] }} }}
        [object.slant]
        material = \"grey\"
        sides = \"both\"
        quad = {{ corner_m = [0.5, 0.1, 0.3], edge_u_m = [0.3, 0.2, 0], edge_v_m = [0, 0.3, 0.4] }}"
    );
    Arc::new(SceneConfig::from_text(&text, Path::new("x.toml")).unwrap().build().unwrap())
}

/// A cache of scenes of any size.
fn cache(folder: &Path) -> OwnerCache {
    OwnerCache { from: (0, 0), ..OwnerCache::new(folder.join("made/when/needed")) }
}

fn with(cache: &OwnerCache, scene: &Scene) -> (Placement, OwnerTable) {
    let mut placement = Placement::new(scene);
    let owners = cache.owners(scene, &mut placement, &Cancel::default()).unwrap();
    (placement, owners)
}

fn without(scene: &Scene) -> (Placement, OwnerTable) {
    let mut placement = Placement::new(scene);
    let owners = computed(scene, &mut placement, &Cancel::default()).unwrap();
    (placement, owners)
}

/// What the cache makes of the file of a scene when it is read alone.
fn found(cache: &OwnerCache, scene: &Scene) -> Option<(Placement, OwnerTable)> {
    let mut placement = Placement::new(scene);
    let key = key(scene, &placement);
    let owners = cache.find(&key, scene, &mut placement)?;
    Some((placement, owners))
}

fn files(cache: &OwnerCache) -> Vec<PathBuf> {
    fs::read_dir(cache.files.folder()).unwrap().map(|entry| entry.unwrap().path()).collect()
}

/// A cache with the file of `scene(300, 1, 1.0)`, that scene, and the path and content of the file.
fn kept() -> (tempfile::TempDir, OwnerCache, Arc<Scene>, PathBuf, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let cache = cache(folder.path());
    let scene = scene(300, 1, 1.0);
    with(&cache, &scene);
    let path = files(&cache).remove(0);
    let bytes = fs::read(&path).unwrap();
    (folder, cache, scene, path, bytes)
}

#[test]
fn owners_are_read_as_they_were_computed() {
    // Equal in every number; tolerance none. 40 lights have cells of one owner, 3 000 crowded ones.
    let folder = tempfile::tempdir().unwrap();
    let cache = cache(folder.path());
    for (vsls, seed) in [(1, 1), (40, 1), (300, 1), (300, 2), (3_000, 1)] {
        let scene = scene(vsls, seed, 1.0);
        let expected = without(&scene);
        assert!(found(&cache, &scene).is_none());
        assert!(with(&cache, &scene) == expected, "{vsls} lights, written");
        assert!(found(&cache, &scene).is_some_and(|found| found == expected), "{vsls} lights, found");
        assert!(with(&cache, &scene) == expected, "{vsls} lights, read");
    }
    assert_eq!(files(&cache).len(), 5);
}

#[test]
fn whatever_it_is_computed_from_has_files_of_its_own() {
    let of = |scene: &Scene| key(scene, &Placement::new(scene));
    let first = of(&scene(300, 1, 1.0));
    assert_eq!(first, of(&scene(300, 1, 1.0)));
    let mut all = vec![first, of(&scene(301, 1, 1.0)), of(&scene(300, 2, 1.0)), of(&scene(300, 1, 1.1))];
    // The same lights on triangles that look another way, and others on the same triangles.
    let changed = |change: &dyn Fn(&mut Scene, &mut Placement)| {
        let mut scene = Scene::clone(&scene(300, 1, 1.0));
        let mut placement = Placement::new(&scene);
        change(&mut scene, &mut placement);
        key(&scene, &placement)
    };
    all.push(changed(&|scene, _| Arc::make_mut(&mut scene.geometry).normals[7] = Vec3::X));
    all.push(changed(&|_, placement| placement.vsls[9].barycentric[1] *= 0.99));
    all.push(changed(&|_, placement| placement.vsls[9].triangle ^= 1));
    all.push(changed(&|_, placement| placement.surfaces[1].0.side = Side::Front));
    all.push(changed(&|_, placement| placement.surfaces[1].1.start += 1));
    all.push(changed(&|scene, _| scene.objects[1].triangles.end -= 1));
    let mut unique = all.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), all.len());
}

#[test]
fn small_scenes_cancelled_ones_and_processes_without_a_folder_keep_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("cells");
    let scene = scene(300, 1, 1.0);
    assert!(with(&OwnerCache::new(place.clone()), &scene) == without(&scene));
    let cancel = Cancel::default();
    cancel.cancel();
    let any_size = OwnerCache { from: (0, 0), ..OwnerCache::new(place.clone()) };
    assert!(any_size.owners(&scene, &mut Placement::new(&scene), &cancel).is_none());
    assert!(!place.exists());
    assert!(OwnerCache::of_this_process().is_none());
}

/// Fails where owners, areas or patches are found or written in another way: then raise [`VERSION`], and only then change the
/// hash.
#[test]
#[cfg(all(target_arch = "x86_64", target_endian = "little"))]
fn the_version_stands_for_these_owners() {
    let (_folder, _, _, _, bytes) = kept();
    let found = blake3::hash(&bytes).to_hex();
    assert_eq!((VERSION, &found[..16]), (1, "2342c889c3f9d436"));
}

proptest! {
    // 64 cases, seed 1, so that a run repeats.
    #![proptest_config(ProptestConfig {
        cases: 64,
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    #[test]
    fn flipped_bits_lost_ends_and_other_files_are_noticed(
        at: prop::sample::Index, bit in 0u8..8, end: prop::sample::Index, more in 1usize..100
    ) {
        let (_folder, cache, scene, path, good) = kept();
        let expected = without(&scene);
        let mut flipped = good.clone();
        let at = at.index(good.len());
        flipped[at] ^= 1 << bit;
        let longer = [good.as_slice(), &vec![0; more]].concat();
        for bytes in [&flipped, &good[..end.index(good.len())], &longer, b"something else entirely"] {
            fs::write(&path, bytes).unwrap();
            prop_assert!(found(&cache, &scene).is_none());
            prop_assert!(with(&cache, &scene) == expected);
            prop_assert!(fs::read(&path).unwrap() == good, "a good file takes its place");
        }
    }

    /// Files with a right checksum over anything: refused, or owners that are lights of their surface, and areas and patches
    /// that are numbers.
    #[test]
    fn forged_files_name_lights_that_there_are(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>(), 0u8..4), 1..4),
        in_cells: bool, tasks in prop_oneof![4 => Just(None), 1 => any::<u32>().prop_map(Some)],
        at in (0.0f32..1.0, 0.0f32..1.0),
    ) {
        let (_folder, cache, scene, _, _) = kept();
        let placement = Placement::new(&scene);
        let key = key(&scene, &placement);
        let good = cache.files.find::<u32, Cell>(&key, [usize::MAX / 8; 2]).unwrap();
        let (mut words, mut cells) = (good.first.to_vec(), good.second.to_vec());
        for (at, value, kind) in changes {
            let words: &mut [u32] = if in_cells { bytemuck::cast_slice_mut(&mut cells) } else { &mut words };
            let at = at.index(words.len());
            words[at] = match kind {
                0 => value,
                1 => words[at].wrapping_add(value % 5),
                2 => words[at] ^ 1 << (value % 32),
                _ => value % 300,
            };
        }
        cache.files.keep(&key, tasks.unwrap_or(good.number), (&words, &cells));
        let Some((placement, owners)) = found(&cache, &scene) else { return Ok(()) };
        for (surface, lights) in &placement.surfaces {
            for triangle in scene.objects[surface.object.0 as usize].triangles.clone() {
                let (u, v) = if at.0 + at.1 > 1.0 { (1.0 - at.0, 1.0 - at.1) } else { at };
                let VslId(owner) = owners.owner(triangle, surface.side, u, v).unwrap();
                prop_assert!(lights.contains(&owner));
            }
        }
        let corners = |i: usize| {
            placement.patches[i].corners_ws(&scene.geometry, &placement.vsls[i]).collect::<Vec<_>>()
        };
        for (index, vsl) in placement.vsls.iter().enumerate() {
            prop_assert!(vsl.area.is_finite() && corners(index).iter().all(|corner| !corner.is_nan()));
        }
    }
}
