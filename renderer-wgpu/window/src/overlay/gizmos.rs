//! Turns VPLs, blockers, proxies and what is published of phantoms and second bounces into drawings over the picture.

use crate::{
    gizmos::{Gizmo, Kind, Mark, Roles, Shape, Sight, disc, rhombus, shapes, triangle},
    session::Session,
};
use egui::{Align2, Color32, Context, FontId, Id, LayerId, Painter, Pos2, Rgba, Stroke, pos2};
use glam::Vec3;
use photonstream_protocol::VslRecord;
use photonstream_scene::{LightId, Scene};

/// Radius of the mark of a phantom, in points.
const PHANTOM_POINTS: f32 = 12.0;
/// Radius of the mark of a second bounce, in points: smaller, since it may lie right before that of a phantom.
const SECOND_POINTS: f32 = 8.0;
/// How far from their places labels are, in points.
const LABEL_POINTS: f32 = 14.0;
/// What a hidden thing is multiplied by.
const HIDDEN: f32 = 0.35;

const BLOCKER: Color32 = Color32::from_rgb(255, 125, 90);
const PROXY: Color32 = Color32::from_rgb(110, 200, 255);
const PHANTOM: Color32 = Color32::from_rgb(255, 120, 255);
const SECOND_BOUNCE: Color32 = Color32::from_rgb(190, 255, 120);
const UNLIT: Color32 = Color32::from_gray(110);
/// The rim of a VPL that the method does not use.
const UNUSED: Color32 = Color32::from_gray(190);
const SHADE: Color32 = Color32::from_black_alpha(150);

pub(super) fn show(ctx: &Context, session: &Session) {
    let Some(sight) = session.sight() else { return };
    let set = session.gizmos.set();
    let roles = Roles::of(sight.published, set);
    let records = &sight.published.frame.vsls;
    let brightest = records.iter().map(brightness).fold(0.0, f32::max);
    let pen = Pen {
        painter: ctx.layer_painter(LayerId::new(egui::Order::Background, Id::unique("gizmos"))),
        scale: session.scale,
    };
    let chosen = session.selected_gizmo();
    let all = shapes(&sight, set, chosen);
    let selected = |shape: &Shape| chosen == Some(shape.gizmo);
    // What is selected lies over all else.
    for shape in all.iter().filter(|shape| !selected(shape)).chain(all.iter().filter(|s| selected(s))) {
        let lit = match shape.gizmo {
            Gizmo::Vpl(i) if i < roles.statics => records.get(i).map(|record| shown(record, brightest)),
            _ => None,
        };
        pen.gizmo(shape, lit, selected(shape));
    }
    for &(index, mark) in &roles.marks {
        if let Some(record) = records.get(index).filter(|record| brightness(record) > 0.0) {
            pen.mark(&sight, record, mark, shown(record, brightest).unwrap_or(UNLIT));
        }
    }
}

/// The largest channel of a light's flux, W.
fn brightness(record: &VslRecord) -> f32 {
    Vec3::from(record.flux).max_element()
}

/// The colour of a light's flux: bright ones brighter; `None` where it does not shine.
fn shown(record: &VslRecord, brightest: f32) -> Option<Color32> {
    let most = brightness(record);
    (most > 0.0).then(|| {
        let colour = Vec3::from(record.flux).max(Vec3::ZERO) / most * (0.2 + 0.8 * (most / brightest).sqrt());
        Rgba::from_rgb(colour.x, colour.y, colour.z).into()
    })
}

/// What gizmos are drawn with.
struct Pen {
    painter: Painter,
    /// Pixels per point.
    scale: f32,
}

impl Pen {
    fn at(&self, [x, y]: [f32; 2]) -> Pos2 {
        pos2(x, y) / self.scale
    }

    /// `lit`: of a VPL that is published, the colour in which it shines, if it does.
    fn gizmo(&self, shape: &Shape, lit: Option<Option<Color32>>, is_selected: bool) {
        let alpha = if shape.is_hidden && !is_selected { HIDDEN } else { 1.0 };
        let colour = match shape.gizmo.kind() {
            Kind::Vpl => lit.flatten().unwrap_or(UNLIT),
            Kind::Blocker => BLOCKER,
            Kind::Proxy => PROXY,
        };
        let line = if is_selected { Color32::WHITE } else { colour };
        let width = if is_selected { 2.2 } else { 1.3 };
        // The body of a blocker or proxy goes through what hides its middle.
        let is_vpl = shape.gizmo.kind() == Kind::Vpl;
        self.lines(&shape.lines, width, line.gamma_multiply(if is_vpl { alpha } else { 0.8 }));
        if is_vpl {
            // Of what is not published only the rim is known.
            let fill = if lit.is_some() { colour } else { Color32::TRANSPARENT };
            let rim = match (is_selected, lit) {
                (true, _) => Color32::WHITE,
                (false, Some(_)) => SHADE,
                (false, None) => UNUSED,
            };
            self.polygon(
                &shape.disc,
                fill.gamma_multiply(alpha),
                Stroke::new(width, rim.gamma_multiply(alpha)),
            );
        } else if let Some(handle) = shape.handle {
            self.painter.circle(
                self.at(handle),
                3.0,
                line.gamma_multiply(alpha.max(0.6)),
                Stroke::new(1.0, SHADE),
            );
        }
        if let Some(handle) = shape.handle.filter(|_| is_selected) {
            self.label(handle, Align2::CENTER_BOTTOM, &shape.gizmo.to_string(), Color32::WHITE);
        }
    }

    fn mark(&self, sight: &Sight<'_>, record: &VslRecord, mark: Mark, colour: Color32) {
        let point = Vec3::from(record.position);
        let Some(place) = sight.place(point) else { return };
        let alpha = if sight.is_hidden(point) { HIDDEN } else { 1.0 };
        let scene = &sight.published.scene;
        let (disc, normal) = disc(sight, point, Vec3::from(record.normal));
        let (corners, rim, label) = match mark {
            Mark::Phantom(light) => {
                let label = format!("phantom of {}", name(scene, light));
                (rhombus(sight, place, PHANTOM_POINTS), PHANTOM, Some((label, Align2::CENTER_BOTTOM)))
            }
            Mark::SecondBounce(light) => {
                let label = format!("second bounce of {}", name(scene, light));
                (triangle(sight, place, SECOND_POINTS), SECOND_BOUNCE, Some((label, Align2::CENTER_TOP)))
            }
            Mark::Photon => (disc, SHADE, None),
        };
        self.lines(&normal, 1.3, rim.gamma_multiply(alpha));
        self.polygon(&corners, colour.gamma_multiply(alpha), Stroke::new(1.8, rim.gamma_multiply(alpha)));
        if let Some((text, align)) = label {
            self.label(place, align, &text, rim.gamma_multiply(alpha.max(0.6)));
        }
    }

    fn lines(&self, lines: &[[[f32; 2]; 2]], width: f32, colour: Color32) {
        for &[a, b] in lines {
            self.painter.line_segment([self.at(a), self.at(b)], Stroke::new(width, colour));
        }
    }

    fn polygon(&self, corners: &[[f32; 2]], fill: Color32, stroke: Stroke) {
        if corners.len() < 3 {
            return;
        }
        let points = corners.iter().map(|&corner| self.at(corner)).collect();
        self.painter.add(egui::Shape::convex_polygon(points, fill, stroke));
    }

    /// A text above or below a place, legible on any picture.
    fn label(&self, place: [f32; 2], align: Align2, text: &str, colour: Color32) {
        let way = if align == Align2::CENTER_BOTTOM { -LABEL_POINTS } else { LABEL_POINTS };
        let at = self.at(place) + egui::vec2(0.0, way);
        let shade = at + egui::vec2(1.0, 1.0);
        for (at, colour) in [(shade, Color32::BLACK), (at, colour)] {
            self.painter.text(at, align, text, FontId::proportional(12.0), colour);
        }
    }
}

fn name(scene: &Scene, LightId(id): LightId) -> &str {
    scene.lights.get(id as usize).map_or("", |light| &light.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lit_things_have_the_colour_of_their_flux_and_the_strongest_are_brightest() {
        let record = |flux: [f32; 3]| VslRecord { flux, ..VslRecord::default() };
        assert_eq!(shown(&record([0.0; 3]), 1.0), None);
        let strong = shown(&record([4.0, 2.0, 0.0]), 4.0).unwrap();
        let weak = shown(&record([0.04, 0.02, 0.0]), 4.0).unwrap();
        // Half of linear light is 188 of 255 in sRGB.
        assert_eq!((strong.r(), strong.g(), strong.b()), (255, 188, 0));
        assert!(weak.r() < strong.r() && weak.r() > 100 && weak.r() > weak.g(), "{weak:?}");
    }
}
