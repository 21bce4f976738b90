//! The map that turns a box above the layer into a round indenter.
//!
//! The lower face of the box becomes the part of the indenter that faces the layer, its edges lie on the
//! indenter, and its other faces become the rest. So smooth bodies stay smooth, and no exterior angle is
//! flattened. Points of the lower face lie at the feet of the surface points below them, up to where the
//! surface separates from the indenter. The displacement of a point of a face falls to zero over the distance
//! to the surface of the layer, and to the ends of the map on the other sides.
//!
//! In the contact, boxes fill the space between indenter and layer, with the metal of the indenter or with
//! the material of the layer ([`super::films`]).

use elastocap_electrostatics::Rounded;
use elastocap_geometry::scene::Box3;

use super::axes::Piece;
use super::contact::{Edge, Surface, edges};
use super::films::{Contact, Film};
use super::profile::Profile;
use crate::scene::indenter::{IndenterForm, Rounding};

/// Degree of the map's polynomials along the faces of the box, and over its height. Tuned: time and
/// `geometry_error_estimate` of `elastocap run cases/approach-to-touch.toml`.
const ALONG: usize = 10;
const OVER_HEIGHT: usize = 12;

/// Smallest and largest half width of the lower face of a ball, over its radius. A narrower face bends the
/// sides of the box so much that the solver's preconditioner fails. Tuned: time the runs of the balls in
/// docs/change.md, section "Reach".
const NARROWEST: f64 = 0.3;
const WIDEST: f64 = 0.55;

/// Rise of the lower face of a ball from its lowest point to its edges, over the distance from the layer.
/// Tuned: time the runs of the balls in docs/change.md, section "Reach".
const SAGITTA: f64 = 2.0;

/// Half width of the lower face of a ball, over the radius of the contact.
const BEYOND_CONTACT: f64 = 1.5;

/// Share of its largest width above which a gap closed by metal counts towards the error: closing a narrower
/// one changes nothing. Tuned: time and `geometry_error_estimate` of
/// `elastocap run cases/approach-to-touch.toml`.
const COUNTED: f64 = 0.1;

/// Least depth below its box to which the map of a distant indenter reaches, over half the width of the
/// indenter. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const BELOW: f64 = 0.5;

/// Half widths of the boxes that fill a circular contact, over its radius. Their corners lie on the circle.
const FILL: [[f64; 2]; 3] = [[0.92, 0.39], [0.70, 0.71], [0.39, 0.92]];

/// The share of the circle that counts as unfilled in the error; by area these boxes leave 0.154 of it. It is
/// not tuned.
const UNFILLED: f64 = 0.12;

/// Smallest radius of a circular contact that is filled, over the thickness of the film: thinner boxes spoil
/// the solver's preconditioner, and so small a part of the surface matters little.
const SMALLEST_FILLED: f64 = 25.0;

/// The layer under an indenter, deformed by the map of the layer.
pub(super) struct Under<'a> {
    /// The map of the layer, m.
    pub(super) image: &'a dyn Fn([f64; 3]) -> [f64; 3],
    /// The height of the surface in the coordinates of the boxes, m.
    pub(super) surface: f64,
    /// The undeformed thickness of the layer, m.
    pub(super) thickness: f64,
    /// The film between layer and indenter in a contact.
    pub(super) film: Film,
}

/// The map of an indenter.
pub(super) struct IndenterMap {
    form: IndenterForm,
    /// The height of the indenter's lowest point, m.
    lowest: f64,
    /// The box of the indenter before the map.
    region: Box3,
    /// The region outside which the map leaves points in place.
    ends: Box3,
    /// The distances to which the contact reaches to the left and to the right of the middle, in the
    /// coordinates of the boxes, m; zero without contact.
    contact: [f64; 2],
    /// How indenter and layer touch.
    touch: Contact,
    /// The larger of the two lengths of surface, left and right, under a gap that metal closes, m.
    closed: f64,
    /// The height of the surface before the map, m.
    surface: f64,
    /// The outline of a round indenter that is the same all along x3.
    outline: Option<Outline>,
}

/// The outline of an indenter over the layer.
struct Outline {
    profile: Profile,
    /// The left and the right edge of the lower face.
    edges: [Edge; 2],
}

impl IndenterMap {
    /// The map of an indenter with its lowest point at this height, m, over the layer `under` it; `None`
    /// where the surface does not separate from the indenter. `is_half`: left and right are mirror images.
    pub(super) fn new(form: IndenterForm, lowest: f64, under: &Under<'_>, is_half: bool) -> Option<Self> {
        let gap = lowest - (under.image)([form.position, under.surface, 0.0])[1];
        let mut map = Self {
            form,
            lowest,
            region: form.bounds(under.surface),
            ends: Box3::SPACE,
            contact: [0.0; 2],
            touch: Contact::of(&form, under.film, gap),
            closed: 0.0,
            surface: under.surface,
            outline: None,
        };
        match (form.rounding, Profile::of(&form)) {
            (Rounding::Ball { radius }, _) => map.lay_ball(radius, under),
            (_, Some(profile)) => map.lay_outline(profile, under, is_half)?,
            (Rounding::Sharp | Rounding::AlongX3 { .. }, None) => map.lay_sharp(under),
        }
        let reach = under.thickness;
        let [along, across] = form.half_widths;
        let beside = |bulge: f64, half: f64| half + (2.0 * bulge).max(reach);
        let Box3 { min, max } = map.region;
        let left = beside(along - (form.position - min[0]), along);
        let right = beside(along - (max[0] - form.position), along);
        let z = beside(across - max[2], across);
        let up = max[1] + (form.height * 0.5).max(reach);
        // Space far below the indenter stays in place.
        let bulge = (min[1] - map.surface - gap).max(0.0);
        let down = (2.0 * bulge).max(reach).max(BELOW * along);
        let low = if gap > 0.0 { (min[1] - down).max(map.surface) } else { map.surface };
        map.ends = Box3 { min: [form.position - left, low, -z], max: [form.position + right, up, z] };
        Some(map)
    }

    /// Ends the map at the walls of the `domain` that it would cross; `None` where the box of the indenter
    /// does not fit between them.
    pub(super) fn between_walls(mut self, domain: &Box3) -> Option<Self> {
        for a in 0..3 {
            self.ends.min[a] = self.ends.min[a].max(domain.min[a]);
            self.ends.max[a] = self.ends.max[a].min(domain.max[a]);
        }
        let fits = (0..3).all(|a| self.ends.max[a] > self.region.max[a])
            && [0, 2].iter().all(|&a| self.ends.min[a] < self.region.min[a]);
        fits.then_some(self)
    }

    /// The thickness of the film by which the surface is displaced from the indenter, m; zero without one.
    pub(super) fn film(&self) -> f64 {
        self.touch.moved().unwrap_or(0.0)
    }

    /// The region that the map of the indenter changes, including the film; `highest` is the height of the
    /// highest body in the layer, m.
    pub(super) fn zone(&self, highest: f64) -> Box3 {
        let Box3 { min: [left, low, near], max } = self.ends;
        Box3 { min: [left, if self.film() > 0.0 { highest } else { low }, near], max }
    }

    /// The displacement of a point by the film, m: the full thickness under the box, falling to zero at the
    /// ends of the map and at the height `from`. `under` is the layer without the film.
    pub(super) fn lowered(&self, x: [f64; 3], from: f64, under: &Under<'_>) -> [f64; 3] {
        let film = self.film();
        if film == 0.0 {
            return [0.0; 3];
        }
        let up = if x[1] <= self.surface {
            (x[1] - from) / (self.surface - from)
        } else {
            (self.ends.max[1] - x[1]) / (self.ends.max[1] - self.surface)
        };
        let beside = [0, 2].map(|a| {
            let (low, high) = (self.region.min[a], self.region.max[a]);
            let (beyond, room) = if x[a] < low {
                (low - x[a], low - self.ends.min[a])
            } else {
                (x[a] - high, self.ends.max[a] - high)
            };
            (1.0 - beyond / room).clamp(0.0, 1.0)
        });
        let share = up.clamp(0.0, 1.0) * beside[0] * beside[1];
        if share == 0.0 {
            return [0.0; 3];
        }
        let normal = match &self.outline {
            None => [0.0, -1.0],
            Some(outline) => {
                let inside = [0, 2].map(|a| x[a].clamp(self.region.min[a], self.region.max[a]));
                let to = (under.image)([inside[0], under.surface, inside[1]]);
                outline.profile.foot([to[0] - self.form.position, to[1] - self.lowest]).normal
            }
        };
        [normal[0], normal[1], 0.0].map(|n| share * film * n)
    }

    /// Places the box of a sharp indenter, on the layer or above it.
    fn lay_sharp(&mut self, under: &Under<'_>) {
        let image = |x: [f64; 3]| (under.image)(x);
        let top = image([self.form.position, under.surface, 0.0])[1];
        let distance = (self.lowest - top).max(0.0);
        // The coordinate whose image is the corner of the indenter.
        let edge = |sign: f64| {
            let wanted = self.form.position + sign * self.form.half_widths[0];
            let mut x = wanted;
            for _ in 0..20 {
                x += wanted - image([x, under.surface, 0.0])[0];
            }
            x
        };
        if distance <= 0.5 * under.film.thickness {
            (self.region.min[0], self.region.max[0]) = (edge(-1.0), edge(1.0));
        } else {
            self.region.min[1] += distance;
            self.region.max[1] += distance;
        }
    }

    /// Places the box of a ball, on the layer or above it.
    fn lay_ball(&mut self, radius: f64, under: &Under<'_>) {
        let Self { form, lowest, .. } = *self;
        let gap = |x: f64| {
            let to = (under.image)([form.position + x, under.surface, 0.0]);
            lowest + self.lower_side(to[0] - form.position, 0.0) - to[1]
        };
        let distance = gap(0.0).max(0.0);
        let widest = WIDEST * radius;
        let film = self.film();
        let contact = if film > 0.0 { last_within(&gap, self.touch.touching(), 0.0, widest) } else { 0.0 };
        let rise = SAGITTA * distance.max(5.0 * film).max(0.02 * under.film.thickness);
        let chord = (radius * radius - (radius - rise.min(radius)).powi(2)).sqrt();
        let half = chord.max(BEYOND_CONTACT * contact).max(NARROWEST * radius).min(widest);
        let room = (gap(half) + film).max(0.02 * under.film.thickness);
        let over = 2.0 * (radius * radius - half * half).sqrt();
        self.contact = [contact; 2];
        self.region = Box3 {
            min: [form.position - half, under.surface + room, -half],
            max: [form.position + half, under.surface + room + over, half],
        };
    }

    /// Places the box of an indenter with an outline, on the layer or above it. `None` where the surface does
    /// not separate from the outline.
    fn lay_outline(&mut self, profile: Profile, under: &Under<'_>, is_half: bool) -> Option<()> {
        let Self { form, lowest, .. } = *self;
        let image = |x: f64| {
            let to = (under.image)([form.position + x, under.surface, 0.0]);
            [to[0] - form.position, to[1] - lowest]
        };
        let surface = Surface { image: &image, thickness: under.thickness, contact: self.touch };
        let edges = edges(&profile, &surface, is_half)?;
        let gap = |x: f64| profile.facing(image(x), self.touch.moved()).gap;
        let [left, right] = &edges;
        let room = (gap(-left.at).max(gap(right.at)) + self.film()).max(0.02 * under.film.thickness);
        let side = |edge: &Edge| profile.side_end(edge.along) - edge.along;
        let over = side(left).max(side(right));
        let across = form.half_widths[1];
        self.region = Box3 {
            min: [form.position - left.at, under.surface + room, -across],
            max: [form.position + right.at, under.surface + room + over, across],
        };
        // Both are zero without contact.
        self.contact = [left.contact, right.contact];
        if let Contact::Closed(width) = self.touch {
            let open = |sign: f64, end: f64| end - last_within(&|x| gap(sign * x), COUNTED * width, 0.0, end);
            self.closed = open(-1.0, left.contact).max(open(1.0, right.contact));
        }
        self.outline = Some(Outline { profile, edges });
        Some(())
    }

    /// The height of the indenter's lower side above its lowest point, at a place from its middle, m.
    fn lower_side(&self, x: f64, z: f64) -> f64 {
        self.form.lower_side(x, z)
    }

    /// The box of the indenter before the map.
    pub(super) fn region(&self) -> Box3 {
        self.region
    }

    /// The sides on which the image of the box has no edges: all of them for a ball, all around the axis for
    /// a cylinder.
    pub(super) fn rounded(&self) -> Option<Rounded> {
        let is_ball = matches!(self.form.rounding, Rounding::Ball { .. });
        let is_round = is_ball || matches!(self.form.rounding, Rounding::AlongX3 { is_cylinder: true, .. });
        is_round.then_some(Rounded { region: self.region, across: [true, true, is_ball] })
    }

    /// The boxes that fill the contact, with metal or with the material of the layer.
    pub(super) fn filled(&self) -> Vec<Box3> {
        if self.contact == [0.0; 2] || self.is_tiny() {
            return Vec::new();
        }
        let shares = match self.form.rounding {
            Rounding::Ball { .. } => FILL.to_vec(),
            Rounding::Sharp | Rounding::AlongX3 { .. } => vec![[1.0, f64::INFINITY]],
        };
        let filled = |[along, across]: [f64; 2]| {
            let [left, right] = self.contact.map(|contact| along * contact);
            let z = (across * self.contact[0]).min(self.region.max[2]);
            Box3 {
                min: [self.form.position - left, self.surface, -z],
                max: [self.form.position + right, self.region.min[1], z],
            }
        };
        shares.into_iter().map(filled).collect()
    }

    /// Whether the boxes that fill the contact are of the metal of the indenter.
    pub(super) fn is_joined(&self) -> bool {
        matches!(self.touch, Contact::Closed(_))
    }

    /// Whether the contact is a circle that is too small to be filled.
    fn is_tiny(&self) -> bool {
        matches!(self.form.rounding, Rounding::Ball { .. }) && self.contact[0] < SMALLEST_FILLED * self.film()
    }

    /// An estimate, about an upper limit, of the relative error of capacitances that the film or the closed
    /// gap leaves, at this distance (m) from the electrodes. `contrast` is the permittivity of the layer over
    /// that of the medium in the gap.
    pub(super) fn film_error(&self, distance: f64, contrast: f64) -> f64 {
        if let Contact::Closed(width) = self.touch {
            // On average the metal closes half of the width. Filled with the material of the layer, that is
            // `contrast` times as thick, and only beside the contact.
            let covered = (2.0 * self.closed / distance).min(1.0);
            return 0.5 * contrast.max(1.0) * width / distance * covered;
        }
        // The error of the part of the contact that is not filled.
        let unfilled = match self.form.rounding {
            Rounding::Ball { .. } if self.is_tiny() => {
                contrast * (self.contact[0] / distance).powi(2).min(1.0)
            }
            Rounding::Ball { .. } => UNFILLED * contrast,
            Rounding::Sharp | Rounding::AlongX3 { .. } => 0.0,
        };
        (unfilled + 0.5) * self.film() / distance
    }

    /// The place on the indenter, m, to which the map takes the point `c` of the surface of the box.
    fn target(&self, c: [f64; 3], under: &Under<'_>) -> [f64; 3] {
        if let Some(outline) = &self.outline {
            return self.on_outline(outline, c, under);
        }
        let Box3 { min, max } = self.region;
        let up = (c[1] - min[1]) / (max[1] - min[1]);
        // The points of the lower face lie above those of the layer, which may have slid along it.
        let foot = [c[0], min[1], c[2]];
        let to = (under.image)([c[0], under.surface, c[2]]);
        let lies_on_layer = min[1] <= self.surface;
        let height = if lies_on_layer {
            to[1]
        } else {
            self.lowest + self.lower_side(to[0] - self.form.position, to[2])
        };
        let above = [to[0], height, to[2]];
        let (on_form, foot_on_form) = (self.on_form(c), self.on_form(foot));
        [0, 1, 2].map(|a| on_form[a] + (1.0 - up) * (above[a] - foot_on_form[a]))
    }

    /// The place, m, to which the map takes the point `c` of the surface of the box of an indenter with an
    /// outline. The lower face maps to the feet of the surface below it, the sides to the rest of the
    /// outline, and the upper face to the straight line between the sides, or, for a cylinder, to the mirror
    /// image of the lower face.
    fn on_outline(&self, outline: &Outline, c: [f64; 3], under: &Under<'_>) -> [f64; 3] {
        let Outline { profile, .. } = outline;
        let Box3 { min, max } = self.region;
        let middle = [self.form.position, self.lowest];
        let share = [0, 1].map(|a| (c[a] - min[a]) / (max[a] - min[a]));
        let feet = |x: f64| {
            let to = (under.image)([x, under.surface, c[2]]);
            // The surface already includes the displacement by the film.
            let film = self.touch.moved().map(|_| 0.0);
            let facing = profile.facing([to[0] - middle[0], to[1] - middle[1]], film);
            (facing.along.abs(), facing.along, to[2])
        };
        let side = |edge: f64, up: f64| {
            let (begin, sign, _) = feet(edge);
            let end = profile.side_end(begin);
            let ([x, y], _) = profile.point(begin + up * (end - begin));
            [x.copysign(sign), y]
        };
        let (along, sign, z) = feet(c[0]);
        let (foot, normal) = profile.point(along);
        let on_outline = [foot[0].copysign(sign), foot[1]];
        let foot = match self.inside(c[0]) {
            Some(inside) => {
                let to = (under.image)([c[0], under.surface, c[2]]);
                [
                    to[0] - middle[0] - inside * normal[0].copysign(sign),
                    to[1] - middle[1] - inside * normal[1],
                ]
            }
            None => on_outline,
        };
        let upper = |s: f64| {
            if profile.is_cylinder {
                return [on_outline[0], 2.0 * profile.radius - on_outline[1]];
            }
            let [left, right] = [side(min[0], 1.0), side(max[0], 1.0)];
            [0, 1].map(|a| (1.0 - s) * left[a] + s * right[a])
        };
        let [s, up] = share;
        let [left, right] = [side(min[0], up), side(max[0], up)];
        let corners = [side(min[0], 0.0), side(max[0], 0.0), side(min[0], 1.0), side(max[0], 1.0)];
        let top = upper(s);
        let at = [0, 1].map(|a| {
            let lower = (1.0 - s) * corners[0][a] + s * corners[1][a];
            let above = (1.0 - s) * corners[2][a] + s * corners[3][a];
            (1.0 - s) * left[a] + s * right[a] + (1.0 - up) * (foot[a] - lower) + up * (top[a] - above)
        });
        [middle[0] + at[0], middle[1] + at[1], c[2] + (1.0 - up) * (z - c[2])]
    }

    /// The depth inside the indenter, m, to which the map takes the point of the box's lower face at `x`, if
    /// metal fills the space below it; `None` elsewhere. The space between box and layer is all metal there,
    /// so that the depth is free. But the map continues beyond the ends of the indenter along x3, and must
    /// not flatten the space between box and layer there.
    fn inside(&self, x: f64) -> Option<f64> {
        let side = usize::from(x > self.form.position);
        let share = (x - self.form.position).abs() / self.contact[side];
        let room = self.region.min[1] - self.surface;
        let Contact::Closed(width) = self.touch else { return None };
        (share < 1.0).then_some(width + (room - width) * (1.0 - share.powi(8)))
    }

    /// The place on a ball or a sharp indenter, m, of the point `c` of the surface of the box, if the layer
    /// does not slide along the indenter.
    fn on_form(&self, c: [f64; 3]) -> [f64; 3] {
        let Box3 { min, max } = self.region;
        let half = 0.5 * (max[0] - min[0]);
        let middle = self.form.position;
        let x = c[0] - middle;
        let up = ((c[1] - min[1]) / (max[1] - min[1])).clamp(0.0, 1.0);
        match self.form.rounding {
            Rounding::Sharp | Rounding::AlongX3 { .. } => {
                let [along, _] = self.form.half_widths;
                // Sliding of the layer may shift the middle of the box from that of the indenter.
                let share = (c[0] - min[0]) / (max[0] - min[0]);
                [middle - along + share * 2.0 * along, self.lowest + up * self.form.height, c[2]]
            }
            Rounding::Ball { radius } => {
                let out = x.hypot(c[2]);
                let edge = (out / radius).min(1.0).asin();
                let is_side = (x.abs() - half).abs().min((c[2].abs() - half).abs()) <= 1e-12 * half;
                let angle = match (is_side, up) {
                    (true, up) => edge + up * (std::f64::consts::PI - 2.0 * edge),
                    (false, up) if up < 0.5 => edge,
                    (false, _) => std::f64::consts::PI - edge,
                };
                let outward = if out > 0.0 { radius * angle.sin() / out } else { 0.0 };
                [middle + outward * x, self.lowest + radius * (1.0 - angle.cos()), outward * c[2]]
            }
        }
    }

    /// The displacement that the indenter adds to that of the layer, m; `on_face` is that of the faces of its
    /// box, [`Self::on_face`].
    pub(super) fn displacement(&self, x: [f64; 3], on_face: &dyn Fn([f64; 3]) -> [f64; 3]) -> [f64; 3] {
        let Box3 { min, max } = self.region;
        let mut share = 1.0;
        for a in 0..3 {
            let (beyond, room) = if x[a] < min[a] {
                (min[a] - x[a], min[a] - self.ends.min[a])
            } else {
                (x[a] - max[a], self.ends.max[a] - max[a])
            };
            if beyond > 0.0 {
                share *= if room > 0.0 { (1.0 - beyond / room).max(0.0) } else { 0.0 };
            }
        }
        if share == 0.0 || (x[1] <= self.surface && min[1] > self.surface) {
            return [0.0; 3];
        }
        let in_box = self.of_box([0, 1, 2].map(|a| x[a].clamp(min[a], max[a])), on_face);
        in_box.map(|u| share * u)
    }

    /// The displacement that the indenter adds at a point of the faces of its box, m.
    pub(super) fn on_face(&self, c: [f64; 3], under: &Under<'_>) -> [f64; 3] {
        let (to, layer) = (self.target(c, under), (under.image)(c));
        [0, 1, 2].map(|a| to[a] - layer[a])
    }

    /// The displacement in the box, from that of its faces.
    fn of_box(&self, c: [f64; 3], on_face: &dyn Fn([f64; 3]) -> [f64; 3]) -> [f64; 3] {
        let Box3 { min, max } = self.region;
        if (0..3).any(|a| c[a] == min[a] || c[a] == max[a]) {
            return on_face(c);
        }
        // Coons's blend: faces, minus edges, plus corners.
        let share = [0, 1, 2].map(|a| (c[a] - min[a]) / (max[a] - min[a]));
        let mut blended = [0.0; 3];
        for axes in 1..8_usize {
            let sign = if axes.count_ones() % 2 == 1 { 1.0 } else { -1.0 };
            for sides in 0..8_usize {
                if sides & !axes != 0 {
                    continue;
                }
                let (mut on_boundary, mut weight) = (c, sign);
                for a in (0..3).filter(|a| axes >> a & 1 == 1) {
                    let upper = sides >> a & 1 == 1;
                    on_boundary[a] = if upper { max[a] } else { min[a] };
                    weight *= if upper { share[a] } else { 1.0 - share[a] };
                }
                let displacement = on_face(on_boundary);
                (0..3).for_each(|a| blended[a] += weight * displacement[a]);
            }
        }
        blended
    }

    /// The intervals of each axis in which the map of the indenter is polynomial.
    pub(super) fn pieces(&self) -> [Vec<Piece>; 3] {
        let Box3 { min, max } = self.region;
        let (first, last) = (self.ends.min, self.ends.max);
        let middle = self.form.position;
        let mut along = vec![Piece::new(first[0], min[0], 2), Piece::new(max[0], last[0], 2)];
        let mut places = vec![min[0], middle, max[0]];
        match &self.outline {
            Some(Outline { edges: [left, right], .. }) => {
                places.extend(left.marks.iter().map(|x| middle - x));
                places.extend(right.marks.iter().map(|x| middle + x));
            }
            None => places.extend([middle - self.contact[0], middle + self.contact[1]]),
        }
        places.sort_by(f64::total_cmp);
        along.extend(places.windows(2).map(|ends| Piece::new(ends[0], ends[1], ALONG)));
        let degree = if matches!(self.form.rounding, Rounding::Ball { .. }) { ALONG } else { 1 };
        let mut across = vec![Piece::new(first[2], min[2], 2), Piece::new(max[2], last[2], 2)];
        across.extend([Piece::new(min[2], 0.0, degree), Piece::new(0.0, max[2], degree)]);
        let mut up = vec![Piece::new(first[1], min[1], 2), Piece::new(max[1], last[1], 2)];
        match &self.outline {
            Some(Outline { profile, edges }) if !profile.is_cylinder => {
                let mut heights = vec![min[1], max[1]];
                for edge in edges {
                    let share =
                        (profile.round_end() - edge.along) / (profile.side_end(edge.along) - edge.along);
                    if share > 0.0 {
                        heights.push(min[1] + share * (max[1] - min[1]));
                    }
                }
                heights.sort_by(f64::total_cmp);
                let degrees = |low: f64| if low < heights[heights.len() - 2] { ALONG } else { 2 };
                up.extend(heights.windows(2).map(|ends| Piece::new(ends[0], ends[1], degrees(ends[0]))));
            }
            None if self.form.rounding == Rounding::Sharp => up.push(Piece::new(min[1], max[1], 1)),
            _ => up.push(Piece::new(min[1], max[1], OVER_HEIGHT)),
        }
        [along, up, across]
    }
}

/// The largest sampled distance from the middle, between `least` and `most`, up to which the gap does not
/// exceed a `width`, all in m; 0 if the gap exceeds the width already at `least`.
pub(super) fn last_within(gap: &dyn Fn(f64) -> f64, width: f64, least: f64, most: f64) -> f64 {
    // Not tuned: they only have to be close together.
    const PLACES: usize = 400;
    let place = |k: usize| least + (most - least) * k as f64 / PLACES as f64;
    let beyond = (0..=PLACES).find(|k| gap(place(*k)) > width);
    match beyond {
        None => most,
        Some(0) => 0.0,
        Some(k) => place(k - 1),
    }
}
