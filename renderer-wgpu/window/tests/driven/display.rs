//! Turns Xvfb into a display of its own for a test, and xdotool into hands on it.

use photonstream_renderer_wgpu::test_gpu;
use std::{
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
};

/// A virtual display; it ends with the test.
pub(crate) struct Display {
    server: Child,
    /// As in the variable DISPLAY.
    pub(crate) name: String,
}

impl Display {
    /// Starts a server on a free number; `None`, said loudly, where there is no Xvfb or xdotool.
    pub(crate) fn open() -> Option<Self> {
        if let Err(error) =
            Command::new("xdotool").arg("version").stdout(Stdio::null()).stderr(Stdio::null()).status()
        {
            test_gpu::skip(&format!("xdotool cannot be started: {error}"));
            return None;
        }
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "900x700x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = match server {
            Ok(server) => server,
            Err(error) => {
                test_gpu::skip(&format!("Xvfb cannot be started: {error}"));
                return None;
            }
        };
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb found no free display");
        Some(Self { server, name: format!(":{}", number.trim()) })
    }

    /// Runs xdotool; what it said, without the end of the line.
    pub(crate) fn hands(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "xdotool {arguments:?}: {said}");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
