//! A subcircuit for SPICE, in the syntax that ngspice and LTspice share.
//!
//! Each capacitor conserves charge: a voltage source puts `V(a,b) C(F)/C_0` across a linear capacitor, and
//! its current, times a constant, flows from `a` to `b`. That current is the derivative of the charge and not
//! C dV/dt; over any closed cycle of force and voltage the charge is zero.
//!
//! The cubics between steps are written without conditions. With t_k the position of the force in interval k,
//! clamped to 0..1, the capacitance is its value at the first step plus the sum over the intervals of their
//! contributions up to t_k. The force is thus clamped at both ends as well.

use std::fmt::Write as _;

use crate::header::{self, FLAG_RAMP};
use crate::model::{Branch, Model};

/// The capacitance of the inner linear capacitors, F. Charges are near this number times volts, which suits
/// the tolerances of simulators, made for larger capacitances.
const INNER: &str = "1n";

/// A number in full precision, as SPICE reads it.
fn number(value: f64) -> String {
    format!("{value:e}")
}

/// The text of the file: comments and one `.subckt`.
pub fn subcircuit(model: &Model) -> String {
    let mut out = String::new();
    let pins = pins(model);
    let bands = if model.has_ground_band() { "band=0 band_ground=0" } else { "band=0" };
    for line in header::lines(model) {
        let _ = writeln!(out, "{}", format!("* {line}").trim_end());
    }
    let _ = write!(
        out,
        "*\n\
         * Pins: {pins}\n\
         *   force    1 V is 1 N, against node 0; draws no current\n\
         *   outside  1 V where the force is outside the range, else 0 V; the capacitance is then that at the range's end\n\
         * Use:  X1 {pins} {} band=0\n\
         * Leave no terminal without a path for direct current, as with any capacitor.\n\
         * ngspice reads this file as it is. LTspice is meant to; see docs/circuit-models.md of elastocap.\n\n\
         .subckt {} {pins} params: {bands}\n",
        model.identifier, model.identifier
    );
    bands_and_places(&mut out, model);
    for (k, branch) in model.branches.iter().enumerate() {
        capacitor(&mut out, model, branch, k + 1);
    }
    let _ = writeln!(out, ".ends {}", model.identifier);
    out
}

/// The nodes of the subcircuit, in order.
pub fn pins(model: &Model) -> String {
    let mut pins: Vec<&str> = model.terminals.iter().map(|t| t.identifier.as_str()).collect();
    if model.has_common {
        pins.push("common");
    }
    pins.extend(["force", "outside"]);
    pins.join(" ")
}

/// The positive and negative parts of the bands, the flag, and for each interval the position of the force in
/// it with its powers for the cubics.
fn bands_and_places(out: &mut String, model: &Model) {
    let mut bands = vec![("", "band")];
    if model.has_ground_band() {
        bands.push(("g", "band_ground"));
    }
    for (mark, band) in bands {
        let _ = writeln!(
            out,
            ".param elc_u{mark}={{min(max({band},0),1)}}\n.param elc_l{mark}={{min(max(-({band}),0),1)}}"
        );
    }
    let [first, last] = model.range();
    let ramp = FLAG_RAMP * (last - first);
    let _ = writeln!(
        out,
        "Belc_o outside 0 V=min(max(({}-V(force))/{},0),1)+min(max((V(force)-{})/{},0),1)",
        number(first),
        number(ramp),
        number(last),
        number(ramp)
    );
    for (k, pair) in model.forces.windows(2).enumerate() {
        let k = k + 1;
        let h = number(pair[1] - pair[0]);
        let _ = writeln!(
            out,
            "Belc_t{k} elc_t{k} 0 V=min(max((V(force)-{})/{h},0),1)\n\
             Belc_x{k} elc_x{k} 0 V=3*V(elc_t{k})*(1-V(elc_t{k}))*(1-V(elc_t{k}))\n\
             Belc_y{k} elc_y{k} 0 V=3*V(elc_t{k})*V(elc_t{k})*(1-V(elc_t{k}))\n\
             Belc_z{k} elc_z{k} 0 V=V(elc_t{k})*V(elc_t{k})*V(elc_t{k})",
            number(pair[0])
        );
    }
}

/// One capacitor of the network, the `k`-th.
fn capacitor(out: &mut String, model: &Model, branch: &Branch, k: usize) {
    let scale = branch.curve.scale();
    let (i, j) = branch.ends;
    let a = model.terminals[i].identifier.as_str();
    let b = j.map_or("common", |j| model.terminals[j].identifier.as_str());
    let mark = if j.is_none() && model.has_ground_band() { "g" } else { "" };
    // The expression for a number that depends on the band, over the scale, from the numbers of the lower
    // bound, the value and the upper bound, F.
    let banded = |[lower, value, upper]: [f64; 3]| {
        let [less, more] = [lower - value, upper - value].map(|c| c / scale);
        let plus = |name: &str, c: f64| match c {
            0.0 => String::new(),
            c => format!("{}{}*elc_{name}{mark}", if c < 0.0 { "" } else { "+" }, number(c)),
        };
        // ngspice takes the braces only as the mark of parameters: the brackets keep the sum together.
        format!("({{{}{}{}}})", number(value / scale), plus("u", more), plus("l", less))
    };
    let pieces = branch.curve.pieces();
    let first = pieces.first().map_or([0.0; 3], |piece| piece.map(|p| p[0]));
    let _ = write!(
        out,
        "* {}: capacitance {} F times V(elc_c{k})\nBelc_c{k} elc_c{k} 0 V=max(0,{}",
        header::plain(&model.ends(branch).join(" - ")),
        number(scale),
        banded(first)
    );
    for (n, piece) in pieces.iter().enumerate() {
        let coefficient = |p: usize| banded(piece.map(|points| points[p] - points[0]));
        let n = n + 1;
        let _ = write!(
            out,
            "\n+ +{}*V(elc_x{n})+{}*V(elc_y{n})+{}*V(elc_z{n})",
            coefficient(1),
            coefficient(2),
            coefficient(3)
        );
    }
    let _ = write!(
        out,
        ")\n\
         Belc_q{k} elc_q{k} 0 V=V({a},{b})*V(elc_c{k})\n\
         Celc_q{k} elc_q{k} elc_m{k} {INNER}\n\
         Velc_m{k} elc_m{k} 0 0\n\
         Felc_q{k} {a} {b} Velc_m{k} {}\n",
        number(scale * 1e9)
    );
}
