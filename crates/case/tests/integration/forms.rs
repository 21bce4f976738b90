//! Tests of standard electrode forms, and of bodies that move.

use std::path::Path;

use elastocap_case::{Body, Case, Load, Pose, Shape};
use elastocap_geometry::scene::Purpose;

fn read(text: &str) -> Result<Case, String> {
    elastocap_case::parse(text, Path::new("forms.toml")).map_err(|error| error.to_string())
}

fn board(forms: &str, rest: &str) -> String {
    format!(
        "format = 1\n[layer]\nthickness = \"400 um\"\nrelative_permittivity = 2.8\n[layer.material.neo_hookean]\n\
         shear_modulus = \"100 kPa\"\n{forms}\n[mechanics.closed_form]\ncontact_half_length = \"3 mm\"\n\
         contact_width = \"6 mm\"\nshear_length = \"3 mm\"\n{rest}\n[surroundings]\nboundary = \"open\"\n\
         below = {{ relative_permittivity = 4.4, thickness = \"1.6 mm\" }}\n\
         above = {{ relative_permittivity = 1.0, thickness = \"open\" }}\n"
    )
}

const PRESSED: &str = "[load]\ncompression = [0.0, 0.1]\n";

const COMB: &str = "[electrodes.comb]\non = \"substrate\"\nfingers = 5\nfinger_width = \"200 um\"\ngap = \"100 um\"\n\
                    overlap = \"2 mm\"\nend_gap = \"300 um\"\nbus_width = \"500 um\"\nthickness = \"35 um\"\n";

const ARRAY: &str = "[electrodes.array]\non = \"substrate\"\npads = [2, 3]\nsize = [\"1 mm\", \"2 mm\"]\n\
                     pitch = [\"1.5 mm\", \"2.5 mm\"]\nthickness = \"0 um\"\n";

fn names(case: &Case) -> Vec<&str> {
    case.bodies.iter().map(|body| body.name.as_str()).collect()
}

/// The sum of the areas of the parts as seen along x2, mm^2, if none overlap.
fn area(body: &Body) -> f64 {
    let boxes = body.boxes().unwrap();
    boxes.iter().map(|b| b.extent(0) * b.extent(2) * 1e6).sum()
}

#[test]
fn a_comb_is_two_conductors_whose_fingers_alternate_and_do_not_touch() {
    let case = read(&board(COMB, PRESSED)).unwrap();
    assert_eq!(names(&case), ["comb-1", "comb-2"]);
    let [first, second] = [0, 1].map(|k| case.bodies[k].boxes().unwrap());
    assert_eq!((first.len(), second.len()), (4, 3), "a bus and every other finger");
    for a in &first {
        assert!(second.iter().all(|b| !a.touches(b)));
        assert!(first.iter().any(|b| a != b && a.touches(b)), "every part is joined to another");
        assert_eq!([a.min[1], a.max[1]], [-35e-6, 0.0]);
    }
    // Five fingers of 200 um with 100 um between them are 1.4 mm wide; fingers are 2.3 mm long.
    assert!((area(&case.bodies[0]) - (1.4 * 0.5 + 3.0 * 0.2 * 2.3)).abs() < 1e-9);
    assert!((area(&case.bodies[1]) - (1.4 * 0.5 + 2.0 * 0.2 * 2.3)).abs() < 1e-9);
}

#[test]
fn an_array_numbers_its_pads_along_x1_and_x3_and_is_its_own_mirror_image() {
    let case = read(&board(ARRAY, PRESSED)).unwrap();
    assert_eq!(names(&case), ["pad-1-1", "pad-1-2", "pad-1-3", "pad-2-1", "pad-2-2", "pad-2-3"]);
    let pad = |k: usize| case.bodies[k].boxes().unwrap()[0];
    assert_eq!((pad(0).min[0], pad(0).max[0]), (-pad(3).max[0], -pad(3).min[0]));
    assert_eq!((pad(0).min[2], pad(0).max[2]), (-pad(2).max[2], -pad(2).min[2]));
    assert_eq!(pad(0).sheet_normal(), Some(1));
    assert!((pad(0).extent(0) - 1e-3).abs() < 1e-12 && (pad(0).extent(2) - 2e-3).abs() < 1e-12);
}

#[test]
fn round_pads_a_common_plate_and_a_guard_are_what_they_say() {
    let round =
        ARRAY.replace("size = [\"1 mm\", \"2 mm\"]", "diameter = \"1 mm\"\ninner_diameter = \"400 um\"");
    let forms = format!(
        "{round}common_plate = {{ on = \"layer-top\", margin = \"200 um\", thickness = \"50 um\" }}\n\
         guard = {{ gap = \"100 um\", width = \"300 um\" }}\n"
    );
    let case = read(&board(&forms, PRESSED)).unwrap();
    assert_eq!(names(&case)[6..], ["pad-plate", "pad-guard"]);
    assert!(matches!(case.bodies[0].parts[0], Shape::Tube { axis: 1, radii: [2e-4, 5e-4], .. }));
    let plate = &case.bodies[6];
    assert_eq!(plate.purpose, Purpose::OnTop);
    let bounds = plate.bounds().unwrap();
    assert!((bounds.extent(0) - 2.9e-3).abs() < 1e-12 && (bounds.extent(2) - 6.4e-3).abs() < 1e-12);
    assert!(bounds.min[1] == 400e-6 && (bounds.max[1] - 450e-6).abs() < 1e-15);
    let guard = case.bodies[7].bounds().unwrap();
    assert!((guard.extent(0) - 3.3e-3).abs() < 1e-12, "2.5 mm of pads, 0.1 mm and 0.3 mm on each side");
    assert!(case.terminals.iter().any(|t| t.is_grounded && t.holds("pad-guard")));
    // A terminal that the file gives to the guard replaces the grounded one.
    let named = format!("{forms}[[terminal]]\nname = \"shield\"\nconductors = [\"pad-guard\"]\n");
    let case = read(&board(&named, PRESSED)).unwrap();
    assert!(case.terminals.iter().all(|t| !t.is_grounded));
}

#[test]
fn spirals_wind_without_touching_one_another_and_each_is_in_one_piece() {
    let spiral = "[[electrodes.spiral]]\non = \"substrate\"\nturns = 3\ntrace_width = \"100 um\"\ngap = \"60 um\"\n\
                  inner = \"200 um\"\nthickness = \"35 um\"\n";
    let alone = spiral.replace("on = ", "arms = 1\nname = \"coil\"\ncenter = [\"9 mm\", \"0 mm\"]\non = ");
    let case = read(&board(&format!("{spiral}{alone}"), PRESSED)).unwrap();
    assert_eq!(names(&case), ["spiral-1", "spiral-2", "coil"]);
    let [first, second, coil] = [0, 1, 2].map(|k| case.bodies[k].boxes().unwrap());
    assert!(first.iter().all(|a| second.iter().all(|b| !a.touches(b))));
    for arm in [&first, &second, &coil] {
        assert_eq!(arm.len(), 12);
        assert!(arm.windows(2).all(|w| w[0].touches(&w[1])));
        // A side touches only its neighbours.
        for (i, a) in arm.iter().enumerate() {
            assert!(arm.iter().enumerate().all(|(j, b)| i.abs_diff(j) <= 1 || !a.touches(b)), "{i}");
        }
    }
    // The nearest traces of the two arms are a gap apart.
    let gaps =
        first.iter().flat_map(|a| second.iter().map(move |b| (a.min[0] - b.max[0]).max(b.min[0] - a.max[0])));
    let least = gaps.filter(|gap| *gap > 0.0).fold(f64::INFINITY, f64::min);
    assert!((least - 60e-6).abs() < 1e-12, "{least}");
}

#[test]
fn forms_that_cannot_be_are_refused_where_they_stand() {
    let cases = [
        (COMB.replace("fingers = 5", "fingers = 1"), "a comb has at least two fingers"),
        (ARRAY.replace("size = [\"1 mm\", \"2 mm\"]\n", ""), "lack `size` or `diameter`"),
        (ARRAY.replace("[2, 3]", "[30, 30]"), "more pads in one form than elastocap takes"),
        (ARRAY.replace("pitch = [\"1.5 mm\"", "pitch = [\"0.9 mm\""), "touch or overlap"),
        (format!("{COMB}{ARRAY}"), "touch or overlap"),
        (COMB.replace("on = \"substrate\"", "height = \"0 um\""), "reaches into the layer"),
    ];
    for (forms, message) in cases {
        let error = read(&board(&forms, PRESSED)).unwrap_err();
        assert!(error.contains(message), "{message}: {error}");
        assert!(error.contains("forms.toml:"), "{error}");
    }
}

/// A conductor and a dielectric between these heights, with one more key.
fn patches(key: &str, low: &str, high: &str) -> String {
    let at = format!(
        "box = {{ min = [\"2 mm\", \"{low}\", \"-1 mm\"], max = [\"3 mm\", \"{high}\", \"1 mm\"] }}\n"
    );
    format!(
        "[[conductor]]\nname = \"patch\"\n{key}{at}[[dielectric]]\nname = \"filler\"\nrelative_permittivity = 5.0\n{key}{}",
        at.replace("2 mm", "4 mm").replace("3 mm", "5 mm")
    )
}

#[test]
fn what_is_in_a_loaded_layer_moves_with_its_material() {
    let comb = COMB.replace("on = \"substrate\"", "height = \"200 um\"");
    let case =
        read(&board(&format!("{comb}{}", patches("attached = \"layer\"\n", "100 um", "400 um")), PRESSED));
    let purposes: Vec<Purpose> = case.unwrap().bodies.iter().map(|body| body.purpose).collect();
    assert_eq!(purposes, [Purpose::InLayer; 4]);
    // A dielectric is attached in the same way as a conductor.
    let case = read(&board(
        &format!("{COMB}{}", patches("attached = \"layer-top\"\n", "400 um", "450 um")),
        PRESSED,
    ));
    let purposes: Vec<Purpose> = case.unwrap().bodies.iter().map(|body| body.purpose).collect();
    assert_eq!(purposes[2..], [Purpose::OnTop; 2]);
    let steps = "[load]\nsteps = [{ compression = 0.1, shift = [\"10 um\", \"0 um\"] }]\n";
    for (forms, load, message) in [
        (patches("", "100 um", "200 um"), PRESSED, "add `attached = \"layer\"`"),
        (
            patches("attached = \"layer\"\n", "100 um", "410 um"),
            PRESSED,
            "moves with the layer, and reaches out of it",
        ),
        (
            patches("attached = \"layer\"\n", "-10 um", "200 um"),
            PRESSED,
            "moves with the layer, and reaches out of it",
        ),
        (
            patches("attached = \"layer\"\n", "100 um", "200 um"),
            steps,
            "are not known of bodies that move with the material",
        ),
    ] {
        let error = read(&board(&format!("{COMB}{forms}"), load)).unwrap_err();
        assert!(error.contains(message), "{message}: {error}");
    }
}

#[test]
fn in_a_loaded_layer_bodies_are_boxes_apart_from_the_pair_whatever_else_there_is() {
    let pair = "[electrodes.in_plane_pair]\ngap = \"100 um\"\nlength = \"2 mm\"\nthickness = \"20 um\"\nwidth = \"2 mm\"\n\
                height = \"200 um\"\nshear_modulus = \"1 MPa\"\n";
    let ball = "[[conductor]]\nname = \"ball\"\nsphere = { center = [\"0 mm\", \"5 mm\", \"0 mm\"], radius = \"1 mm\" }\n";
    let touching = patches("attached = \"layer\"\n", "150 um", "210 um").replacen("2 mm", "1 mm", 1);
    let disc = "[[conductor]]\nname = \"disc\"\nattached = \"layer\"\n\
                cylinder = { axis = \"x2\", base = [\"6 mm\", \"200 um\", \"0 mm\"], radius = \"1 mm\", height = \"10 um\" }\n";
    for (forms, message) in [
        (format!("{pair}{touching}"), "the conductor \"patch\" touches the electrode"),
        (format!("{pair}{ball}{touching}"), "the conductor \"patch\" touches the electrode"),
        (format!("{pair}{disc}"), "how \"disc\" moves with the material of the layer is not known"),
    ] {
        let error = read(&board(&forms, PRESSED)).unwrap_err();
        assert!(error.contains(message), "{message}: {error}");
        assert!(error.contains("forms.toml:"), "{error}");
    }
    read(&board(&format!("{pair}{ball}"), PRESSED)).unwrap();
}

#[test]
fn what_moves_with_a_layer_of_a_length_ends_before_it() {
    let solid = "[mechanics.solid]\nwidth = \"2 mm\"\nend = \"free\"\nindenter = { sphere = { radius = \"2 mm\" } }\n\
                 [load]\ncompression = [0.1]\n";
    let forms = format!("{COMB}{}", patches("attached = \"layer\"\n", "100 um", "200 um"));
    let with = |half_length: &str| {
        let text = board(&forms, solid);
        let (start, end) =
            (text.find("[mechanics.closed_form]").unwrap(), text.find("[mechanics.solid]").unwrap());
        let text = format!("{}{}", &text[..start], &text[end..]);
        read(&text.replacen("[layer]\n", &format!("[layer]\nhalf_length = \"{half_length}\"\n"), 1))
    };
    let error = with("4 mm").unwrap_err();
    assert!(
        error.contains("the dielectric \"filler\" moves with the layer, and reaches beyond its end"),
        "{error}"
    );
    with("6 mm").unwrap();
}

const PLATE: &str = "[[conductor]]\nname = \"plate\"\nattached = \"layer-top\"\n\
                     box = { min = [\"-1 mm\", \"400 um\", \"-1 mm\"], max = [\"1 mm\", \"450 um\", \"1 mm\"] }\n";

#[test]
fn steps_have_a_load_and_move_what_is_attached() {
    let steps = "[load]\nsteps = [{ compression = 0.0 }, { compression = 0.2, shift = [\"100 um\", \"-5 um\"], \
                 tilt = [\"0.5 deg\", \"2 mrad\"] }]\n";
    let case = read(&board(&format!("{COMB}{PLATE}"), steps)).unwrap();
    assert_eq!(case.load, Some(Load::Compression(vec![0.0, 0.2])));
    assert_eq!(case.pose(0), Pose::default());
    assert_eq!(
        case.pose(1),
        Pose { shift: [100e-6, -5e-6], tilt: [0.5_f64.to_radians(), 2e-3], ..Pose::default() }
    );
    let still = read(&board(&format!("{COMB}{PLATE}"), "[load]\nsteps = [{ force = \"1 N\" }]\n")).unwrap();
    assert!(still.poses.is_empty() && still.load == Some(Load::Force(vec![1.0])));
}

#[test]
fn what_cannot_move_is_refused() {
    let mixed = "[load]\nsteps = [{ compression = 0.0 }, { force = \"1 N\" }]\n";
    let tilted = "[load]\nsteps = [{ compression = 0.1, tilt = [\"1 deg\", \"0 deg\"] }]\n";
    let both = "[load]\ncompression = [0.0]\nsteps = [{ compression = 0.1 }]\n";
    let cases = [
        (format!("{COMB}{PLATE}"), mixed, "some of the load steps give a compression, some a force"),
        (COMB.to_owned(), tilted, "`shift` and `tilt` of the load steps move nothing"),
        (format!("{COMB}{PLATE}"), both, "has both `compression` and `steps`"),
        (
            format!("{COMB}{PLATE}").replace("attached = \"layer-top\"\n", ""),
            PRESSED,
            "stays where it is when the layer sinks",
        ),
        (format!("{COMB}{PLATE}"), "[load]\nsteps = []\n", "no load steps"),
        (
            format!("{COMB}{PLATE}"),
            "[load]\nsteps = [{ compression = 0.1, tilt = [\"1 degree\", \"0 deg\"] }]\n",
            "unknown unit",
        ),
    ];
    for (forms, load, message) in cases {
        let error = read(&board(&forms, load)).unwrap_err();
        assert!(error.contains(message), "{message}: {error}");
    }
}
