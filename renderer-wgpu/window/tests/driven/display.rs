//! Turns Xvfb into a display of its own for a test, and xdotool into hands on it.

use photonstream_renderer_wgpu::test_gpu;
use std::{
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
};

/// A virtual display; it ends with the test.
pub(crate) struct Display {
    server: Child,
    manager: Option<Child>,
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
        Some(Self { server, manager: None, name: format!(":{}", number.trim()) })
    }

    /// Lets openbox manage the windows from now on; `false`, said loudly, where there is none.
    pub(crate) fn is_managed(&mut self) -> bool {
        let quiet = || Stdio::null();
        let mut command = Command::new("openbox");
        command.env("DISPLAY", &self.name).env_remove("WAYLAND_DISPLAY").stdout(quiet()).stderr(quiet());
        match command.spawn() {
            Ok(manager) => self.manager = Some(manager),
            Err(error) => {
                test_gpu::skip(&format!("openbox cannot be started: {error}"));
                return false;
            }
        }
        // It owns the screen once it answers questions about the desktops.
        let asks = || {
            Command::new("xdotool")
                .arg("get_num_desktops")
                .env("DISPLAY", &self.name)
                .output()
                .unwrap()
                .status
        };
        for _ in 0..600 {
            if asks().success() {
                return true;
            }
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        panic!("openbox does not answer");
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
        if let Some(manager) = &mut self.manager {
            let _ = manager.kill();
            let _ = manager.wait();
        }
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
