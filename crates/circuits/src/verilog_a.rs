//! A module in Verilog-A.

use std::fmt::Write as _;

use crate::header::{self, FLAG_RAMP};
use crate::model::{Branch, Model};

/// The text of the file: comments and one module.
pub fn module(model: &Model) -> String {
    let mut out = String::new();
    let mut ports: Vec<&str> = model.terminals.iter().map(|t| t.identifier.as_str()).collect();
    if model.has_common {
        ports.push("common");
    }
    let electrodes = ports.join(", ");
    for line in header::lines(model) {
        let _ = writeln!(out, "{}", format!("// {line}").trim_end());
    }
    let [first, last] = model.range();
    let count = model.forces.len() - 1;
    let _ = write!(
        out,
        "//\n\
         // force: 1 V is 1 N, against ground; draws no current\n\
         // outside: 1 V where the force is outside the range, else 0 V; the capacitance is then that at the range's end\n\n\
         `include \"disciplines.vams\"\n\n\
         module {}({electrodes}, force_n, outside);\n\
         \x20   inout {electrodes};\n\
         \x20   input force_n;\n\
         \x20   output outside;\n\
         \x20   electrical {electrodes}, force_n, outside;\n",
        model.identifier
    );
    let mut bands = vec![("", "band", "mutual capacitances, or of the only one")];
    if model.has_ground_band() {
        bands.push(("_ground", "band_ground", "capacitances to common"));
    }
    for (_, band, of) in &bands {
        let _ = writeln!(
            out,
            "    // Of the {of}: -1 lower bound, 0 value, 1 upper bound.\n    parameter real {band} = 0.0 from [-1.0:1.0];"
        );
    }
    let reals =
        |name: &str, count: usize| (1..=count).map(|k| format!("{name}{k}")).collect::<Vec<_>>().join(", ");
    let _ = writeln!(
        out,
        "    real elc_newtons, elc_beyond;\n    real {};\n    real {};\n    real {};\n    real {};\n    real {};",
        reals("elc_t", count),
        reals("elc_x", count),
        reals("elc_y", count),
        reals("elc_z", count),
        reals("elc_c", model.branches.len())
    );
    for (mark, _, _) in &bands {
        let _ = writeln!(out, "    real elc_upper{mark}, elc_lower{mark};");
    }
    let _ = writeln!(out, "\n    analog begin\n        elc_newtons = V(force_n);");
    for (mark, band, _) in &bands {
        let _ = writeln!(
            out,
            "        elc_upper{mark} = max({band}, 0.0);\n        elc_lower{mark} = max(-{band}, 0.0);"
        );
    }
    for (k, pair) in model.forces.windows(2).enumerate() {
        let k = k + 1;
        let _ = write!(
            out,
            "        // {:e} N to {:e} N\n\
             \x20       elc_t{k} = min(max((elc_newtons - ({:e})) / {:e}, 0.0), 1.0);\n\
             \x20       elc_x{k} = 3.0 * elc_t{k} * (1.0 - elc_t{k}) * (1.0 - elc_t{k});\n\
             \x20       elc_y{k} = 3.0 * elc_t{k} * elc_t{k} * (1.0 - elc_t{k});\n\
             \x20       elc_z{k} = elc_t{k} * elc_t{k} * elc_t{k};\n",
            pair[0],
            pair[1],
            pair[0],
            pair[1] - pair[0]
        );
    }
    for (k, branch) in model.branches.iter().enumerate() {
        capacitance(&mut out, model, branch, k + 1);
    }
    for (k, branch) in model.branches.iter().enumerate() {
        let (i, j) = branch.ends;
        let other = j.map_or("common", |j| model.terminals[j].identifier.as_str());
        let ends = format!("{}, {other}", model.terminals[i].identifier);
        let _ = writeln!(out, "        I({ends}) <+ ddt(elc_c{} * V({ends}));", k + 1);
    }
    let ramp = FLAG_RAMP * (last - first);
    let _ = write!(
        out,
        "        elc_beyond = max({first:e} - elc_newtons, elc_newtons - ({last:e}));\n\
         \x20       V(outside) <+ min(max(elc_beyond / {ramp:e}, 0.0), 1.0);\n\
         \x20   end\nendmodule\n"
    );
    out
}

/// The statement that computes one capacitance, the `k`-th, in F.
fn capacitance(out: &mut String, model: &Model, branch: &Branch, k: usize) {
    let mark = if branch.ends.1.is_none() && model.has_ground_band() { "_ground" } else { "" };
    // The expression for a number that depends on the band, F, from the numbers of the lower bound, the value
    // and the upper bound.
    let banded = |[lower, value, upper]: [f64; 3]| {
        let (less, more) = (lower - value, upper - value);
        format!("({value:e} + ({more:e}) * elc_upper{mark} + ({less:e}) * elc_lower{mark})")
    };
    let pieces = branch.curve.pieces();
    let first = pieces.first().map_or([0.0; 3], |piece| piece.map(|p| p[0]));
    let _ = write!(
        out,
        "        // {}\n        elc_c{k} = {}",
        header::plain(&model.ends(branch).join(" - ")),
        banded(first)
    );
    for (n, piece) in pieces.iter().enumerate() {
        let coefficient = |p: usize| banded(piece.map(|points| points[p] - points[0]));
        let n = n + 1;
        let _ = write!(
            out,
            "\n            + {} * elc_x{n}\n            + {} * elc_y{n}\n            + {} * elc_z{n}",
            coefficient(1),
            coefficient(2),
            coefficient(3)
        );
    }
    out.push_str(";\n");
}
