//! Turns a real window on a virtual display, driven by synthetic keys and mouse, into checks of what it shows.
#![allow(clippy::unwrap_used)]

mod display;
mod simulator;
mod window;

use display::Display;
use glam::{Vec3, Vec3Swizzles};
use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{LayerKind, published::PublishedScene};
use photonstream_renderer_wgpu::{Renderer, View, test_gpu};
use photonstream_scene::Visibility;
use photonstream_shading::Camera;
use simulator::Simulator;
use window::{Shot, Window};

/// Size of the windows: small, since software draws them.
const SIZE: (u32, u32) = (320, 240);

/// The display and the device that these tests need, or a loud word that they are not there.
fn ready() -> Option<(Display, Renderer)> {
    let gpu = test_gpu::gpu()?;
    let display = Display::open()?;
    Some((display, Renderer::new(gpu).unwrap()))
}

/// The picture that a renderer without a window makes of `frame`.
fn headless(
    renderer: &mut Renderer,
    frame: &VslFrame,
    camera: Camera,
    size: (u32, u32),
    kind: LayerKind,
) -> Film {
    let mut published = PublishedScene::default();
    let scene = published.update(frame).unwrap();
    renderer.set_scene(scene).unwrap();
    renderer.set_frame(frame).unwrap();
    let view = View {
        width: size.0,
        height: size.1,
        visibility: Visibility::None,
        ..View::from_settings(&scene.render, &camera)
    };
    renderer.film(&view, &[kind]).unwrap()
}

/// The same device and shaders, the same numbers: equal up to what the driver does with two pictures' worth of threads,
/// which has been bit-equal; 1e-5 would be a visible change of no pixel.
fn assert_same(found: &Film, expected: &Film, kind: LayerKind) {
    assert_eq!((found.width(), found.height()), (expected.width(), expected.height()));
    let (found, expected) =
        (&found.layer(kind.name()).unwrap().pixels, &expected.layer(kind.name()).unwrap().pixels);
    let square =
        |pixels: &mut dyn Iterator<Item = Vec3>| pixels.map(|p| f64::from(p.length_squared())).sum::<f64>();
    let difference = square(&mut found.iter().zip(expected).map(|(a, b)| *a - *b));
    let size = square(&mut expected.iter().copied());
    assert!(size > 0.0, "{kind}: the picture is black");
    assert!(difference <= 1e-10 * size, "{kind}: rel. RMSE {:e}", (difference / size).sqrt());
}

/// A screenshot, compared with what a renderer without a window makes of the same frame and camera.
fn compare(
    window: &mut Window<'_>,
    simulator: &mut Simulator,
    renderer: &mut Renderer,
    kind: LayerKind,
) -> Shot {
    let shot = window.screenshot();
    let frame = simulator.newest();
    assert_eq!(shot.film.metadata.frame, Some(frame.frame), "the light is at rest");
    let size = (shot.film.width(), shot.film.height());
    assert_same(&shot.film, &headless(renderer, frame, shot.camera, size, kind), kind);
    shot
}

#[test]
fn a_window_shows_what_is_published_and_follows_the_hands_of_its_user() {
    let Some((display, mut renderer)) = ready() else { return };
    let mut simulator = Simulator::start("driven");
    let mut window = Window::open(&display, simulator.channel(), SIZE, &["--visibility", "none"]);
    window.rest(&mut simulator);

    // Nothing changes: nothing is drawn.
    let before = window.presented();
    std::thread::sleep(std::time::Duration::from_secs(2));
    assert_eq!(window.presented(), before, "a still scene with a still camera is not drawn again");

    let home = compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    let scene = simulator.scene();
    assert_eq!(home.camera, scene.camera, "the scene's own camera, bit for bit");

    // Keys move the camera; without the overlay, which covers most of so small a window.
    window.key("Tab");
    window.hold_key("w", 5);
    window.rest(&mut simulator);
    let nearer = compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    assert!(nearer.camera.position.z < home.camera.position.z - 0.01, "{:?}", nearer.camera);

    // So does the mouse beside things.
    window.drag((20, 120), (80, 100), 3);
    window.rest(&mut simulator);
    let turned = compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    assert!(turned.camera.forward.distance(home.camera.forward) > 0.05, "{:?}", turned.camera);

    // Views are switched by keys.
    for (key, kind) in [("2", LayerKind::Direct), ("3", LayerKind::Indirect), ("6", LayerKind::Vsl)] {
        window.key(key);
        window.rest(&mut simulator);
        compare(&mut window, &mut simulator, &mut renderer, kind);
    }
    for key in ["9", "0", "t", "F1", "h", "Tab", "h"] {
        let before = window.presented();
        window.key(key);
        window.wait("a picture", |w| w.presented() > before);
    }
    window.key("1");
    window.key("r");
    window.rest(&mut simulator);

    // The sphere follows the mouse, and the light follows the sphere.
    let sphere = simulator.place_of("sphere");
    let from = window::on_screen(&home.camera, sphere.as_vec3(), SIZE);
    window.drag(from, (from.0 - 40, from.1), 1);
    window.wait("the sphere elsewhere", |_| simulator.place_of("sphere").x < sphere.x - 0.1);
    window.rest(&mut simulator);
    let moved = compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    assert_eq!(moved.camera, home.camera, "R brought the camera home");
    let place = simulator.place_of("sphere");
    // Parallel to the screen: y and z stay but for the rounding of f32.
    assert!((place.y - sphere.y).abs() < 1e-4 && (place.z - sphere.z).abs() < 1e-4, "{place} {sphere}");

    // The picture has the size of the window.
    window.resize(202, 151);
    window.rest(&mut simulator);
    let resized = compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    assert_eq!((resized.film.width(), resized.film.height()), (202, 151));

    // The simulator ends, and another takes its place.
    let before = window.presented();
    simulator.restart();
    window.wait("pictures of the next run", |w| w.presented() > before + 1);
    window.rest(&mut simulator);
    compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);

    window.key("ctrl+q");
    window.expect_end();
}

#[test]
fn a_lost_device_is_opened_again_and_the_frames_asked_for_are_counted() {
    let Some((display, mut renderer)) = ready() else { return };
    let mut simulator = Simulator::start("lost-device");
    let mut window =
        Window::open(&display, simulator.channel(), SIZE, &["--visibility", "none", "--fault", "device@1"]);
    window.wait("the device's loss", |w| w.said("it was opened again"));
    window.rest(&mut simulator);
    compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    window.terminate();
    window.expect_end();
    let mut window = Window::open(&display, simulator.channel(), SIZE, &["--frames", "1"]);
    window.expect_end();
}

/// Whatever happens to its surface, the window shows the picture again that the headless renderer makes.
#[test]
fn a_lost_or_outdated_surface_and_a_suspension_are_recovered_from() {
    let Some((display, mut renderer)) = ready() else { return };
    let mut simulator = Simulator::start("surface");
    for fault in ["surface", "outdated", "timeout", "suspend"] {
        let fault = format!("{fault}@1");
        let arguments = ["--visibility", "none", "--fault", &fault];
        let mut window = Window::open(&display, simulator.channel(), SIZE, &arguments);
        window.wait("the fault", |w| w.said("fault injection"));
        let before = window.presented();
        window.wait("a picture after it", |w| w.presented() > before);
        assert_eq!(window.said("was lost and made anew"), fault.starts_with("surface"));
        assert!(!window.said("it was opened again"), "the device has not failed");
        window.rest(&mut simulator);
        compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
        window.terminate();
        window.expect_end();
    }
}

/// A window that nobody can see draws nothing while the light changes, and shows the newest light when it can be seen.
#[test]
fn a_hidden_window_draws_nothing_and_catches_up() {
    let Some((display, mut renderer)) = ready() else { return };
    let mut simulator = Simulator::start("hidden");
    let mut window = Window::open(&display, simulator.channel(), SIZE, &["--visibility", "none"]);
    window.rest(&mut simulator);
    compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);

    // Another window lies over all of it.
    let larger = (SIZE.0 + 60, SIZE.1 + 60);
    let mut cover = Window::open(&display, simulator.channel(), larger, &["--show", "normal"]);
    cover.rest(&mut simulator);
    let before = (window.presented(), cover.presented());
    simulator.restart();
    cover.wait("pictures of the next run", |w| w.presented() > before.1 + 1);
    cover.rest(&mut simulator);
    assert_eq!(window.presented(), before.0, "it cannot be seen");
    cover.terminate();
    cover.expect_end();
    window.wait("a picture once it can be seen", |w| w.presented() > before.0);
    window.focus();
    window.rest(&mut simulator);
    compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);

    // Taken off the screen and put back, as minimising does.
    window.unmap();
    simulator.restart();
    std::thread::sleep(std::time::Duration::from_secs(1));
    let before = window.presented();
    window.map();
    window.wait("a picture once it is back", |w| w.presented() > before);
    window.focus();
    window.rest(&mut simulator);
    compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    window.terminate();
    window.expect_end();
}

/// Minimised by a window manager it draws nothing while the light changes; restored, it shows the newest.
#[test]
fn a_minimised_window_draws_nothing_and_catches_up() {
    let Some((mut display, mut renderer)) = ready() else { return };
    if !display.is_managed() {
        return;
    }
    let mut simulator = Simulator::start("minimised");
    let mut window = Window::open(&display, simulator.channel(), SIZE, &["--visibility", "none"]);
    window.rest(&mut simulator);
    compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    for _ in 0..2 {
        window.minimise();
        // What was being drawn is shown still.
        std::thread::sleep(std::time::Duration::from_secs(1));
        let before = window.presented();
        simulator.restart();
        while !simulator.is_at_rest() {
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        assert_eq!(window.presented(), before, "it cannot be seen");
        window.restore();
        window.wait("a picture once it is back", |w| w.presented() > before);
        window.rest(&mut simulator);
        compare(&mut window, &mut simulator, &mut renderer, LayerKind::Full);
    }
    window.terminate();
    window.expect_end();
}

/// A VPL is put on the floor, dragged to the right, given a blocker beside it and saved; then it is taken away. The simulator
/// lights what the hands make at once, and the file has what was saved.
#[test]
fn vpls_are_added_moved_saved_and_removed_by_hand() {
    let Some((display, _)) = ready() else { return };
    let more = "\n[streaming]\nmethod = \"static-vpl\"\n\n# Mine.\n[[vpl]]\nposition_m = [0.0, 2.0, 0.0]\n\
                normal = [0, -1, 0]\nalbedo = 0.75\n";
    let mut simulator = Simulator::start_file("gizmos", more);
    let mut window = Window::open(&display, simulator.channel(), SIZE, &["--visibility", "none"]);
    // The keyboard is the window's before the first key goes down.
    window.focus();
    window.rest(&mut simulator);
    let (camera, origin) = (simulator.scene().camera, simulator.scene().origin_m.as_vec3());
    let place = |config_m: [f32; 3]| window::on_screen(&camera, Vec3::from(config_m) - origin, SIZE);

    window.key("Tab");
    window.key("g");
    window.point(place([-0.5, 0.0, 0.7]));
    window.key("v");
    window.wait("another VPL", |_| simulator.newest().vsls.len() == 2);
    let added = Vec3::from(simulator.newest().vsls[1].position) + origin;
    // A pixel of the floor is a few centimetres.
    assert!(added.distance(Vec3::new(-0.5, 0.0, 0.7)) < 0.06 && added.y.abs() < 1e-4, "{added}");

    // Parallel to the screen, it goes to the right.
    let from = window::on_screen(&camera, added - origin, SIZE);
    window.drag(from, (from.0 + 40, from.1), 1);
    let x = |simulator: &mut Simulator| simulator.newest().vsls[1].position[0] + origin.x;
    window.wait("it elsewhere", |_| x(&mut simulator) > added.x + 0.3);
    let moved = Vec3::from(simulator.newest().vsls[1].position) + origin;
    assert!((moved - added).yz().length() < 1e-4, "{moved}");

    window.point(place([0.0, 0.0, 0.8]));
    window.key("b");
    let generation = simulator.newest().config_generation;
    window.key("ctrl+s");
    window.wait("word of what was saved", |window| window.said("are saved in the file"));
    let text = simulator.text();
    assert!(text.contains("# Mine.") && text.contains("position_m = [0.0, 2.0, 0.0]"), "{text}");
    assert_eq!((text.matches("[[vpl]]").count(), text.matches("[[blocker]]").count()), (2, 1), "{text}");

    // The file that was saved is simulated now. What is clicked on is removed.
    window.wait("the saved file", |_| simulator.newest().config_generation > generation);
    let from = window::on_screen(&camera, moved - origin, SIZE);
    window.drag(from, from, 1);
    window.key("Delete");
    window.wait("one VPL less", |_| simulator.newest().vsls.len() == 1);
    window.terminate();
    window.expect_end();
}

#[test]
fn without_a_display_the_way_out_is_told() {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_photonstream-window"))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("no display") && said.contains("--headless"), "{said}");
}
