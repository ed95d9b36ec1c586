//! Evaluates a scene with tiny pictures from its config to the page, and opens the page in a browser.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

use photonstream_evaluation::{
    EvaluateError, Observer, Options, SCENE_WITHOUT_LIGHT, device, evaluate, hard_cases, plan::Effort,
    results::Results,
};
use std::{
    path::{Path, PathBuf},
    process::Command,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
};

fn options(out: &Path, points: &[&str]) -> Options {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-ball.toml");
    Options {
        configs: vec![config],
        out: out.to_owned(),
        cache: out.join("cache"),
        effort: Effort::Quick,
        size: Some((24, 24)),
        reference_spp: Some(32),
        time_s: None,
        threads: Some(2),
        seed: None,
        points: points.iter().map(|&p| p.to_owned()).collect(),
    }
}

/// These tests are of the processor's cores; those of a device are where there is one.
const NO_DEVICE: &str = "no device in this test";

fn run(options: &Options) -> Results {
    let cancelled = AtomicBool::new(false);
    evaluate(options, Err(NO_DEVICE.into()), Observer { progress: &|_, _| {}, cancelled: &cancelled })
        .unwrap()
}

/// Everything at once: rows of every method, splits, changes; tables, and a page that a browser shows.
#[test]
fn from_config_to_page() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let results = run(&options(out, &[]));
    assert!(results.complete);
    let methods =
        ["photon-streaming", "path-tracing", "instant-radiosity", "instant-radiosity-bounded", "paper-a"];
    for method in methods {
        assert!(results.rows.iter().any(|r| r.method == method && r.rel_rmse > 0.0), "{method}");
    }
    for row in &results.rows {
        let finite = [row.rel_rmse, row.rel_rmse_indirect, row.rel_mse, row.bias, row.worst_1pct, row.flip];
        assert!(finite.iter().all(|x| x.is_finite()), "{row:?}");
        assert!(row.total_ms > 0.0 && row.command.contains("--point"), "{row:?}");
        assert!(!row.commit.is_empty() && row.scene_hash.len() == 16, "{row:?}");
    }
    assert!(results.splits.iter().any(|s| s.visibility == "none" && s.visibility_part > 0.0));
    assert!(!results.changes.is_empty());
    // What the renderer cannot do is named.
    assert!(results.skipped.iter().any(|s| s.what.contains("visibility ao")), "{:?}", results.skipped);
    assert!(results.skipped.iter().any(|s| s.what == device::WITHOUT && s.why == NO_DEVICE));
    // Hard cases: those that were run have a verdict, and no others.
    assert_eq!(results.hard_cases.len(), hard_cases::CLOSED_FORMS.len());
    for case in &results.hard_cases {
        assert!(case.holds(), "{case:?}");
    }
    let lines = std::fs::read_to_string(out.join("results.csv")).unwrap().lines().count();
    assert_eq!(lines, results.rows.len() + 1);
    let page = std::fs::read_to_string(out.join("index.html")).unwrap();
    if let Some(kept) = std::env::var_os("PHOTONSTREAM_KEEP_REPORT") {
        std::fs::write(kept, &page).unwrap();
    }
    for part in [
        "<svg",
        "data:image/png;base64,",
        "prefers-color-scheme",
        "Pareto",
        "What was left out",
        "id=\"hard-cases\"",
        NO_DEVICE,
    ] {
        assert!(page.contains(part), "{part}");
    }
    let rows = page.matches("<span class=\"verdict ").count();
    assert_eq!(rows, hard_cases::cases().len());
    assert_eq!(page.matches("<span class=\"verdict yes\">pass</span>").count(), results.hard_cases.len());
    // Every point's command is beside what shows it: in charts' lists, tables, pictures and the list of all.
    for row in &results.rows {
        assert!(page.matches(&row.command.replace('&', "&amp;")).count() >= 2, "{}", row.command);
    }
    let text = page.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http://", "https://", "<script", "url("] {
        assert!(!text.contains(outside), "the page reaches for {outside}");
    }
    opens_in_a_browser(&out.join("index.html"));
}

/// The command in a row measures the same picture again.
/// Behind its closed door the room is black: it is left out, and the other scene is measured; alone it is an error that
/// says what to do.
#[test]
fn a_scene_without_light_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let mut options = options(folder.path(), &["photon-streaming:vsls=60"]);
    let ball = options.configs[0].clone();
    let dark = ball.with_file_name("door-room.toml");
    options.configs = vec![dark.clone(), ball];
    let results = run(&options);
    assert!(results.complete && results.rows.len() == 1 && results.rows[0].scene != "Door room");
    let told = results.skipped.iter().find(|s| s.what == SCENE_WITHOUT_LIGHT).unwrap();
    assert!(told.why.contains("Door room") && told.why.contains("--time"), "{told:?}");
    options.configs = vec![dark];
    let cancelled = AtomicBool::new(false);
    let observer = Observer { progress: &|_, _| {}, cancelled: &cancelled };
    let outcome = evaluate(&options, Err(NO_DEVICE.into()), observer);
    assert!(matches!(outcome, Err(EvaluateError::Black { .. })), "{outcome:?}");
    // With the door open it has light.
    options.time_s = Some(7.0);
    assert_eq!(run(&options).rows.len(), 1);
}

#[test]
fn a_point_is_repeated_by_its_text() {
    let folder = tempfile::tempdir().unwrap();
    let texts = [
        "photon-streaming:vsls=60,pool=1024,kernel=disc,visibility=rays,sampling=replay,light_samples=4,threads=2,seed=3",
        "paper-a:vsls=60,pool=1024,threads=1",
        "instant-radiosity:vsls=40",
        "path-tracing:spp=4",
    ];
    let first = run(&options(folder.path(), &texts));
    let again: Vec<String> =
        first.rows.iter().map(|row| row.command.split("--point ").nth(1).unwrap().to_owned()).collect();
    let again: Vec<&str> = again.iter().map(String::as_str).collect();
    let second = run(&options(folder.path(), &again));
    assert_eq!(first.rows.len(), texts.len());
    for (a, b) in first.rows.iter().zip(&second.rows) {
        assert_eq!((a.rel_rmse, a.flip, &a.command), (b.rel_rmse, b.flip, &b.command));
    }
    let error = evaluate(
        &options(folder.path(), &["path-tracing:vsls=3"]),
        Err(NO_DEVICE.into()),
        Observer { progress: &|_, _| {}, cancelled: &AtomicBool::new(false) },
    );
    assert!(matches!(error, Err(EvaluateError::Point { .. })));
}

/// Stopped when it begins the third point, it leaves the two that it has.
#[test]
fn an_interrupted_evaluation_leaves_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let cancelled = AtomicBool::new(false);
    let points = AtomicUsize::new(0);
    let progress = |_: f64, what: &str| {
        if what.starts_with("photon-streaming") && points.fetch_add(1, Ordering::Relaxed) == 2 {
            cancelled.store(true, Ordering::Relaxed);
        }
    };
    let observer = Observer { progress: &progress, cancelled: &cancelled };
    let error = evaluate(&options(folder.path(), &[]), Err(NO_DEVICE.into()), observer).unwrap_err();
    assert!(error.is_cancelled(), "{error}");
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("results.json")).unwrap()).unwrap();
    assert_eq!(json["complete"], false);
    assert_eq!(json["rows"].as_array().unwrap().len(), 2);
    assert!(std::fs::read_to_string(folder.path().join("index.html")).unwrap().contains("was interrupted"));
}

/// A picture of the page, light and dark: not blank, and nothing on the console. Without Chromium it is a loud SKIP, or a
/// failure where PHOTONSTREAM_REQUIRE_CHROMIUM=1.
fn opens_in_a_browser(page: &Path) {
    let Some(browser) = chromium() else {
        let required = std::env::var("PHOTONSTREAM_REQUIRE_CHROMIUM").is_ok_and(|v| v == "1");
        assert!(!required, "PHOTONSTREAM_REQUIRE_CHROMIUM=1, and no chromium is in the PATH");
        eprintln!("SKIP: no chromium in the PATH (Debian package chromium): the page was not opened");
        return;
    };
    let mut means = Vec::new();
    // 1 is light and 0 is dark in Chromium's own settings.
    for (scheme, name) in [("1", "light"), ("0", "dark")] {
        let folder = page.parent().unwrap();
        let picture = folder.join(format!("{name}.png"));
        let output = Command::new(&browser)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--window-size=1280,3000",
            ])
            .args(["--enable-logging=stderr", "--v=0"])
            .arg(format!("--blink-settings=preferredColorScheme={scheme}"))
            .arg(format!("--user-data-dir={}", folder.join(format!("profile-{name}")).display()))
            .arg(format!("--screenshot={}", picture.display()))
            .arg(format!("file://{}", page.canonicalize().unwrap().display()))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let console: Vec<&str> = said.lines().filter(|line| line.contains("CONSOLE")).collect();
        assert!(console.is_empty(), "{console:?}");
        let image = image::open(&picture).unwrap_or_else(|e| panic!("{e}: {said}")).to_luma8();
        assert_eq!(image.dimensions(), (1280, 3000));
        let pixels = image.as_raw();
        let mean = pixels.iter().map(|&p| f64::from(p)).sum::<f64>() / pixels.len() as f64;
        let other = pixels.iter().filter(|&&p| (f64::from(p) - mean).abs() > 40.0).count();
        // Text, lines and pictures: more than one pixel in a hundred is far from the mean.
        assert!(other > pixels.len() / 100, "{name}: {other} of {} pixels differ from {mean}", pixels.len());
        means.push(mean);
    }
    assert!(means[0] > means[1] + 100.0, "light and dark look alike: {means:?}");
    for width in [400, 1280] {
        fits(page, &browser, width);
    }
}

/// What a copy of the page tells of itself: its width, and that of what it holds, all that is folded unfolded; height and
/// rows of the section of hard cases.
const PROBE: &str = "<script>addEventListener('load',()=>{document.querySelectorAll('details').forEach(d=>d.open=true);\
    const s=document.getElementById('hard-cases'),r=document.documentElement;\
    parent.postMessage([innerWidth,r.scrollWidth,s?Math.round(s.getBoundingClientRect().height):0,\
    s?[...s.querySelectorAll('tbody tr')].filter(t=>t.getBoundingClientRect().height>0).length:0].join(' '),'*')})</script>";

/// In a frame of `width` pixels (windows of this browser are 500 wide or more) nothing sticks out to the side, tables in their
/// own scrolling frames excepted, and the hard cases are there, each row with a height.
fn fits(page: &Path, browser: &Path, width: u32) {
    let folder = page.parent().unwrap();
    let text = std::fs::read_to_string(page).unwrap().replace("</body>", &format!("{PROBE}</body>"));
    std::fs::write(folder.join("probe.html"), text).unwrap();
    let outer = folder.join(format!("outer-{width}.html"));
    let frame = format!(
        "<!doctype html><title>-</title><script>onmessage=e=>{{document.title=e.data}}</script>\
         <iframe src=\"probe.html\" style=\"width:{width}px;height:900px;border:0\"></iframe>"
    );
    std::fs::write(&outer, frame).unwrap();
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--window-size=1400,1000",
            "--virtual-time-budget=10000",
        ])
        .arg(format!("--user-data-dir={}", folder.join(format!("profile-{width}")).display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", outer.canonicalize().unwrap().display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let title = dom.split_once("<title>").and_then(|(_, rest)| rest.split_once("</title>")).unwrap().0;
    let told: Vec<u32> = title.split(' ').filter_map(|n| n.parse().ok()).collect();
    let [inner, content, height, rows] = told[..] else { panic!("the page did not tell: {title}") };
    // A vertical scroll bar takes some of it, where bars are not hidden.
    assert!(inner == width && content <= inner, "{content} pixels in a page of {inner}");
    assert_eq!(rows as usize, hard_cases::cases().len(), "rows of hard cases that are shown");
    assert!(height > 40 * rows / 2, "the section of hard cases is {height} pixels high");
}

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path).flat_map(|dir| names.map(|n| dir.join(n))).find(|file| file.is_file())
}
