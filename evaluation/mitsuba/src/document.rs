//! Turns names and numbers into the XML of a Mitsuba scene.

use glam::Vec3;
use photonstream_scene::Scene;
use std::fmt::{Display, Write};

/// A scene file in the making: one element a line, indented by how deep it lies.
pub(crate) struct Document {
    text: String,
    open: Vec<&'static str>,
}

impl Document {
    /// The head of a scene file: where it comes from, and the integrator.
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut document =
            Self { text: "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n".into(), open: Vec::new() };
        document.begin("scene", &[("version", &"3.0.0")]);
        let [x, y, z] = scene.origin_m.to_array();
        document.comment(&format!(
            "{}, scene hash {:016x}; metres around ({x}, {y}, {z}) of its config; linear RGB (Rec. 709), watts",
            scene.name, scene.hash
        ));
        document.comment(
            "Parameters (-Dname=value). max_depth: -1 is our layer full, 2 is direct; indirect is full less direct.",
        );
        let settings = &scene.render;
        document.leaf("default", &[("name", &"width"), ("value", &settings.width)]);
        document.leaf("default", &[("name", &"height"), ("value", &settings.height)]);
        document.leaf("default", &[("name", &"spp"), ("value", &256)]);
        document.leaf("default", &[("name", &"max_depth"), ("value", &-1)]);
        document.begin("integrator", &[("type", &"path")]);
        document.property("integer", "max_depth", "$max_depth");
        document.property("boolean", "hide_emitters", "false");
        document.end();
        document
    }

    /// Opens an element.
    pub(crate) fn begin(&mut self, tag: &'static str, attributes: &[(&str, &dyn Display)]) {
        self.tag(tag, attributes, ">");
        self.open.push(tag);
    }

    /// Closes the innermost open element.
    pub(crate) fn end(&mut self) {
        let tag = self.open.pop().expect("invariant: every end has its beginning");
        self.indent();
        self.push(format_args!("</{tag}>\n"));
    }

    /// An element without content.
    pub(crate) fn leaf(&mut self, tag: &str, attributes: &[(&str, &dyn Display)]) {
        self.tag(tag, attributes, "/>");
    }

    /// A named value: `<float name="fov" value="35.4"/>`.
    pub(crate) fn property(&mut self, kind: &str, name: &str, value: impl Display) {
        self.leaf(kind, &[("name", &name), ("value", &value)]);
    }

    /// A named colour, linear RGB.
    pub(crate) fn rgb(&mut self, name: &str, colour: Vec3) {
        self.property("rgb", name, numbers(colour));
    }

    /// `to_world` of something that stands at `origin` and looks along `forward`.
    pub(crate) fn look_along(&mut self, origin: Vec3, forward: Vec3, up: Vec3) {
        self.begin("transform", &[("name", &"to_world")]);
        let target = numbers(origin + forward);
        self.leaf("lookat", &[("origin", &numbers(origin)), ("target", &target), ("up", &numbers(up))]);
        self.end();
    }

    /// The text of the file.
    pub(crate) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.end();
        }
        self.text
    }

    fn comment(&mut self, text: &str) {
        self.indent();
        // XML allows no two hyphens in a comment.
        self.push(format_args!("<!-- {} -->\n", text.replace("--", "- -").trim_end_matches('-')));
    }

    fn tag(&mut self, tag: &str, attributes: &[(&str, &dyn Display)], end: &str) {
        self.indent();
        self.push(format_args!("<{tag}"));
        for (name, value) in attributes {
            self.push(format_args!(" {name}=\"{value}\""));
        }
        self.push(format_args!("{end}\n"));
    }

    fn indent(&mut self) {
        self.text.extend(std::iter::repeat_n("  ", self.open.len()));
    }

    fn push(&mut self, arguments: std::fmt::Arguments<'_>) {
        self.text.write_fmt(arguments).expect("invariant: a String takes all text");
    }
}

/// A file that includes `scene.xml` with another `max_depth`.
pub(crate) fn variant(max_depth: i32) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<scene version=\"3.0.0\">\n  \
         <default name=\"max_depth\" value=\"{max_depth}\"/>\n  <include filename=\"scene.xml\"/>\n</scene>\n"
    )
}

/// A name of which only letters, digits, `-` and `_` are left: fit for identifiers and file names.
pub(crate) fn identifier(name: &str) -> String {
    let fit = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    name.chars().take(64).map(fit).collect()
}

/// Three numbers that are read back as the same f32.
fn numbers(v: Vec3) -> String {
    format!("{}, {}, {}", v.x, v.y, v.z)
}
