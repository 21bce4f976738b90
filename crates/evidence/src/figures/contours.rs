//! Figs. 4 and 6: stress under a held patch, as bands of colour. The paper moves the contact region down by
//! the same displacement everywhere, and lets it slide sideways: that is a held patch, which may spread
//! beyond the width of the punch, and not a punch in contact.
//!
//! The paper's punch is "comparable to the layer thickness" in Figs. 4 and 6a, half of it in 6b and "over
//! three times" in 6c, which suggests the half-lengths `H`, `H/2` and `3H`. The layer extends six thicknesses
//! beyond the punch, and the pictures show a part of it.

use elastocap_mechanics::solid::mesh::Mesh;
use elastocap_mechanics::solid::stress::{Fields, Sample};

use super::panel::cell;
use super::shear::peak_and_end;
use super::{Drawn, FigureError, Run, SMALL, Session, left_out};
use elastocap_results::plot::{Axis, Cell, Fringes, Scale};

/// The distance beyond the patch up to which the layer is shown, over `H`.
const BESIDE: f64 = 2.5;

/// The deformed elements up to `x1 <= limit`, with a value at each node.
fn cells(mesh: &Mesh, limit: f64, at: impl Fn(usize) -> Sample, value: impl Fn(&Sample) -> f64) -> Vec<Cell> {
    let shown = mesh.elements.iter().filter(|e| e.iter().all(|&n| mesh.nodes[n as usize][0] <= limit));
    shown
        .map(|e| {
            e.map(|n| {
                let s = at(n as usize);
                (s.reference[0] + s.displacement[0], s.reference[1] + s.displacement[1], value(&s))
            })
        })
        .collect()
}

/// The range of the colours: that of the values, without those within a quarter of the thickness of the end
/// of the patch at `corner`, where the stress is singular.
fn range(cells: &[Cell], corner: f64) -> Option<(f64, f64)> {
    let far = |p: &&(f64, f64, f64)| (p.0 - corner).hypot(p.1 - 1.0) > 0.25;
    cells.iter().flatten().filter(far).fold(None, |range, p| {
        let (low, high) = range.unwrap_or((p.2, p.2));
        Some((low.min(p.2), high.max(p.2)))
    })
}

/// A picture with bands of colour, over the range of values away from the end of the patch at `corner`. If
/// that is `None`, the picture shows the outlines of the elements.
fn picture(title: &str, quantity: &str, cells: Vec<Cell>, corner: Option<f64>) -> String {
    let axis = |label: &str| Axis { label: label.into(), unit: String::new(), scale: Scale::Linear };
    Fringes {
        title: title.into(),
        x: axis("y₁/H"),
        y: axis("y₂/H"),
        quantity: quantity.into(),
        range: corner.and_then(|corner| range(&cells, corner)),
        cells,
        outlines: corner.is_none(),
    }
    .to_svg()
}

/// A table with a row for each node: its reference position, its displacement and the `values`.
fn csv(samples: impl Iterator<Item = Sample>, header: &str, values: impl Fn(&Sample) -> Vec<f64>) -> String {
    let mut out = format!("x_1_over_h,x_2_over_h,u_1_over_h,u_2_over_h,{header}\n");
    for s in samples {
        let place = [s.reference[0], s.reference[1], s.displacement[0], s.displacement[1]];
        let row: Vec<String> = place.iter().chain(&values(&s)).map(|v| cell(*v)).collect();
        out.push_str(&row.join(","));
        out.push('\n');
    }
    out
}

/// Fig. 4: the deformed mesh and the nominal stress under one patch.
pub(super) fn under_a_patch(session: &mut Session) -> Result<Drawn, FigureError> {
    const COMPRESSION: f64 = 0.05;
    let found = session.run(Run::punch(1.0))?;
    let Some(point) = found.at(COMPRESSION) else {
        return Ok(Drawn { missing: left_out("figure-4", &found).into_iter().collect(), ..Drawn::default() });
    };
    let mesh = &found.models[point.fan].equations().body().mesh;
    let fields = found.fields(point);
    let cells_of = |value: fn(&Sample) -> f64| cells(mesh, 1.0 + BESIDE + 1e-9, |n| fields.at_node(n), value);
    let nominal = |k: usize| move |s: &Sample| s.stress.nominal()[k];
    let conditions = "under a held patch of half-length H, U/H = 0.05";
    let drawn_cells = |k: usize| cells(mesh, 1.0 + BESIDE + 1e-9, |n| fields.at_node(n), nominal(k));
    let samples =
        (0..mesh.nodes.len()).map(|n| fields.at_node(n)).filter(|s| s.reference[0] <= 1.0 + BESIDE + 1e-9);
    Ok(Drawn {
        files: vec![
            (
                "figure-4a.svg".into(),
                picture(&format!("Fig. 4a: deformed mesh {conditions}"), "", cells_of(|_| 0.0), None),
            ),
            (
                "figure-4b.svg".into(),
                picture(
                    &format!("Fig. 4b: nominal stress T₁₁/μ {conditions}"),
                    "T₁₁/μ",
                    drawn_cells(0),
                    Some(1.0),
                ),
            ),
            (
                "figure-4c.svg".into(),
                picture(
                    &format!("Fig. 4c: nominal stress T₁₂/μ {conditions}"),
                    "T₁₂/μ",
                    drawn_cells(1),
                    Some(1.0),
                ),
            ),
            (
                "figure-4.csv".into(),
                csv(samples, "t_11_over_mu,t_12_over_mu", |s| vec![nominal(0)(s), nominal(1)(s)]),
            ),
        ],
        findings: vec![format!(
            "figure-4: two thicknesses beside the patch |T₁₁| is at most {:.3} of what it is on the axis",
            largest_t11(&fields, 3.0) / largest_t11(&fields, 0.0)
        )],
        missing: Vec::new(),
    })
}

/// The largest `|T11|` on the column at `x1` (over `H`).
fn largest_t11(fields: &Fields<'_>, x1: f64) -> f64 {
    let column = fields.along([x1, 0.0], [x1, 1.0], 21);
    column.iter().fold(0.0, |m, s| m.max(s.stress.nominal()[0].abs()))
}

/// Fig. 6: the shear stress at small strain under patches of three half-lengths.
pub(super) fn three_patches(session: &mut Session) -> Result<Drawn, FigureError> {
    let mut drawn = Drawn::default();
    for (file, name, half_length) in [("6a", "H", 1.0), ("6b", "H/2", 0.5), ("6c", "3H", 3.0)] {
        let found = session.run(Run::small_strain(half_length))?;
        let Some(point) = found.at(SMALL) else {
            drawn.missing.extend(left_out(&format!("figure-{file}"), &found));
            continue;
        };
        let mesh = &found.models[point.fan].equations().body().mesh;
        let fields = found.fields(point);
        let shear = |s: &Sample| s.stress.s12 / SMALL;
        let limit = half_length + BESIDE + 1e-9;
        let title =
            format!("Fig. {file}: shear stress at small strain under a held patch of half-length {name}");
        let shown = cells(mesh, limit, |n| fields.at_node(n), shear);
        drawn
            .files
            .push((format!("figure-{file}.svg"), picture(&title, "(σ₁₂/μ)/(U/H)", shown, Some(half_length))));
        let samples = (0..mesh.nodes.len()).map(|n| fields.at_node(n)).filter(|s| s.reference[0] <= limit);
        let header = "sigma_12_over_mu_over_compression";
        drawn.files.push((format!("figure-{file}.csv"), csv(samples, header, |s| vec![shear(s)])));
        let edge = fields.along([0.0, 0.0], [half_length + 5.5, 0.0], 601);
        if let Some((peak, end)) = peak_and_end(&edge) {
            drawn.findings.push(format!(
                "figure-{file}: along the bonded edge the shear stress is largest at x₁ = {peak:.2} H (the patch ends at \
                 {half_length} H) and below a tenth of that from {end:.2} H, {:.2} H beyond the patch",
                end - half_length
            ));
        }
    }
    Ok(drawn)
}
