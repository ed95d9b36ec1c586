//! What somebody sees who has just built it: the bare command in an empty folder.

use crate::harness::Ground;
use photonstream_film::Film;

#[test]
fn the_bare_command_makes_pictures_and_ends() {
    let ground = Ground::new();
    let said = ground.run(&[]);
    said.expect(0, &["without a window: no display", "first picture after"]);
    let lines: Vec<_> = said.stdout.lines().collect();
    assert_eq!(&lines[..2], ["out/cornell-box.exr", "out/cornell-box.png"], "{said:?}");
    assert!(lines.len() == 3, "one line of figures: {said:?}");
    for figure in ["VSLs", "paths", "rays/s", "converged in", "rendered in", "total"] {
        assert!(lines[2].contains(figure), "{figure}: {said:?}");
    }
    let film = Film::read_exr(&ground.path("out/cornell-box.exr")).unwrap();
    let pixels = &film.layers()[0].pixels;
    let lit = pixels.iter().filter(|p| p.max_element() > 0.01).count();
    // The room fills the picture; only deep shadows are darker.
    assert!(lit * 10 > pixels.len() * 9, "{lit} of {} pixels", pixels.len());
    assert_eq!(film.metadata.visibility.as_deref(), Some("rays"));
    ground.wait_for_silence();
    assert_eq!(std::fs::read_dir(ground.runtime()).unwrap().count(), 0);
}
