//! Tests of terminals, measurements, unions of boxes and holes: valid ones, and each mistake with its
//! message.

use std::path::Path;

use elastocap_case::{Case, CaseError, Measurement, Shape};

const FOUR: &str = r#"
format = 1
[[conductor]]
name = "a"
boxes = [
    { min = ["0 mm", "0 mm", "0 mm"], max = ["1 mm", "1 mm", "1 mm"] },
    { min = ["1 mm", "0 mm", "0 mm"], max = ["2 mm", "3 mm", "1 mm"] },
]
[[conductor]]
name = "b"
sheet = { normal = "x3", at = "2 mm", min = ["0 mm", "0 mm"], max = ["1 mm", "1 mm"] }
[[conductor]]
name = "c"
box = { min = ["5 mm", "0 mm", "0 mm"], max = ["6 mm", "1 mm", "1 mm"] }
[[conductor]]
name = "free"
charge = "0 C"
box = { min = ["8 mm", "0 mm", "0 mm"], max = ["9 mm", "1 mm", "1 mm"] }
[[terminal]]
name = "left"
conductors = ["b", "a"]
[measure]
capacitance = ["left", "c"]
[surroundings]
boundary = "open"
"#;

const PLATE: &str = r#"
format = 1
[[conductor]]
name = "plate"
extrusion = { axis = "x2", from = "0 mm", to = "0 mm", outline = [["-4 mm", "-4 mm"], ["4 mm", "-4 mm"], ["4 mm", "4 mm"], ["-4 mm", "4 mm"]], holes = [[["-2 mm", "-2 mm"], ["2 mm", "-2 mm"], ["2 mm", "2 mm"], ["-2 mm", "2 mm"]]] }
[surroundings]
boundary = "open"
"#;

fn parse(text: &str) -> Result<Case, CaseError> {
    elastocap_case::parse(text, Path::new("cases/test.toml"))
}

fn changed(base: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(base.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from:?} is not in the file");
        text.replacen(from, to, 1)
    })
}

fn accepted(base: &str, changes: &[(&str, &str)]) -> Case {
    parse(&changed(base, changes)).unwrap_or_else(|e| panic!("{changes:?}\n{e}"))
}

/// Checks that there is exactly one error, at `at`, with these words in its text.
fn refused(base: &str, changes: &[(&str, &str)], at: &str, words: &[&str]) {
    let text = changed(base, changes);
    let error = parse(&text).expect_err(&text);
    let shown = error.render(false);
    let [diagnostic] = error.diagnostics() else { panic!("one message expected:\n{shown}") };
    let pointed = &text[diagnostic.span.clone().expect("a place")];
    assert!(pointed.starts_with(at), "points at {pointed:?}, not {at:?}:\n{shown}");
    for word in words {
        assert!(shown.contains(word), "{word:?} is not in:\n{shown}");
    }
}

#[test]
fn rows_are_those_of_terminals_in_the_order_of_their_first_conductors() {
    let case = accepted(FOUR, &[]);
    assert_eq!(case.driven_terminals(), ["left", "c"]);
    assert_eq!(case.measurement(), Measurement::Mutual([0, 1]));
    assert_eq!(case.bodies[0].parts.len(), 2);
    let grounded =
        accepted(FOUR, &[("\"a\"]\n", "\"a\"]\npotential = \"ground\"\n"), ("\"left\", \"c\"", "\"c\"")]);
    assert_eq!(
        (grounded.driven_terminals(), grounded.measurement()),
        (vec!["c".to_owned()], Measurement::Own(0))
    );
}

#[test]
fn without_a_measurement_two_terminals_are_a_pair_and_more_have_a_matrix() {
    let measure = ("[measure]\ncapacitance = [\"left\", \"c\"]\n", "");
    assert_eq!(accepted(FOUR, &[measure]).measurement(), Measurement::Mutual([0, 1]));
    let apart = accepted(FOUR, &[measure, ("[\"b\", \"a\"]", "[\"a\"]")]);
    let matrix = Measurement::Matrix { terminals: 3, shown: [0, 1] };
    assert_eq!((apart.measurement(), apart.driven_terminals()[0].as_str()), (matrix, "left"));
}

#[test]
fn a_pair_without_any_ground_has_one_capacitance_which_is_the_two_terminal_one() {
    let measure = ("[measure]\ncapacitance = [\"left\", \"c\"]\n", "");
    let walls = "boundary = \"insulated\"\nwalls = { min = [\"-9 mm\", \"-9 mm\", \"-9 mm\"], max = [\"9 mm\", \"9 mm\", \"9 mm\"] }";
    let walled = ("boundary = \"open\"", walls);
    assert_eq!(accepted(FOUR, &[measure, walled]).measurement(), Measurement::TwoTerminal([0, 1]));
    let grounded = (
        "conductors = [\"b\", \"a\"]",
        "conductors = [\"b\"]\n[[terminal]]\nname = \"shield\"\npotential = \"ground\"\nconductors = [\"a\"]",
    );
    assert_eq!(accepted(FOUR, &[measure, walled, grounded]).measurement(), Measurement::Mutual([0, 1]));
    let named = ("[\"left\", \"c\"]", "[\"left\", \"c\"]\nkind = \"two-terminal\"");
    assert_eq!(accepted(FOUR, &[named]).measurement(), Measurement::TwoTerminal([0, 1]));
}

#[test]
fn of_several_capacitances_the_first_is_shown_and_what_none_of_them_names_is_grounded() {
    let apart = ("[\"b\", \"a\"]", "[\"a\"]");
    let several = ("[\"left\", \"c\"]", "[[\"c\", \"b\"], [\"c\"]]");
    let case = accepted(FOUR, &[apart, several]);
    assert_eq!(case.driven_terminals(), ["b", "c"]);
    assert_eq!(case.measurement(), Measurement::Matrix { terminals: 2, shown: [1, 0] });
    assert_eq!(case.measured_entries(), [[1, 0], [1, 1]]);
    let measured = |list: &'static str| [apart, ("[\"left\", \"c\"]", list)];
    refused(
        FOUR,
        &measured("[[\"c\", \"b\"], \"c\"]"),
        "\"c\"",
        &["names stand beside lists", "in brackets"],
    );
    refused(FOUR, &measured("[[\"c\"], [\"c\"]]"), "[\"c\"]", &["measured twice", "leave it out"]);
    refused(FOUR, &measured("[[\"c\", \"c\"]]"), "\"c\"", &["against itself"]);
    let two = "[[\"c\"], [\"b\"]]\nkind = \"two-terminal\"";
    refused(FOUR, &measured(two), "\"two-terminal\"", &["two terminals alone", "leave `kind` out"]);
    refused(FOUR, &measured("[\"c\"]\nkind = \"mutual\""), "\"mutual\"", &["two terminals"]);
}

#[test]
fn a_driven_guard_goes_with_the_terminal_that_it_follows() {
    let measure = ("[measure]\ncapacitance = [\"left\", \"c\"]\n", "");
    let guard = |with: &'static str| ("conductors = [\"b\", \"a\"]", with);
    let follows = guard("conductors = [\"b\", \"a\"]\npotential = \"driven\"\nfollows = \"c\"");
    for measured in [measure, ("[\"left\", \"c\"]", "[\"c\"]")] {
        let case = accepted(FOUR, &[measured, follows]);
        assert_eq!(
            (case.driven_terminals(), case.measurement()),
            (vec!["left".to_owned(), "c".to_owned()], Measurement::Guarded([1, 0]))
        );
    }
    refused(
        FOUR,
        &[follows],
        "[\"left\", \"c\"]",
        &["one terminal against ground", "alone", "potential = \"ground\""],
    );
    let alone = guard("conductors = [\"b\", \"a\"]\npotential = \"driven\"");
    refused(FOUR, &[measure, alone], "\"driven\"", &["needs `follows`"]);
    let undriven = guard("conductors = [\"b\", \"a\"]\nfollows = \"c\"");
    refused(FOUR, &[measure, undriven], "\"c\"", &["belongs to a driven guard", "potential = \"driven\""]);
    let itself = guard("conductors = [\"b\", \"a\"]\npotential = \"driven\"\nfollows = \"left\"");
    refused(FOUR, &[measure, itself], "\"left\"", &["cannot follow", "guard itself"]);
    let nobody = guard("conductors = [\"b\", \"a\"]\npotential = \"driven\"\nfollows = \"d\"");
    refused(FOUR, &[measure, nobody], "\"d\"", &["there is no terminal"]);
}

#[test]
fn what_is_not_measured_is_grounded_and_has_no_row() {
    let one = accepted(FOUR, &[("\"left\", \"c\"", "\"c\"")]);
    assert_eq!((one.driven_terminals(), one.measurement()), (vec!["c".to_owned()], Measurement::Own(0)));
    assert!(one.has_grounded_terminals());
    let bodies = one.joined(one.bodies.clone());
    let driven: Vec<&str> =
        bodies.iter().filter(|body| body.is_driven()).map(|body| body.name.as_str()).collect();
    assert_eq!(driven, ["c"]);
    assert!(bodies.iter().any(|body| body.name == "left" && body.is_conductor() && !body.floats()));
}

#[test]
fn conductors_of_one_terminal_may_touch_and_others_may_not() {
    let beside = ("\"5 mm\", \"0 mm\"", "\"2 mm\", \"0 mm\"");
    refused(FOUR, &[beside], "{ min", &["\"a\" and \"c\" touch", "[[terminal]]"]);
    let measure = ("[\"left\", \"c\"]", "[\"left\"]");
    accepted(FOUR, &[beside, ("[\"b\", \"a\"]", "[\"b\", \"a\", \"c\"]"), measure]);
}

#[test]
fn each_slip_in_a_terminal_is_told_where_it_is() {
    refused(FOUR, &[("\"b\", \"a\"", "\"b\", \"aa\"")], "\"aa\"", &["no conductor \"aa\"", "write \"a\""]);
    refused(FOUR, &[("\"b\", \"a\"", "\"b\", \"free\"")], "\"free\"", &["floats", "charge"]);
    refused(FOUR, &[("\"b\", \"a\"", "\"b\", \"b\"")], "\"b\"", &["listed twice"]);
    refused(FOUR, &[("[\"b\", \"a\"]", "[]")], "[]", &["\"left\" has no conductors"]);
    let second = ("[measure]", "[[terminal]]\nname = \"other\"\nconductors = [\"a\"]\n[measure]");
    refused(FOUR, &[second], "\"a\"", &["belongs to two terminals", "\"left\""]);
    let same = ("[measure]", "[[terminal]]\nname = \"left\"\nconductors = [\"c\"]\n[measure]");
    refused(FOUR, &[same, ("\"left\", \"c\"", "\"left\"")], "\"left\"", &["two terminals have the name"]);
    let taken = [("name = \"left\"", "name = \"c\""), ("\"left\", \"c\"", "\"c\"")];
    refused(FOUR, &taken, "\"c\"", &["name of a conductor that does not belong to it"]);
    refused(FOUR, &[("\"a\"]\n[m", "\"a\"]\npotential = \"gruond\"\n[m")], "\"gruond\"", &["\"ground\""]);
    let all = [
        ("\"b\", \"a\"]\n", "\"b\", \"a\", \"c\"]\npotential = \"ground\"\n"),
        ("[measure]\ncapacitance = [\"left\", \"c\"]\n", ""),
    ];
    refused(FOUR, &all, "\"left\"", &["no terminal is driven"]);
}

#[test]
fn each_slip_in_a_measurement_is_told_where_it_is() {
    let measuring = |names: &'static str| [("[\"left\", \"c\"]", names)];
    refused(FOUR, &measuring("[]"), "[]", &["between two terminals, or of one"]);
    refused(FOUR, &measuring("[\"left\", \"c\", \"free\"]"), "[", &["3 names"]);
    refused(FOUR, &measuring("[\"lefft\"]"), "\"lefft\"", &["no terminal \"lefft\"", "write \"left\""]);
    refused(FOUR, &measuring("[\"a\", \"c\"]"), "\"a\"", &["terminal that it belongs to", "write \"left\""]);
    refused(FOUR, &measuring("[\"c\", \"free\"]"), "\"free\"", &["floats"]);
    refused(FOUR, &measuring("[\"c\", \"c\"]"), "\"c\"", &["against itself"]);
    let ground = ("\"a\"]\n", "\"a\"]\npotential = \"ground\"\n");
    refused(FOUR, &[ground], "\"left\"", &["grounded"]);
}

#[test]
fn one_wire_alone_in_an_insulated_box_is_refused_unless_something_is_grounded() {
    let walls = "boundary = \"insulated\"\nwalls = { min = [\"-9 mm\", \"-9 mm\", \"-9 mm\"], max = [\"19 mm\", \"9 mm\", \"9 mm\"] }";
    let walls = ("boundary = \"open\"", walls);
    let one = ("[\"b\", \"a\"]", "[\"b\", \"a\", \"c\"]");
    let measure = ("[\"left\", \"c\"]", "[\"left\"]");
    refused(FOUR, &[walls, one, measure], "[", &["its capacitance is zero"]);
    let ground = ("\"a\"]\n", "\"a\"]\npotential = \"ground\"\n");
    accepted(FOUR, &[walls, ground, ("[\"left\", \"c\"]", "[\"c\"]")]);
}

#[test]
fn boxes_are_checked_one_by_one() {
    refused(
        FOUR,
        &[("max = [\"2 mm\", \"3 mm\"", "max = [\"0 mm\", \"3 mm\"")],
        "\"0 mm\"",
        &["inside-out along x1"],
    );
    let none = FOUR.replace(
        &FOUR[FOUR.find("boxes").unwrap()..FOUR.find("[[conductor]]\nname = \"b\"").unwrap()],
        "boxes = []\n",
    );
    refused(&none, &[], "[]", &["no box in it"]);
}

#[test]
fn a_hole_of_straight_sides_leaves_boxes_and_one_of_curves_leaves_outlines() {
    let frame = accepted(PLATE, &[]);
    assert_eq!(
        (frame.bodies[0].boxes().unwrap().len(), frame.recognised.as_slice()),
        (4, &["plate".to_owned()][..])
    );
    let square =
        "[[\"-2 mm\", \"-2 mm\"], [\"2 mm\", \"-2 mm\"], [\"2 mm\", \"2 mm\"], [\"-2 mm\", \"2 mm\"]]]";
    let round = "[{ through = [\"0 mm\", \"-2 mm\"], to = [\"2 mm\", \"0 mm\"] }, { through = [\"0 mm\", \"2 mm\"], to = [\"-2 mm\", \"0 mm\"] }]]";
    let ring = accepted(PLATE, &[(square, round)]);
    let arcs = ring.bodies[0].parts.iter().map(|part| match part {
        Shape::Extrusion { arcs, .. } => arcs.iter().map(|arc| arc.sides.len()).sum::<usize>(),
        other => panic!("{other:?}"),
    });
    assert_eq!(arcs.sum::<usize>(), 128);
}

#[test]
fn a_hole_that_is_none_is_refused() {
    let hole = "[\"-2 mm\", \"-2 mm\"], [\"2 mm\", \"-2 mm\"]";
    let moved = |to: &'static str| [(hole, to)];
    let words = ["does not lie inside the outline"];
    refused(PLATE, &moved("[\"-2 mm\", \"-5 mm\"], [\"2 mm\", \"-5 mm\"]"), "[", &words);
    refused(PLATE, &moved("[\"-2 mm\", \"-4 mm\"], [\"2 mm\", \"-4 mm\"]"), "[", &words);
    refused(
        PLATE,
        &moved("[\"-2 mm\", \"-2 mm\"], [\"2 mm\", \"2 mm\"]"),
        "[",
        &["crosses or touches itself"],
    );
    let twice = ("]] }", "], [[\"0 mm\", \"0 mm\"], [\"3 mm\", \"0 mm\"], [\"3 mm\", \"3 mm\"]]] }");
    refused(PLATE, &[twice], "[", &["two holes touch or overlap"]);
}
