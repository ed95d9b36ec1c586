//! Checks that an import that is moved as a whole takes its lights and its animation along.

use super::{
    animations::{arm, at},
    files::*,
    parts::squares,
};
use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_shading::LightShape;

fn moved(scene: &Scene, keys: &str) -> Scene {
    let mut edit = scene.edit();
    edit.move_object("it", &toml::from_str(keys).unwrap()).unwrap();
    edit.finish()
}

/// Positions of f32 vertices that two ways of rounding lead to: 1e-6 of some metres.
fn assert_same(one: &Scene, other: &Scene, what: &str) {
    assert_eq!(names(one), names(other), "{what}");
    for (a, b) in one.lights.iter().zip(&other.lights).filter(|(a, _)| a.object.is_none()) {
        assert_eq!((&a.name, &a.light), (&b.name, &b.light), "{what}");
    }
    let far = one.geometry.vertices.iter().zip(&other.geometry.vertices).map(|(a, b)| a.distance(*b));
    assert!(far.fold(0.0, f32::max) < 3e-6, "{what}");
}

const KEYS: &str = "position_m = [1, 2, -3]\nrotation_deg = [20, 90, 0]\nscale = [2, 1, -1]";

#[test]
fn lights_go_with_an_import_that_is_moved() {
    let files = Files::new(&squares());
    let (scene, expected) = (files.scene(), files.build(KEYS, "").unwrap());
    assert_same(&moved(&scene, KEYS), &expected, "at once");
    // Key by key, from anywhere, after the light was changed and put elsewhere: its power stays.
    let mut edit = moved(&scene, "position_m = [7, 7, 7]").edit();
    edit.set_light("it/pole", &toml::from_str("power_w = 3\nposition_m = [9, 9, 9]").unwrap()).unwrap();
    let parts = KEYS.lines().fold(edit.finish(), |scene, key| moved(&scene, key));
    assert_eq!(light(&parts, "it/pole").shape, light(&expected, "it/pole").shape);
    assert_eq!(light(&parts, "it/pole").power, Vec3::splat(3.0));
    // What its file moves itself follows with the next moment.
    let files = Files::new(&arm());
    let (scene, expected) = (files.scene(), files.build(KEYS, "").unwrap());
    assert_same(&at(&moved(&scene, KEYS), 0.7), &at(&expected, 0.7), "moving");
}

#[test]
fn a_moved_import_goes_on_moving_where_it_is() {
    let files = Files::new(&arm());
    let (scene, expected) = (files.scene(), files.build(KEYS, "").unwrap());
    let moved = moved(&at(&scene, 0.4), KEYS);
    for time in [0.0, 0.25, 0.9, 1.5, 7.3] {
        assert_same(&at(&moved, time), &at(&expected, time), &format!("{time} s"));
    }
    // Put back, it is what it was.
    let back = self::moved(&moved, "position_m = [0, 0, 0]\nrotation_deg = [0, 0, 0]\nscale = 1");
    assert_same(&at(&back, 0.9), &at(&scene, 0.9), "back");
}

#[test]
fn lights_go_with_an_import_that_the_scene_file_animates() {
    let keys = "}\n[[animation]]\nobject = \"it\"\nproperty = \"position_m\"\ntimes_s = [0, 1]\n\
                values = [[0, 0, 0], [2, 0, 4]]\n# ";
    let scene = Files::new(&squares()).build("", keys).unwrap();
    assert_eq!((scene.features.moving_objects, scene.features.moving_lights), (3, 2));
    let LightShape::Point { position } = light(&at(&scene, 0.5), "it/pole").shape else { panic!() };
    assert_eq!(position, Vec3::new(1.0, 0.0, 2.0));
}

#[test]
fn a_move_that_is_refused_moves_nothing() {
    let scene = Files::new(&squares()).scene();
    let mut edit = scene.edit();
    // The squares fit, a light 10⁹ m away does not, and the other way round.
    for keys in ["position_m = [1e9, 1, 1]", "scale = 1e9"] {
        assert!(edit.move_object("it", &toml::from_str(keys).unwrap()).is_err(), "{keys}");
    }
    edit.move_object("it", &toml::from_str("position_m = [0, 0, 0]").unwrap()).unwrap();
    assert_same(&edit.finish(), &scene, "after two refusals");
}
