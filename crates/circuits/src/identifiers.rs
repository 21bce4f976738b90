//! Identifiers for SPICE, Verilog-A, C and Modelica, made from any text.

use std::collections::BTreeSet;

/// The largest length of an identifier; some simulators cut longer ones.
const LONGEST: usize = 40;

/// Words with a meaning in one of the languages, or in the written files, in lower case.
const RESERVED: &[&str] = &[
    // SPICE: ground, and variables of expressions.
    "gnd",
    "temp",
    "temper",
    "time",
    "hertz",
    "pi",
    "params",
    // The files written here.
    "a",
    "b",
    "band",
    "band_ground",
    "common",
    "force",
    "force_n",
    "outside",
    "refuse_outside",
    "voltage",
    "charge",
    "capacitance",
    "lower",
    "upper",
    "f",
    "p",
    "n",
    "u",
    "l",
    // Verilog-AMS.
    "above",
    "abs",
    "absdelay",
    "absdelta",
    "abstol",
    "access",
    "acos",
    "acosh",
    "ac_stim",
    "aliasparam",
    "always",
    "analog",
    "analysis",
    "and",
    "asin",
    "asinh",
    "assert",
    "assign",
    "atan",
    "atan2",
    "atanh",
    "automatic",
    "begin",
    "branch",
    "buf",
    "bufif0",
    "bufif1",
    "case",
    "casex",
    "casez",
    "ceil",
    "cell",
    "cmos",
    "config",
    "connect",
    "connectmodule",
    "connectrules",
    "continuous",
    "cos",
    "cosh",
    "cross",
    "ddt",
    "ddt_nature",
    "ddx",
    "deassign",
    "default",
    "define",
    "defparam",
    "design",
    "disable",
    "discipline",
    "discrete",
    "domain",
    "driver_update",
    "edge",
    "electrical",
    "else",
    "end",
    "endcase",
    "endconfig",
    "endconnectrules",
    "enddiscipline",
    "endfunction",
    "endgenerate",
    "endmodule",
    "endnature",
    "endparamset",
    "endprimitive",
    "endspecify",
    "endtable",
    "endtask",
    "event",
    "exclude",
    "exp",
    "final_step",
    "flicker_noise",
    "floor",
    "flow",
    "for",
    "force",
    "forever",
    "fork",
    "from",
    "function",
    "generate",
    "genvar",
    "ground",
    "highz0",
    "highz1",
    "hypot",
    "idt",
    "idt_nature",
    "idtmod",
    "if",
    "ifnone",
    "incdir",
    "include",
    "inf",
    "initial",
    "initial_step",
    "inout",
    "input",
    "instance",
    "integer",
    "join",
    "laplace_nd",
    "laplace_np",
    "laplace_zd",
    "laplace_zp",
    "large",
    "last_crossing",
    "liblist",
    "library",
    "limexp",
    "ln",
    "localparam",
    "log",
    "macromodule",
    "max",
    "medium",
    "merged",
    "min",
    "module",
    "nand",
    "nature",
    "negedge",
    "net_resolution",
    "nmos",
    "noise_table",
    "noise_table_log",
    "nor",
    "noshowcancelled",
    "not",
    "notif0",
    "notif1",
    "or",
    "output",
    "parameter",
    "paramset",
    "pmos",
    "posedge",
    "potential",
    "pow",
    "primitive",
    "pull0",
    "pull1",
    "pulldown",
    "pullup",
    "pulsestyle_ondetect",
    "pulsestyle_onevent",
    "rcmos",
    "real",
    "realtime",
    "reg",
    "release",
    "repeat",
    "resolveto",
    "rnmos",
    "rpmos",
    "rtran",
    "rtranif0",
    "rtranif1",
    "scalared",
    "showcancelled",
    "signed",
    "sin",
    "sinh",
    "slew",
    "small",
    "specify",
    "specparam",
    "split",
    "sqrt",
    "string",
    "strong0",
    "strong1",
    "supply0",
    "supply1",
    "table",
    "tan",
    "tanh",
    "task",
    "timer",
    "tran",
    "tranif0",
    "tranif1",
    "transition",
    "tri",
    "tri0",
    "tri1",
    "triand",
    "trior",
    "trireg",
    "units",
    "unsigned",
    "use",
    "uwire",
    "vectored",
    "wait",
    "wand",
    "weak0",
    "weak1",
    "while",
    "white_noise",
    "wire",
    "wor",
    "wreal",
    "xnor",
    "xor",
    "zi_nd",
    "zi_np",
    "zi_zd",
    "zi_zp",
    // C and Modelica.
    "auto",
    "break",
    "char",
    "const",
    "continue",
    "do",
    "double",
    "enum",
    "extern",
    "float",
    "goto",
    "inline",
    "int",
    "long",
    "register",
    "restrict",
    "return",
    "short",
    "sizeof",
    "static",
    "struct",
    "switch",
    "typedef",
    "union",
    "void",
    "volatile",
    "algorithm",
    "block",
    "class",
    "connector",
    "constant",
    "der",
    "each",
    "equation",
    "extends",
    "external",
    "false",
    "final",
    "import",
    "in",
    "model",
    "operator",
    "package",
    "partial",
    "protected",
    "public",
    "pure",
    "record",
    "replaceable",
    "then",
    "true",
    "type",
    "when",
    "within",
];

/// An identifier of letters, digits and underscores that begins with a letter, is not a reserved word, and
/// has at most 40 characters.
pub fn identifier(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c);
        } else if !out.ends_with('_') {
            out.push('_');
        }
    }
    let out = out.trim_matches('_');
    let begins_well = out.starts_with(|c: char| c.is_ascii_alphabetic());
    let mut out = if begins_well { out.to_owned() } else { format!("t_{out}") };
    out.truncate(LONGEST);
    let mut out = out.trim_end_matches('_').to_owned();
    if RESERVED.contains(&out.to_ascii_lowercase().as_str()) || out.to_ascii_lowercase().starts_with("elc_") {
        out.insert_str(0, "t_");
    }
    out
}

/// An identifier for each name, no two of them equal even if case is ignored, as SPICE does.
pub fn unique(names: &[String]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut out = Vec::with_capacity(names.len());
    for name in names {
        let first = identifier(name);
        let mut candidate = first.clone();
        let mut number = 2;
        while !taken.insert(candidate.to_ascii_lowercase()) {
            candidate =
                format!("{}_{number}", first.get(..LONGEST - 8).unwrap_or(&first).trim_end_matches('_'));
            number += 1;
        }
        out.push(candidate);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unique_of(names: &[&str]) -> Vec<String> {
        unique(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn hostile_names_become_identifiers() {
        let long = "x".repeat(500);
        let hostile = [
            "",
            "1",
            "electrode-left",
            "a b",
            "\n.include /etc/passwd",
            "module",
            "GND",
            "force",
            "force-n",
            "elc_t1",
            "*/ exit(1); /*",
            "\u{202e}evil",
            "ground\0",
            "+",
            "{x}",
            "$strobe",
            "\u{e9}lectrode",
            "__",
            &long,
        ];
        for name in unique_of(&hostile) {
            assert!(name.starts_with(|c: char| c.is_ascii_alphabetic()), "{name}");
            assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'), "{name}");
            assert!(!name.contains("__") && name.len() <= LONGEST + 2, "{name}");
            assert!(!RESERVED.contains(&name.to_ascii_lowercase().as_str()), "{name}");
        }
    }

    #[test]
    fn names_that_differ_in_nothing_that_a_simulator_sees_are_numbered() {
        assert_eq!(unique_of(&["a-1", "A 1", "a_1", "a_1_2"]), ["a_1", "A_1_2", "a_1_3", "a_1_2_2"]);
        let identifiers: BTreeSet<String> = unique_of(&["\u{e9}", "\u{e8}", "t", "t_", "T"])
            .into_iter()
            .map(|n| n.to_ascii_lowercase())
            .collect();
        assert_eq!(identifiers.len(), 5);
    }

    #[test]
    fn ordinary_names_stay_readable() {
        assert_eq!(unique_of(&["pad-1-1", "electrode-left"]), ["pad_1_1", "electrode_left"]);
    }
}
