//! A round indenter as the image of a box above the layer.
//!
//! The box is bulged: its lower face is the part of the indenter that looks at the layer, its edges lie on the indenter, and its other
//! faces take the rest. So bodies that are smooth stay smooth, and no angle of the space outside is bent flat. The displacement of a
//! point of a face falls to zero over the distance to the surface of the layer, and to the ends of the map on the other sides.
//!
//! Where the two touch there is no space between them. The surface of the layer is lowered by a film there, which is filled with the
//! material of the layer as far as boxes fill the contact.

use elastocap_geometry::scene::Box3;

use super::axes::Piece;
use crate::scene::indenter::{IndenterForm, Rounding};

/// Degree of the map's polynomials along the faces of the box, and over its height.
const ALONG: usize = 10;
const OVER_HEIGHT: usize = 12;

/// Angles from the axis between which the lower face of a rounded corner ends, and how far beyond the contact it does.
const CORNER: [f64; 2] = [std::f64::consts::FRAC_PI_4, 1.45];
const BEYOND_CORNER: f64 = 0.12;

/// The widest lower face of a cylinder or ball, over its radius.
const WIDEST: f64 = 0.55;

/// Height of the lower face of a cylinder or ball, over the distance from the layer.
const SAGITTA: f64 = 2.0;

/// The lower face reaches this far beyond the contact, over the half width of that.
const BEYOND_CONTACT: f64 = 1.5;

/// Half widths of the boxes that fill a circle of contact, over its radius: corners on the circle.
const FILL: [[f64; 2]; 3] = [[0.92, 0.39], [0.70, 0.71], [0.39, 0.92]];

/// The share of the circle that they leave.
const UNFILLED: f64 = 0.12;

/// The layer under an indenter, as the map of the layer has it.
pub(super) struct Under<'a> {
    /// Where points go, m.
    pub(super) image: &'a dyn Fn([f64; 3]) -> [f64; 3],
    /// The height of the surface in the coordinates of the boxes, m.
    pub(super) surface: f64,
    /// The undeformed thickness of the layer, m.
    pub(super) thickness: f64,
    /// Of the film where the two touch, m.
    pub(super) film: f64,
}

/// The map of an indenter.
pub(super) struct IndenterMap {
    form: IndenterForm,
    /// The height of its lowest point, m.
    lowest: f64,
    /// The box in the coordinates of the boxes.
    region: Box3,
    /// Where the map ends.
    ends: Box3,
    /// Half of the width of the contact in these coordinates, m; zero without contact.
    contact: f64,
    /// Of the film where the two touch, m; zero where they do not, or where the box lies on the layer.
    pub(super) film: f64,
    surface: f64,
}

impl IndenterMap {
    /// For an indenter with its lowest point at a height, m, over the layer before this is lowered; `None` where it does not fit between
    /// the walls of the `domain`.
    pub(super) fn new(form: IndenterForm, lowest: f64, under: &Under<'_>, domain: &Box3) -> Option<Self> {
        let touches = lowest - (under.image)([form.position, under.surface, 0.0])[1] < 0.5 * under.film;
        let is_sharp = form.rounding == Rounding::Sharp;
        let mut own = Self {
            form,
            lowest,
            region: form.bounds(under.surface),
            ends: Box3::SPACE,
            contact: 0.0,
            film: if touches && !is_sharp { under.film } else { 0.0 },
            surface: under.surface,
        };
        if is_sharp {
            own.lay_sharp(under);
        } else {
            own.lay_round(under);
        }
        let reach = under.thickness;
        let [along, across] = form.half_widths;
        let beside = |bulge: f64, half: f64| half + (2.0 * bulge).max(reach);
        let bulges = [along - (own.region.max[0] - form.position), across - own.region.max[2]];
        let [x, z] = [beside(bulges[0], along), beside(bulges[1], across)];
        let up = own.region.max[1] + (form.height * 0.5).max(reach);
        own.ends = Box3 {
            min: [form.position - x, own.surface, -z],
            max: [form.position + x, up, z],
        };
        for a in 0..3 {
            own.ends.min[a] = own.ends.min[a].max(domain.min[a]);
            own.ends.max[a] = own.ends.max[a].min(domain.max[a]);
        }
        let fits = (0..3).all(|a| own.ends.max[a] > own.region.max[a]);
        (fits && [0, 2].iter().all(|&a| own.ends.min[a] < own.region.min[a])).then_some(own)
    }

    /// How much of the film lies between the layer and what is above it: all of it under the box, and less towards the ends of the map and
    /// down to a height `from`, m.
    pub(super) fn lowered(&self, x: [f64; 3], from: f64) -> f64 {
        if self.film == 0.0 {
            return 0.0;
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
        self.film * up.clamp(0.0, 1.0) * beside[0] * beside[1]
    }

    /// A box that stands on the layer, or above it.
    fn lay_sharp(&mut self, under: &Under<'_>) {
        let to = |x: [f64; 3]| (under.image)(x);
        let at_rest = to([self.form.position, under.surface, 0.0])[1];
        let distance = (self.lowest - at_rest).max(0.0);
        // The corner comes to lie at the corner.
        let edge = |sign: f64| {
            let wanted = self.form.position + sign * self.form.half_widths[0];
            let mut x = wanted;
            for _ in 0..20 {
                x += wanted - to([x, under.surface, 0.0])[0];
            }
            x
        };
        if distance <= 0.5 * under.film {
            (self.region.min[0], self.region.max[0]) = (edge(-1.0), edge(1.0));
        } else {
            self.region.min[1] += distance;
            self.region.max[1] += distance;
        }
    }

    fn lay_round(&mut self, under: &Under<'_>) {
        let Self { form, lowest, .. } = *self;
        let gap = |x: f64| {
            let to = (under.image)([form.position + x, under.surface, 0.0]);
            lowest + self.low(to[0] - form.position, 0.0) - to[1]
        };
        let distance = gap(0.0).max(0.0);
        let flat = form.flat();
        let (radius, has_corners) = match form.rounding {
            Rounding::Sharp => return,
            Rounding::AlongX3 { radius, is_cylinder } => (radius, !is_cylinder),
            Rounding::Ball { radius } => (radius, false),
        };
        let most = if has_corners { flat + radius * CORNER[1].sin() } else { WIDEST * radius };
        let contact = if self.film > 0.0 { last_within(&gap, 0.3 * self.film, flat, most) } else { 0.0 };
        let half = if has_corners {
            let angle = ((contact - flat).max(0.0) / radius).min(1.0).asin() + BEYOND_CORNER;
            flat + radius * angle.clamp(CORNER[0], CORNER[1]).sin()
        } else {
            let rise = SAGITTA * distance.max(5.0 * self.film).max(0.02 * under.film);
            let chord = (radius * radius - (radius - rise.min(radius)).powi(2)).sqrt();
            chord.max(BEYOND_CONTACT * contact).min(most)
        };
        let room = (gap(half) + self.film).max(0.02 * under.film);
        let across = match form.rounding {
            Rounding::Ball { .. } => half,
            Rounding::Sharp | Rounding::AlongX3 { .. } => form.half_widths[1],
        };
        let over = match form.rounding {
            Rounding::Ball { .. } => 2.0 * (radius * radius - half * half).sqrt(),
            Rounding::AlongX3 { is_cylinder: true, .. } => 2.0 * (radius * radius - half * half).sqrt(),
            Rounding::Sharp | Rounding::AlongX3 { .. } => form.height - form.lower_side(half, 0.0),
        };
        self.contact = contact;
        self.region = Box3 {
            min: [form.position - half, under.surface + room, -across],
            max: [form.position + half, under.surface + room + over, across],
        };
    }

    fn low(&self, x: f64, z: f64) -> f64 {
        self.form.lower_side(x, z)
    }

    /// The box of the indenter in the coordinates of the boxes.
    pub(super) fn region(&self) -> Box3 {
        self.region
    }

    /// Boxes of the layer's material that fill the film in the contact.
    pub(super) fn filled(&self) -> Vec<Box3> {
        if self.film == 0.0 || self.contact == 0.0 {
            return Vec::new();
        }
        let shares = match self.form.rounding {
            Rounding::Ball { .. } => FILL.to_vec(),
            Rounding::Sharp | Rounding::AlongX3 { .. } => vec![[1.0, f64::INFINITY]],
        };
        let filled = |[along, across]: [f64; 2]| {
            let [x, z] = [along * self.contact, (across * self.contact).min(self.region.max[2])];
            Box3 {
                min: [self.form.position - x, self.surface, -z],
                max: [self.form.position + x, self.region.min[1], z],
            }
        };
        shares.into_iter().map(filled).collect()
    }

    /// What the film changes in the capacitances, over them, at most about: an estimate, where it is one over this distance (m) from the
    /// electrodes, and of a medium with a permittivity that of the layer is so many times larger than.
    pub(super) fn film_error(&self, distance: f64, contrast: f64) -> f64 {
        let left = match self.form.rounding {
            Rounding::Ball { .. } => UNFILLED * contrast,
            Rounding::Sharp | Rounding::AlongX3 { .. } => 0.0,
        };
        (left + 0.5) * self.film / distance
    }

    /// Where a point of the surface of the box belongs, m.
    fn target(&self, c: [f64; 3], under: &Under<'_>) -> [f64; 3] {
        let ideal = |c: [f64; 3]| self.on_form(c);
        let Box3 { min, max } = self.region;
        let up = (c[1] - min[1]) / (max[1] - min[1]);
        // The points of the lower face lie above those of the layer, wherever these slide.
        let foot = [c[0], min[1], c[2]];
        let to = (under.image)([c[0], under.surface, c[2]]);
        let lies_on_layer = min[1] <= self.surface;
        let height = if lies_on_layer {
            to[1]
        } else {
            self.lowest + self.low(to[0] - self.form.position, to[2])
        };
        let above = [to[0], height, to[2]];
        let (own, below) = (ideal(c), ideal(foot));
        [0, 1, 2].map(|a| own[a] + (1.0 - up) * (above[a] - below[a]))
    }

    /// The point of the indenter that a point of the surface of the box stands for, if the layer does not slide.
    fn on_form(&self, c: [f64; 3]) -> [f64; 3] {
        let Box3 { min, max } = self.region;
        let half = 0.5 * (max[0] - min[0]);
        let middle = self.form.position;
        let x = c[0] - middle;
        let up = ((c[1] - min[1]) / (max[1] - min[1])).clamp(0.0, 1.0);
        match self.form.rounding {
            Rounding::Sharp => {
                let [along, _] = self.form.half_widths;
                // The middle of the box may be off that of the indenter by what the layer slides.
                let share = (c[0] - min[0]) / (max[0] - min[0]);
                [middle - along + share * 2.0 * along, self.lowest + up * self.form.height, c[2]]
            }
            Rounding::AlongX3 { radius, is_cylinder } => {
                let [out, height] = self.side(radius, is_cylinder, c[1] - min[1]);
                let bottom = self.low(x, 0.0) - self.low(half, 0.0);
                let top = if is_cylinder { -bottom } else { 0.0 };
                let height = height + (1.0 - up) * bottom + up * top;
                [middle + x / half * out, self.lowest + height, c[2]]
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

    /// How far out and how high the side of a body along x3 is, `up` along the side of the box, m.
    fn side(&self, radius: f64, is_cylinder: bool, up: f64) -> [f64; 2] {
        let half = 0.5 * (self.region.max[0] - self.region.min[0]);
        let flat = self.form.half_widths[0] - radius;
        let first = ((half - flat) / radius).min(1.0).asin();
        let angle = if is_cylinder {
            let over = self.region.max[1] - self.region.min[1];
            first + up / over * (std::f64::consts::PI - 2.0 * first)
        } else {
            let arc = radius * first.cos();
            if up >= arc {
                return [flat + radius, radius + (up - arc)];
            }
            first + up / arc * (std::f64::consts::FRAC_PI_2 - first)
        };
        [flat + radius * angle.sin(), radius * (1.0 - angle.cos())]
    }

    /// The displacement that the indenter adds to that of the layer, m.
    pub(super) fn displacement(&self, x: [f64; 3], under: &Under<'_>) -> [f64; 3] {
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
        let own = self.of_box([0, 1, 2].map(|a| x[a].clamp(min[a], max[a])), under);
        own.map(|u| share * u)
    }

    /// The displacement in the box, from that of its faces.
    fn of_box(&self, c: [f64; 3], under: &Under<'_>) -> [f64; 3] {
        let Box3 { min, max } = self.region;
        let on_face = |c: [f64; 3]| {
            let (to, layer) = (self.target(c, under), (under.image)(c));
            [0, 1, 2].map(|a| to[a] - layer[a])
        };
        if (0..3).any(|a| c[a] == min[a] || c[a] == max[a]) {
            return on_face(c);
        }
        // Coons's blend: of faces, less edges, with corners.
        let share = [0, 1, 2].map(|a| (c[a] - min[a]) / (max[a] - min[a]));
        let mut out = [0.0; 3];
        for axes in 1..8_usize {
            let sign = if axes.count_ones() % 2 == 1 { 1.0 } else { -1.0 };
            for sides in 0..8_usize {
                if sides & !axes != 0 {
                    continue;
                }
                let (mut at, mut weight) = (c, sign);
                for a in (0..3).filter(|a| axes >> a & 1 == 1) {
                    let upper = sides >> a & 1 == 1;
                    at[a] = if upper { max[a] } else { min[a] };
                    weight *= if upper { share[a] } else { 1.0 - share[a] };
                }
                let own = on_face(at);
                (0..3).for_each(|a| out[a] += weight * own[a]);
            }
        }
        out
    }

    /// Where the map of the indenter is polynomial, along each axis.
    pub(super) fn pieces(&self) -> [Vec<Piece>; 3] {
        let Box3 { min, max } = self.region;
        let (first, last) = (self.ends.min, self.ends.max);
        let middle = self.form.position;
        let mut along = vec![Piece::new(first[0], min[0], 2), Piece::new(max[0], last[0], 2)];
        let mut places = vec![min[0], middle, max[0]];
        if let Rounding::AlongX3 { radius, is_cylinder: false } = self.form.rounding {
            let flat = self.form.half_widths[0] - radius;
            places.extend([middle - flat, middle + flat]);
        }
        if self.contact > 0.0 {
            places.extend([middle - self.contact, middle + self.contact]);
        }
        places.sort_by(f64::total_cmp);
        along.extend(places.windows(2).map(|ends| Piece::new(ends[0], ends[1], ALONG)));
        let degree = if matches!(self.form.rounding, Rounding::Ball { .. }) { ALONG } else { 1 };
        let mut across = vec![Piece::new(first[2], min[2], 2), Piece::new(max[2], last[2], 2)];
        across.extend([Piece::new(min[2], 0.0, degree), Piece::new(0.0, max[2], degree)]);
        let mut up = vec![Piece::new(self.surface, min[1], 2), Piece::new(max[1], last[1], 2)];
        match self.form.rounding {
            Rounding::Sharp => up.push(Piece::new(min[1], max[1], 1)),
            Rounding::AlongX3 { radius, is_cylinder: false } => {
                let out = 0.5 * (max[0] - min[0]) - self.form.flat();
                let arc = min[1] + (radius * radius - out * out).max(0.0).sqrt();
                up.extend([Piece::new(min[1], arc, ALONG), Piece::new(arc, max[1], 2)]);
            }
            Rounding::AlongX3 { .. } | Rounding::Ball { .. } => {
                up.push(Piece::new(min[1], max[1], OVER_HEIGHT));
            }
        }
        [along, up, across]
    }
}

/// The farthest place from the middle up to which the gap stays within a width, m; at least `least`, if it does so there.
pub(super) fn last_within(gap: &dyn Fn(f64) -> f64, width: f64, least: f64, most: f64) -> f64 {
    const PLACES: usize = 400;
    let place = |k: usize| least + (most - least) * k as f64 / PLACES as f64;
    let beyond = (0..=PLACES).find(|k| gap(place(*k)) > width);
    match beyond {
        None => most,
        Some(0) => 0.0,
        Some(k) => place(k - 1),
    }
}
