//! Turns one run with denormals flushed to zero and one without into the same bits, each in a process of its own.

use crate::rooms::{CAMERA, Lit, pixels, scene};
use std::{fmt::Write, hint::black_box, path::Path, process::Command, thread};

const CHILD: &str = "PHOTONSTREAM_TEST_FLUSHING_OUT";

/// Denormals flushed (FTZ and DAZ, as `-ffast-math` libraries and audio hosts set them for a whole process) or kept: the same
/// flux and the same pictures, bit for bit, for ordinary light, for a scene of 10⁻⁴ m and for lamps of 10⁻²⁰ W. So nothing
/// here depends on denormals: the fourth power of a distance stays above 10⁻³⁸ down to 10⁻⁹ m, and flux is integers.
/// Of lamps of 10⁻³⁰ W what arrives at grazing angles is below 10⁻³⁸, and lamps of 10⁻⁴² W are denormal themselves: bits may
/// differ, and light may be dark; not NaN.
///
/// Flushing is set by `crtfastmath.o` of the C compiler, preloaded into a child process: this crate has no `unsafe` to set
/// the register with. Where there is no such object (not x86-64, no GCC) the half with flushing is left out, and says so.
#[test]
fn flushed_denormals_change_no_bit() {
    if let Some(out) = std::env::var_os(CHILD) {
        std::fs::write(out, light()).unwrap();
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let plain = child(folder.path(), None);
    assert!(plain.starts_with("kept\n"), "{plain}");
    let Some(library) = flushing_library(folder.path()) else {
        println!("skipped: no crtfastmath.o here that could be preloaded");
        return;
    };
    let flushed = child(folder.path(), Some(&library));
    assert!(flushed.starts_with("flushed\n"), "the library has no effect: {flushed}");
    assert_eq!(flushed.split_once('\n').unwrap().1, plain.split_once('\n').unwrap().1);
}

/// Runs the same test in a process of its own, and returns what it wrote.
fn child(folder: &Path, preload: Option<&Path>) -> String {
    let out = folder.join(if preload.is_some() { "flushed" } else { "kept" });
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "flushing::flushed_denormals_change_no_bit", "--nocapture"]).env(CHILD, &out);
    if let Some(library) = preload {
        command.env("LD_PRELOAD", library);
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(out).unwrap()
}

/// A shared library that makes a process that loads it flush denormals; `None` where it cannot be made.
fn flushing_library(folder: &Path) -> Option<std::path::PathBuf> {
    if !cfg!(target_arch = "x86_64") {
        return None;
    }
    let found = Command::new("cc").arg("-print-file-name=crtfastmath.o").output().ok()?;
    let object = String::from_utf8(found.stdout).ok()?.trim().to_owned();
    let library = folder.join("flush.so");
    let linked = Path::new(&object).is_absolute()
        && Command::new("cc").args(["-shared", "-o"]).arg(&library).arg(&object).status().ok()?.success();
    linked.then_some(library)
}

/// Whether denormals are flushed, in every thread; then the hashed bits of flux and pictures.
fn light() -> String {
    let is_flushed = || black_box(1e-39f32) * black_box(0.5) == 0.0;
    let flushed = is_flushed();
    assert_eq!(thread::spawn(is_flushed).join().unwrap(), flushed, "threads differ");
    let mut text = String::from(if flushed { "flushed\n" } else { "kept\n" });
    for (size, power, is_faint) in
        [(1.0, 10.0, false), (1e-4, 1e-7, false), (1.0, 1e-20, false), (1.0, 1e-30, true), (1.0, 1e-42, true)]
    {
        let by = |x: f64| x * size;
        let lit = Lit::new(&scene(&format!(
            "{}[material.a]\nalbedo = [0.7, 0.4, 0.1]\n\
             [object.floor]\nmaterial = \"a\"\nquad = {{ corner_m = [{}, 0, {}], edge_u_m = [{}, 0, 0], edge_v_m = [0, 0, {}] }}\n\
             [object.ball]\nmaterial = \"a\"\nposition_m = [0, {}, 0]\nsphere = {{ radius_m = {}, segments = 16 }}\n\
             [light.lamp]\npower_w = {power:e}\npoint = {{ position_m = [{}, {}, 0] }}\n\
             [streaming]\nvsls = 100\npool_paths = 8192\n",
            CAMERA
                .replace("[0, 1, 4]", &format!("[0, {}, {}]", by(1.0), by(4.0)))
                .replace("[0, 0.5, 0]", &format!("[0, {}, 0]", by(0.5))),
            by(-1.0),
            by(1.0),
            by(2.0),
            by(-2.0),
            by(0.5),
            by(0.3),
            by(0.7),
            by(1.5),
        )));
        lit.assert_sane();
        let rendered = lit.picture(24);
        if is_faint {
            continue;
        }
        let mut hash = 0xCBF2_9CE4_8422_2325u64;
        let mut add = |v: glam::Vec3| {
            for x in v.to_array() {
                // FNV-1a over words.
                hash = (hash ^ u64::from(x.to_bits())).wrapping_mul(0x100_0000_01B3);
            }
        };
        lit.ledger.readings(&lit.simulation.scene).for_each(|r| add(r.flux));
        ["full", "direct", "indirect"].iter().for_each(|l| pixels(&rendered, l).iter().for_each(|p| add(*p)));
        let light = pixels(&rendered, "full").iter().map(|p| f64::from(p.x)).sum::<f64>();
        assert!(light > 0.0);
        writeln!(text, "{size:e} m, {power:e} W: {hash:016x}").unwrap();
    }
    text
}
