//! Turns the state of the repository into the commit that results name.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-env-changed=PHOTONSTREAM_COMMIT");
    for file in ["../.git/HEAD", "../.git/logs/HEAD"] {
        println!("cargo:rerun-if-changed={file}");
    }
    let given = std::env::var("PHOTONSTREAM_COMMIT").ok();
    let commit = given.or_else(head).unwrap_or_else(|| "unknown".into());
    println!("cargo:rustc-env=PHOTONSTREAM_COMMIT={commit}");
}

fn head() -> Option<String> {
    let output = Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output().ok()?;
    let commit = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !commit.trim().is_empty()).then(|| commit.trim().to_owned())
}
