//! Generates case files from a few numbers.

use std::fmt::Write as _;

/// A length in metres as a case file has it.
pub(super) fn metres(length: f64) -> String {
    format!("\"{length:e} m\"")
}

/// A point as a case file has it.
fn point<const N: usize>(coordinates: [f64; N]) -> String {
    format!("[{}]", coordinates.map(metres).join(", "))
}

/// A scene without layer.
#[derive(Debug, Clone, Default)]
pub(super) struct Scene {
    text: String,
}

impl Scene {
    pub(super) fn new() -> Self {
        Self { text: "format = 1\n".to_owned() }
    }

    fn add(mut self, arguments: std::fmt::Arguments<'_>) -> Self {
        // Writing to a String cannot fail.
        let _ = self.text.write_fmt(arguments);
        self
    }

    pub(super) fn conductor(self, name: &str, min: [f64; 3], max: [f64; 3]) -> Self {
        let (min, max) = (point(min), point(max));
        self.add(format_args!("[[conductor]]\nname = \"{name}\"\nbox = {{ min = {min}, max = {max} }}\n"))
    }

    /// Adds a conducting cube with its middle at `centre`.
    pub(super) fn cube(self, name: &str, centre: [f64; 3], side: f64) -> Self {
        self.conductor(name, centre.map(|c| c - 0.5 * side), centre.map(|c| c + 0.5 * side))
    }

    /// Adds a conducting sheet across x2, at the height `at`; its corners `min` and `max` are (x1, x3).
    pub(super) fn sheet(self, name: &str, at: f64, min: [f64; 2], max: [f64; 2]) -> Self {
        let (at, min, max) = (metres(at), point(min), point(max));
        self.add(format_args!(
            "[[conductor]]\nname = \"{name}\"\nsheet = {{ normal = \"x2\", at = {at}, min = {min}, max = {max} }}\n"
        ))
    }

    pub(super) fn dielectric(self, permittivity: f64, min: [f64; 3], max: [f64; 3]) -> Self {
        let (min, max) = (point(min), point(max));
        self.add(format_args!(
            "[[dielectric]]\nname = \"body\"\nrelative_permittivity = {permittivity:e}\n\
             box = {{ min = {min}, max = {max} }}\n"
        ))
    }

    /// Adds a dielectric that fills all space between two planes across `axis` (1, 2 or 3).
    pub(super) fn slab(self, axis: usize, permittivity: f64, from: f64, to: f64) -> Self {
        let (from, to) = (metres(from), metres(to));
        self.add(format_args!(
            "[[dielectric]]\nname = \"slab{axis}-{}\"\nrelative_permittivity = {permittivity:e}\n\
             slab = {{ axis = \"x{axis}\", from = {from}, to = {to} }}\n",
            from.trim_matches('"')
        ))
    }

    fn surroundings(self, boundary: &str, walls: &str, permittivity: f64, solve: Solve) -> String {
        self.add(format_args!(
            "[surroundings]\nboundary = \"{boundary}\"\nrelative_permittivity = {permittivity:e}\n{walls}{solve}"
        ))
        .text
    }

    /// The case in open space of this permittivity.
    pub(super) fn open_in(self, permittivity: f64, solve: Solve) -> String {
        self.surroundings("open", "", permittivity, solve)
    }

    pub(super) fn open(self, solve: Solve) -> String {
        self.open_in(1.0, solve)
    }

    pub(super) fn grounded_in(self, permittivity: f64, min: [f64; 3], max: [f64; 3], solve: Solve) -> String {
        let walls = format!("walls = {{ min = {}, max = {} }}\n", point(min), point(max));
        self.surroundings("grounded", &walls, permittivity, solve)
    }

    pub(super) fn grounded(self, min: [f64; 3], max: [f64; 3], solve: Solve) -> String {
        self.grounded_in(1.0, min, max, solve)
    }

    pub(super) fn insulated(self, min: [f64; 3], max: [f64; 3], solve: Solve) -> String {
        let walls = format!("walls = {{ min = {}, max = {} }}\n", point(min), point(max));
        self.surroundings("insulated", &walls, 1.0, solve)
    }
}

/// The accuracy of a solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solve {
    tolerance: f64,
    bounds: bool,
}

/// A solve to this spread of the bounds.
pub(super) fn to(tolerance: f64) -> Solve {
    Solve { tolerance, bounds: true }
}

/// A solve to this estimated error, without bounds.
pub(super) fn estimated(tolerance: f64) -> Solve {
    Solve { tolerance, bounds: false }
}

impl std::fmt::Display for Solve {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { tolerance, bounds } = self;
        write!(f, "[electrostatics]\nrelative_tolerance = {tolerance:e}\nbounds = {bounds}\n")
    }
}

/// A pair of electrodes in a layer: the paper's sensor, with a few numbers changed by each entry. Lengths in
/// m.
#[derive(Debug, Clone)]
pub(super) struct Sensor {
    /// Whether the electrodes lie one above the other; otherwise they lie side by side.
    pub(super) stacked: bool,
    /// The thickness of the layer.
    pub(super) layer: f64,
    pub(super) gap: f64,
    pub(super) length: f64,
    pub(super) thickness: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    /// The shear modulus as the file has it, or `None` for rigid electrodes.
    pub(super) modulus: Option<f64>,
    /// The half-length and the width of the contact.
    pub(super) contact: f64,
    pub(super) shear_length: f64,
    /// The line of `[load]`; `None` for a sensor without load.
    pub(super) load: Option<String>,
    pub(super) boundary: &'static str,
    /// The distance of the side walls from the electrodes; `None` without walls.
    pub(super) margin: Option<f64>,
    /// What is below the layer, as the file has it.
    pub(super) below: String,
    /// What is above the layer, as the file has it.
    pub(super) above: String,
    /// The relative tolerance.
    pub(super) tolerance: f64,
}

/// The constants c10 and c01 of the paper, Pa.
const CONSTANTS: [f64; 2] = [682.15, 43931.9];
/// The shear modulus that these constants give, Pa.
pub(super) const MODULUS: f64 = 2.0 * (CONSTANTS[0] + CONSTANTS[1]);

/// The value of `below` or `above` for an insulated face of the layer.
pub(super) const INSULATED: &str = "\"insulated\"";
/// The value of `below` or `above` for a grounded face of the layer.
pub(super) const GROUNDED: &str = "\"grounded\"";

/// A medium of some thickness (m); unbounded if that is infinite.
pub(super) fn medium(permittivity: f64, thickness: f64) -> String {
    let thickness = if thickness.is_finite() { metres(thickness) } else { "\"open\"".to_owned() };
    format!("{{ relative_permittivity = {permittivity:e}, thickness = {thickness} }}")
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            stacked: false,
            layer: 450e-6,
            gap: 50e-6,
            length: 300e-6,
            thickness: 20e-6,
            width: 500e-6,
            height: 225e-6,
            modulus: Some(1e6),
            contact: 500e-6,
            shear_length: 500e-6,
            load: None,
            boundary: "insulated",
            margin: Some(1e-3),
            below: INSULATED.to_owned(),
            above: medium(1.0, 1e-3),
            tolerance: 1e-3,
        }
    }
}

impl Sensor {
    pub(super) fn compressed(mut self, compression: f64) -> Self {
        self.load = Some(format!("compression = [{compression:e}]"));
        self
    }

    pub(super) fn pressed(mut self, force: f64) -> Self {
        self.load = Some(format!("force = [\"{force:e} N\"]"));
        self
    }

    pub(super) fn text(&self) -> String {
        let kind = if self.stacked { "stacked_pair" } else { "in_plane_pair" };
        let modulus = self.modulus.map_or("\"rigid\"".to_owned(), |modulus| format!("\"{modulus:e} Pa\""));
        let load = self.load.as_ref().map_or(String::new(), |load| {
            let (contact, shear) = (metres(self.contact), metres(self.shear_length));
            format!(
                "[mechanics.closed_form]\ncontact_half_length = {contact}\ncontact_width = {contact}\n\
                 shear_length = {shear}\n[load]\n{load}\n"
            )
        });
        let margin =
            self.margin.map_or(String::new(), |margin| format!("side_margin = {}\n", metres(margin)));
        format!(
            "format = 1\n[layer]\nthickness = {}\nrelative_permittivity = 2.8\n\
             [layer.material.mooney_rivlin]\nc10 = \"{} Pa\"\nc01 = \"{} Pa\"\n\
             [electrodes.{kind}]\ngap = {}\nlength = {}\nthickness = {}\nwidth = {}\nheight = {}\n\
             shear_modulus = {modulus}\n{load}\
             [surroundings]\nboundary = \"{}\"\n{margin}below = {}\nabove = {}\n{}",
            metres(self.layer),
            CONSTANTS[0],
            CONSTANTS[1],
            metres(self.gap),
            metres(self.length),
            metres(self.thickness),
            metres(self.width),
            metres(self.height),
            self.boundary,
            self.below,
            self.above,
            to(self.tolerance),
        )
    }
}
