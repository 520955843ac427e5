//! The robot's own shadow: how its body takes away the light of the nearest panels.

use super::BODY;
use super::plan::Light;
use super::rig::Eye;
use super::space::BODY_HEIGHT;

/// How wide the edge of the shadow is, in metres.
const EDGE: f32 = 0.08;
/// Panels that cast a shadow.
const PANELS: usize = 4;
/// Light that no panel in view gives, as a share of that of the panel straight above.
const REST: f64 = 0.12;

/// The shadow of a body that stands somewhere.
pub(super) struct OwnShadow {
    body: (f32, f32),
    /// The panels that count: where they are, what share of all light each gives, and what part of the way to
    /// them lies below the top of the body.
    panels: Vec<(f32, f32, f32, f32)>,
}

impl OwnShadow {
    pub(super) fn new(lights: &super::Lights, eye: &Eye, body: &(f64, f64)) -> OwnShadow {
        let square = lights.ceiling * lights.ceiling;
        let gives = |light: &Light| {
            let (dx, dy) = (light.x - eye.x, light.y - eye.y);
            let far = 1.0 + (dx * dx + dy * dy) / square;
            light.power / (far * far)
        };
        let mut lit: Vec<(&Light, f64)> = lights.panels.iter().map(|light| (light, gives(light))).collect();
        let all = lit.iter().fold(REST, |sum, (_, light)| sum + light);
        lit.sort_by(|a, b| b.1.total_cmp(&a.1));
        lit.truncate(PANELS);
        let part = (BODY_HEIGHT / lights.ceiling) as f32;
        let panels =
            lit.iter().map(|(l, light)| (l.x as f32, l.y as f32, (light / all) as f32, part)).collect();
        OwnShadow { body: (body.0 as f32, body.1 as f32), panels }
    }

    /// What remains of the light on a point of the floor, 0 to 1.
    pub(super) fn remains(&self, x: f32, y: f32) -> f32 {
        let (bx, by) = (self.body.0 - x, self.body.1 - y);
        let mut remains = 1.0;
        for &(px, py, share, part) in &self.panels {
            // the way to the light, as far as it is below the top of the body
            let (wx, wy) = ((px - x) * part, (py - y) * part);
            let square = wx * wx + wy * wy;
            let t = if square > 0.0 { ((bx * wx + by * wy) / square).clamp(0.0, 1.0) } else { 0.0 };
            let (dx, dy) = (bx - wx * t, by - wy * t);
            // panels are long, so the shadow's edge is wider the further away its body is
            let edge = (((dx * dx + dy * dy).sqrt() - BODY as f32) / (EDGE + 0.1 * square.sqrt() * t) + 0.5)
                .clamp(0.0, 1.0);
            remains -= share * (1.0 - edge * edge * (3.0 - 2.0 * edge));
        }
        // close to the body it also hides what walls and ceiling scatter
        let near = ((bx * bx + by * by) * 3.0).min(1.0);
        remains.max(0.0) * (0.75 + 0.25 * near)
    }
}
