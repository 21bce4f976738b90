//! The indenter that presses on the layer, as a body of the scene.

use elastocap_case::{Case, FieldIndenter, Indenter, Mechanics};
use elastocap_geometry::scene::{Body, Box3, Purpose};
use elastocap_geometry::shapes::Shape;

use super::neutral::indenter_in_field;

/// The form of an indenter, relative to its lowest point; x1 is that of the layer. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct IndenterForm {
    /// The middle along x1.
    pub(crate) position: f64,
    /// Half of its width along x1 and along x3.
    pub(crate) half_widths: [f64; 2],
    /// The height.
    pub(crate) height: f64,
    /// The rounding of edges or surface.
    pub(crate) rounding: Rounding,
}

/// How an indenter differs from a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rounding {
    /// A box.
    Sharp,
    /// The lower edges along x3 are rounded. For a cylinder lying on the layer the radius is half the width,
    /// and the upper edges are rounded, too.
    AlongX3 {
        /// The radius, m.
        radius: f64,
        /// Whether it is a cylinder.
        is_cylinder: bool,
    },
    /// A sphere.
    Ball {
        /// The radius, m.
        radius: f64,
    },
}

impl IndenterForm {
    /// Whether the lower side is flat up to the edges, or to where these are rounded.
    pub(crate) fn has_flat_face(&self) -> bool {
        match self.rounding {
            Rounding::Sharp | Rounding::AlongX3 { is_cylinder: false, .. } => true,
            Rounding::AlongX3 { is_cylinder: true, .. } | Rounding::Ball { .. } => false,
        }
    }

    /// The form of the indenter of a case; `None` without mechanics, or where the indenter has no form.
    pub(crate) fn of(case: &Case, height: Option<f64>) -> Option<Self> {
        let layer = case.layer.as_ref()?;
        let plate = |half_length: f64, width: f64| Self {
            position: 0.0,
            half_widths: [half_length, 0.5 * width],
            height: height.unwrap_or(2.0 * half_length),
            rounding: Rounding::Sharp,
        };
        match case.mechanics? {
            Mechanics::ClosedForm { contact_half_length, contact_width, .. } => {
                Some(plate(contact_half_length, contact_width))
            }
            finite_elements => {
                let (indenter, width) = finite_elements.indenter()?;
                Some(match indenter {
                    Indenter::WholeTop => plate(layer.half_length?, width),
                    Indenter::FlatPunch { half_width, contact, position } => {
                        let rounding = Rounding::of_corners(contact.corner_radius());
                        Self { position, rounding, ..plate(half_width, width) }
                    }
                    Indenter::Block { half_widths: [along, across], .. } => plate(along, 2.0 * across),
                    Indenter::Cylinder { radius, position } => {
                        Self { position, ..Self::cylinder(radius, width) }
                    }
                    Indenter::Sphere { radius } => Self {
                        position: 0.0,
                        half_widths: [radius; 2],
                        height: 2.0 * radius,
                        rounding: Rounding::Ball { radius },
                    },
                })
            }
        }
    }

    fn cylinder(radius: f64, width: f64) -> Self {
        Self {
            position: 0.0,
            half_widths: [radius, 0.5 * width],
            height: 2.0 * radius,
            rounding: Rounding::AlongX3 { radius, is_cylinder: true },
        }
    }

    /// The height of its lower side above its lowest point, at a place from its middle, m.
    pub(crate) fn lower_side(&self, x: f64, z: f64) -> f64 {
        let round = |radius: f64, out: f64| radius - (radius * radius - out * out).max(0.0).sqrt();
        match self.rounding {
            Rounding::Sharp => 0.0,
            Rounding::AlongX3 { radius, .. } => round(radius, (x.abs() - self.flat()).max(0.0)),
            Rounding::Ball { radius } => round(radius, x.hypot(z)),
        }
    }

    /// Half of the width of its flat face along x1, m.
    pub(crate) fn flat(&self) -> f64 {
        match self.rounding {
            Rounding::Sharp => self.half_widths[0],
            Rounding::AlongX3 { radius, .. } | Rounding::Ball { radius } => self.half_widths[0] - radius,
        }
    }

    /// The shapes that it consists of, with its lowest point at this height above the substrate, m.
    pub(super) fn shapes(&self, lowest: f64) -> Vec<Shape> {
        let hull = self.bounds(lowest);
        let rod = |x: f64, radius: f64| Shape::Cylinder {
            axis: 2,
            base: [x, lowest + radius, hull.min[2]],
            radius,
            height: hull.extent(2),
        };
        match self.rounding {
            Rounding::Sharp => vec![Shape::Box(hull)],
            Rounding::AlongX3 { radius, is_cylinder: true } => vec![rod(self.position, radius)],
            Rounding::AlongX3 { radius, is_cylinder: false } => {
                let (flat, mut above, mut between) = (self.flat(), hull, hull);
                above.min[1] = lowest + radius;
                (between.min[0], between.max[0]) = (self.position - flat, self.position + flat);
                let rods = [-flat, flat].map(|x| rod(self.position + x, radius));
                [Shape::Box(above), Shape::Box(between)].into_iter().chain(rods).collect()
            }
            Rounding::Ball { radius } => {
                vec![Shape::Sphere { center: [self.position, lowest + radius, 0.0], radius }]
            }
        }
    }

    /// The box around it, with its lowest point at this height above the substrate, m.
    pub(crate) fn bounds(&self, lowest: f64) -> Box3 {
        let [along, across] = self.half_widths;
        Box3 {
            min: [self.position - along, lowest, -across],
            max: [self.position + along, lowest + self.height, across],
        }
    }
}

impl Rounding {
    fn of_corners(radius: Option<f64>) -> Self {
        radius.map_or(Self::Sharp, |radius| Self::AlongX3 { radius, is_cylinder: false })
    }
}

/// The radius of a block's rounded edges, which the field neglects, m; zero for any other indenter.
pub(crate) fn edges_left_out(case: &Case) -> f64 {
    match case.mechanics.and_then(|mechanics| mechanics.indenter()) {
        Some((Indenter::Block { corner_radius, .. }, _)) => corner_radius,
        _ => 0.0,
    }
}

/// The indenter of a case as its bounding box, with its lowest point at this height above the substrate, m;
/// `None` if it is not part of the field.
pub(super) fn body(case: &Case, lowest: f64) -> Option<Body> {
    let indenter = indenter_in_field(case)?;
    let form = IndenterForm::of(case, indenter.height)?;
    Some(Body {
        name: FieldIndenter::NAME.to_owned(),
        parts: vec![Shape::Box(form.bounds(lowest))],
        role: indenter.role,
        purpose: Purpose::Indenter,
    })
}
