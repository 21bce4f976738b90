//! The XML files of an FMU.

use std::fmt::Write as _;

use super::{has_one_voltage, token};
use crate::header;
use crate::model::Model;

/// Text escaped for an attribute, without characters that XML forbids.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// A computed variable, for the model structure.
struct Output {
    /// The value reference of the variable.
    reference: usize,
    /// The value references of the variables that it depends on.
    dependencies: Vec<usize>,
}

/// The value references of inputs and parameters: see model.c.
const FORCE: usize = 1;
const BAND: usize = 2;
const BAND_GROUND: usize = 3;
const VOLTAGES: usize = 100;
const CHARGES: usize = 200;
const CAPACITANCES: usize = 1000;

/// The text of `buildDescription.xml`, which says how the sources are compiled.
pub(super) fn build_description(model: &Model) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiBuildDescription fmiVersion=\"3.0\">\n\
         \x20 <BuildConfiguration modelIdentifier=\"{}\">\n\
         \x20   <SourceFileSet language=\"C99\">\n\
         \x20     <SourceFile name=\"model.c\"/>\n\
         \x20   </SourceFileSet>\n\
         \x20 </BuildConfiguration>\n\
         </fmiBuildDescription>\n",
        model.identifier
    )
}

/// The text of `modelDescription.xml`: the variables, and which of them depend on which.
pub(super) fn model_description(model: &Model) -> String {
    let mut variables = String::new();
    let outputs = variables_of(model, &mut variables);
    let mut structure = String::new();
    for kind in ["Output", "InitialUnknown"] {
        for Output { reference, dependencies } in &outputs {
            let list: Vec<String> = dependencies.iter().map(usize::to_string).collect();
            let _ = writeln!(
                structure,
                "    <{kind} valueReference=\"{reference}\" dependencies=\"{}\"/>",
                list.join(" ")
            );
        }
    }
    let about = escaped(&header::lines(model).join(" | "));
    let capabilities = format!(
        "modelIdentifier=\"{}\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" providesDirectionalDerivatives=\"true\"",
        model.identifier
    );
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"3.0\" modelName=\"{}\" instantiationToken=\"{}\"\n\
         \x20   description=\"{about}\"\n\
         \x20   generationTool=\"elastocap {}\" variableNamingConvention=\"flat\">\n\
         \x20 <ModelExchange {capabilities}/>\n\
         \x20 <CoSimulation {capabilities} canHandleVariableCommunicationStepSize=\"true\"/>\n\
         \x20 <UnitDefinitions>\n\
         \x20   <Unit name=\"s\"><BaseUnit s=\"1\"/></Unit>\n\
         \x20   <Unit name=\"N\"><BaseUnit kg=\"1\" m=\"1\" s=\"-2\"/></Unit>\n\
         \x20   <Unit name=\"V\"><BaseUnit kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\"/></Unit>\n\
         \x20   <Unit name=\"C\"><BaseUnit A=\"1\" s=\"1\"/></Unit>\n\
         \x20   <Unit name=\"F\"><BaseUnit kg=\"-1\" m=\"-2\" s=\"4\" A=\"2\"/></Unit>\n\
         \x20   <Unit name=\"F/N\"><BaseUnit kg=\"-2\" m=\"-3\" s=\"6\" A=\"2\"/></Unit>\n\
         \x20 </UnitDefinitions>\n\
         \x20 <LogCategories>\n\
         \x20   <Category name=\"logStatusError\" description=\"Why a call failed\"/>\n\
         \x20 </LogCategories>\n\
         \x20 <DefaultExperiment startTime=\"0\" stopTime=\"1\"/>\n\
         \x20 <ModelVariables>\n\
         {variables}\
         \x20 </ModelVariables>\n\
         \x20 <ModelStructure>\n\
         {structure}\
         \x20 </ModelStructure>\n\
         </fmiModelDescription>\n",
        model.identifier,
        token(model),
        env!("CARGO_PKG_VERSION")
    )
}

/// Writes all variables, and returns the computed ones.
fn variables_of(model: &Model, out: &mut String) -> Vec<Output> {
    let [first, last] = model.range();
    let mut float = |name: &str, reference: usize, unit: &str, rest: &str, text: &str| {
        let unit = if unit.is_empty() { String::new() } else { format!(" unit=\"{unit}\"") };
        let _ = writeln!(
            out,
            "    <Float64 name=\"{name}\" valueReference=\"{reference}\"{unit} {rest} description=\"{}\"/>",
            escaped(text)
        );
    };
    let input = "causality=\"input\" variability=\"continuous\"";
    let output = "causality=\"output\" variability=\"continuous\" initial=\"calculated\"";
    let band =
        "causality=\"parameter\" variability=\"tunable\" initial=\"exact\" min=\"-1\" max=\"1\" start=\"0\"";
    let mut outputs = Vec::new();
    float("time", 0, "s", "causality=\"independent\" variability=\"continuous\"", "Time");
    float(
        "force",
        FORCE,
        "N",
        &format!("{input} start=\"{first}\""),
        &format!("Force, from {first} N to {last} N"),
    );
    float("band", BAND, "", band, "Error band: -1 lower bound, 0 value, 1 upper bound");
    if model.has_ground_band() {
        float("band_ground", BAND_GROUND, "", band, "The same for the capacitances to common");
    }
    let start_zero = format!("{input} start=\"0\"");
    // Only the names of capacitors can clash; those of terminals follow from different identifiers, and begin
    // with another word.
    let names = model.branch_identifiers();
    let is_single = has_one_voltage(model);
    let terminals: Vec<(String, String)> = if is_single {
        let between = match model.terminals.as_slice() {
            [a, b] => format!("of \"{}\" against \"{}\"", a.name, b.name),
            [a, ..] => format!("of \"{}\" against ground", a.name),
            [] => String::new(),
        };
        vec![(String::new(), between)]
    } else {
        let named = model.terminals.iter();
        named.map(|t| (format!("_{}", t.identifier), format!("of \"{}\" against common", t.name))).collect()
    };
    for (k, (name, text)) in terminals.iter().enumerate() {
        float(&format!("voltage{name}"), VOLTAGES + k, "V", &start_zero, &format!("Voltage {text}"));
    }
    let touches = |k: usize, end: usize| {
        let (i, j) = model.branches[k].ends;
        is_single || i == end || j == Some(end)
    };
    let bands: Vec<usize> = if model.has_ground_band() { vec![BAND, BAND_GROUND] } else { vec![BAND] };
    for (k, (name, text)) in terminals.iter().enumerate() {
        float(&format!("charge{name}"), CHARGES + k, "C", output, &format!("Charge {text}"));
        let touching = (0..model.branches.len()).filter(|b| touches(*b, k));
        let mut voltages: Vec<usize> = touching
            .flat_map(|b| (0..terminals.len()).filter(move |t| touches(b, *t)))
            .map(|t| VOLTAGES + t)
            .collect();
        voltages.sort_unstable();
        voltages.dedup();
        let dependencies = [vec![FORCE], bands.clone(), voltages].concat();
        outputs.push(Output { reference: CHARGES + k, dependencies });
    }
    for (k, (branch, name)) in model.branches.iter().zip(&names).enumerate() {
        let ends = model.ends(branch).map(|end| format!("\"{end}\"")).join(" - ");
        let band = if model.has_ground_band() && branch.ends.1.is_none() { BAND_GROUND } else { BAND };
        for (kind, (suffix, unit, text)) in [
            ("", "F", "Capacitance"),
            ("_lower", "F", "Lower bound of the capacitance"),
            ("_upper", "F", "Upper bound of the capacitance"),
            ("_derivative", "F/N", "Derivative over the force of the capacitance"),
        ]
        .into_iter()
        .enumerate()
        {
            let reference = CAPACITANCES + 4 * k + kind;
            float(&format!("{name}{suffix}"), reference, unit, output, &format!("{text} {ends}"));
            let dependencies = if suffix.is_empty() || kind == 3 { vec![FORCE, band] } else { vec![FORCE] };
            outputs.push(Output { reference, dependencies });
        }
    }
    out.push_str(
        "    <Boolean name=\"refuse_outside\" valueReference=\"4\" causality=\"parameter\" variability=\"tunable\" initial=\"exact\" start=\"true\" \
         description=\"Whether a force outside the range is an error; else the capacitance stays as it is at the range's end\"/>\n    \
         <Boolean name=\"outside\" valueReference=\"5\" causality=\"output\" variability=\"discrete\" initial=\"calculated\" \
         description=\"Whether the force is outside the range\"/>\n",
    );
    outputs.push(Output { reference: 5, dependencies: vec![FORCE] });
    outputs
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn a_name_cannot_leave_its_attribute() {
        assert_eq!(escaped("a\"/><x>&'\0\u{ffff}"), "a&quot;/&gt;&lt;x&gt;&amp;&apos;  ");
    }
}
