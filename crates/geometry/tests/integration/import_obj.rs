//! Surfaces from OBJ files: what is taken, what is repaired, what is refused and in which words.

use elastocap_geometry::import::audit::{Repairs, apart};
use elastocap_geometry::import::obj::{Placement, read, surface};
use elastocap_geometry::import::{ImportError, ImportProblem};
use elastocap_geometry::meshing::tets::determinant;
use elastocap_geometry::shapes::TriangleSurface;
use elastocap_geometry::winding::{contains, winding_number};

const CUBE: &str = include_str!("../data/cube.obj");
const AS_IS: Placement = Placement { unit: 1.0, translate: [0.0; 3] };

fn take(text: &str) -> Result<(TriangleSurface, Repairs), ImportError> {
    surface(text.as_bytes(), "test.obj", AS_IS)
}

fn refused(text: &str) -> ImportProblem {
    take(text).unwrap_err().problem
}

fn volume(s: &TriangleSurface) -> f64 {
    let at = |p: u32| s.points[p as usize];
    s.faces.iter().map(|f| determinant([0.0; 3], at(f[0]), at(f[1]), at(f[2])) / 6.0).sum()
}

/// The cube's points moved and scaled, its faces as they are or turned.
fn cube(scale: f64, shift: f64, turned: bool, first: usize) -> String {
    let mut out = String::new();
    for line in CUBE.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[0] {
            "v" => {
                let at = |k: usize| words[k].parse::<f64>().unwrap() * scale;
                out += &format!("v {} {} {}\n", at(1) + shift, at(2), at(3));
            }
            "f" => {
                let mut corners: Vec<usize> =
                    words[1..].iter().map(|w| w.parse::<usize>().unwrap() + first).collect();
                if turned {
                    corners.reverse();
                }
                out += &format!("f {} {} {} {}\n", corners[0], corners[1], corners[2], corners[3]);
            }
            _ => {}
        }
    }
    out
}

/// A ball of `6 n^2` squares cut in two, as text.
fn ball(n: usize) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    let mut count = 0;
    for axis in 0..3 {
        for end in [-1.0, 1.0] {
            let begin = count;
            for i in 0..=n {
                for j in 0..=n {
                    let angle =
                        |k: usize| (std::f64::consts::FRAC_PI_4 * (2.0 * k as f64 / n as f64 - 1.0)).tan();
                    let mut p = [0.0; 3];
                    p[axis] = end;
                    p[(axis + 1) % 3] = if end > 0.0 { angle(i) } else { -angle(i) };
                    p[(axis + 2) % 3] = angle(j);
                    let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                    writeln!(out, "v {} {} {}", p[0] / length, p[1] / length, p[2] / length).unwrap();
                    count += 1;
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let at = |i: usize, j: usize| begin + i * (n + 1) + j + 1;
                    let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                    writeln!(out, "f {a} {b} {c}\nf {a} {c} {d}").unwrap();
                }
            }
        }
    }
    out
}

#[test]
fn the_cube_comes_scaled_and_placed_with_nothing_to_repair() {
    let placement = Placement { unit: 1e-3, translate: [1.0, 2.0, 3.0] };
    let (cube, repairs) = surface(CUBE.as_bytes(), "cube.obj", placement).unwrap();
    assert_eq!((cube.points.len(), cube.faces.len()), (8, 12));
    assert_eq!(cube.points[6], [1.0005, 2.0005, 3.0005]);
    assert_eq!(repairs, Repairs::default());
    assert!((volume(&take(CUBE).unwrap().0) - 1.0).abs() < 1e-15);
}

#[test]
fn what_does_not_concern_the_shape_changes_no_triangle() {
    let plain = read(CUBE.as_bytes(), "cube.obj").unwrap();
    let extras = "mtllib none.mtl\no \u{e9}lectrode\nvn 0 0 1\nvt 0 0\nvt nonsense\nl 1 2 3\np 1\n";
    let text = CUBE.replace("f 5 6 7 8", "usemtl copper\ng top # \nf\t5/1/1 6 -2 -1//1 # the lid").replacen(
        "v -0.5 -0.5 -0.5",
        "v -0.5 -0.5 -0.5 1 0 0.5",
        1,
    );
    let mut bytes = format!("{extras}{text}").replace('\n', "\r\n").into_bytes();
    // A name in Latin-1 is no valid UTF-8.
    bytes.splice(0..0, *b"o \xe9\n");
    let read = read(&bytes, "cube.obj").unwrap();
    assert_eq!((read.points, read.faces), (plain.points, plain.faces));
    let above = 1 + extras.lines().count() as u32;
    assert_eq!(read.lines[0], plain.lines[0] + above);
}

#[test]
fn points_keep_their_order_and_those_that_no_face_uses_their_place() {
    // More points than are parsed at a time, more faces than one mesh of the parser holds, used from the last
    // to the first.
    let mut text = String::new();
    for k in 0..2000 {
        text += &format!("v {k} {} 0.1\n", k % 7);
    }
    for k in (3..2000).rev() {
        text += &format!("f {k} {} {}\n", k - 1, k - 2);
    }
    let read = read(text.as_bytes(), "strip.obj").unwrap();
    assert_eq!(read.points.len(), 2000);
    assert!(read.points.iter().enumerate().all(|(k, p)| *p == [k as f64, (k % 7) as f64, 0.1]));
    assert_eq!((read.faces.len(), read.faces[0], read.faces[1996]), (1997, [1998, 1997, 1996], [2, 1, 0]));
    assert_eq!((read.lines[0], read.lines[1996]), (2001, 3997));
}

#[test]
fn numbers_are_the_nearest_doubles() {
    let text = "v 0.1 1e-320 -1.7976931348623157e308\nv 2.2250738585072011e-308 3 4\nv 0 0 0\nf 1 2 3\n";
    let read = read(text.as_bytes(), "numbers.obj").unwrap();
    assert_eq!(read.points[0], [0.1, 1e-320, f64::MIN]);
    assert_eq!(read.points[1], [2.225_073_858_507_201e-308, 3.0, 4.0]);
}

#[test]
fn an_inside_out_cube_is_turned_and_so_is_a_single_face() {
    let (turned, repairs) = take(&cube(1.0, 0.0, true, 0)).unwrap();
    assert!((volume(&turned) - 1.0).abs() < 1e-15);
    assert_eq!(repairs.turned_faces, 12);
    let (turned, repairs) = take(&CUBE.replace("f 5 6 7 8", "f 8 7 6 5")).unwrap();
    assert!((volume(&turned) - 1.0).abs() < 1e-15);
    assert_eq!(repairs.turned_faces, 2);
}

#[test]
fn doubled_points_are_welded_unused_ones_dropped_and_collapsed_faces_removed() {
    let text = format!("{CUBE}v 7 7 7\nv 0.5 0.5 0.5000000000000001\nf 7 9 7\n");
    let text = text.replace("f 1 4 3 2", "v 0.5 0.5 0.5\nf 1 4 3 2").replace("f 2 3 7 6", "f 2 3 9 6");
    let (surface, repairs) = take(&text).unwrap();
    assert_eq!((surface.points.len(), surface.faces.len()), (8, 12));
    assert_eq!((repairs.welded_points, repairs.unused_points, repairs.dropped_faces), (2, 1, 1));
}

#[test]
fn a_missing_face_is_named_with_place_and_line() {
    let error = take(&CUBE.replace("f 5 6 7 8\n", "")).unwrap_err();
    assert!(matches!(error.problem, ImportProblem::NotClosed(place, 4) if place.at[2] == 0.5), "{error}");
    let text = error.to_string();
    assert!(text.starts_with("test.obj: not closed") && text.contains("line 1"), "{text}");
}

#[test]
fn a_third_face_on_an_edge_is_refused() {
    let text = format!("{CUBE}v 0 0 3\nf 5 6 9\n");
    assert!(matches!(refused(&text), ImportProblem::NonManifoldEdge(_, 3)));
}

#[test]
fn cubes_that_cross_touch_or_cover_one_another_are_refused() {
    for shift in [0.3, 1.0, 0.0] {
        let text = cube(1.0, 0.0, false, 0) + &cube(1.0, shift, false, 8);
        let problem = refused(&text);
        let found = matches!(
            problem,
            ImportProblem::SelfIntersection(..)
                | ImportProblem::NonManifoldEdge(..)
                | ImportProblem::OneSided(_)
        );
        assert!(found, "shift {shift}: {problem}");
    }
    // A smaller one on the face of the other, without a common corner.
    let problem = refused(&(cube(1.0, 0.0, false, 0) + &cube(0.5, 0.75, false, 8)));
    assert!(matches!(problem, ImportProblem::SelfIntersection(..)), "{problem}");
}

#[test]
fn a_hollow_is_kept_and_a_body_in_a_body_refused() {
    let (hollow, _) = take(&(cube(1.0, 0.0, false, 0) + &cube(0.5, 0.0, true, 8))).unwrap();
    assert!((volume(&hollow) - 0.875).abs() < 1e-15);
    assert!(matches!(
        refused(&(cube(1.0, 0.0, false, 0) + &cube(0.5, 0.0, false, 8))),
        ImportProblem::Nested(_)
    ));
    let (two, _) = take(&(cube(1.0, 0.0, false, 0) + &cube(0.5, 2.0, true, 8))).unwrap();
    assert!((volume(&two) - 1.125).abs() < 1e-15);
}

#[test]
fn cubes_joined_by_a_corner_are_refused() {
    let text = cube(1.0, 0.0, false, 0);
    let other: String = cube(1.0, 1.0, false, 8)
        .lines()
        .map(|l| match l.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => {
                let up = |t: &str| t.parse::<f64>().unwrap() + 1.0;
                format!("v {x} {} {}\n", up(y), up(z))
            }
            _ => format!("{l}\n"),
        })
        .collect();
    let problem = refused(&(text + &other));
    assert!(matches!(problem, ImportProblem::Pinched(place) if place.at == [0.5; 3]), "{problem}");
}

#[test]
fn a_face_without_area_is_refused() {
    let text = CUBE.replace("f 1 4 3 2", "v 0 -0.5 -0.5\nf 1 4 3 2\nf 1 2 9\nf 9 2 1");
    assert!(matches!(refused(&text), ImportProblem::DegenerateFace(_)));
}

#[test]
fn a_moebius_band_closed_on_itself_has_one_side() {
    // The projective plane of six points has two faces on every edge and one side.
    let faces = [
        [1, 2, 3],
        [1, 3, 4],
        [1, 4, 5],
        [1, 5, 6],
        [1, 6, 2],
        [2, 3, 5],
        [3, 4, 6],
        [4, 5, 2],
        [5, 6, 3],
        [6, 2, 4],
    ];
    let mut text =
        String::from("v 0 0 1\nv 1 0 0\nv 0.3 1 0.1\nv -0.8 0.6 0.2\nv -0.8 -0.5 0.3\nv 0.3 -1 0.4\n");
    for f in faces {
        text += &format!("f {} {} {}\n", f[0], f[1], f[2]);
    }
    assert!(matches!(refused(&text), ImportProblem::OneSided(_)));
}

#[test]
fn nonsense_is_refused_with_its_line() {
    for (bad, line) in [
        ("v 1 2", 2),
        ("v nan 0 0", 2),
        ("v 1e999 0 0", 2),
        ("f 1 2 0", 2),
        ("f 1 2 99", 2),
        ("f 1 2", 2),
        ("f a b c", 2),
        ("v 1 2 3 2", 2),
        ("v 1 2 3 0", 2),
        ("v 1 2 0x3", 2),
        ("v 1\u{a0}2 3 4 5", 2),
        ("v 1 2 \u{fffd}", 2),
        ("f", 2),
        // Points below a face do not exist for it.
        ("f 1 2 3", 2),
        ("f -1 -2 -3", 2),
        ("f 1 2 9223372036854775808", 2),
        ("f 1 2 -9223372036854775808", 2),
        ("f 1/x 2 3", 2),
        ("f 1/1/1/1 2 3", 2),
        ("f // 2 3", 2),
    ] {
        let error = take(&format!("# header\n{bad}\n{CUBE}")).unwrap_err();
        assert!(
            matches!(&error.problem, ImportProblem::Malformed { place, .. } if *place == format!("line {line}")),
            "{bad}: {error}"
        );
    }
    // A file that begins with a word of no OBJ file may be anything, and nothing of it is shown.
    let error = take("# header\nhunter2 4\n").unwrap_err();
    assert!(matches!(error.problem, ImportProblem::NoObj { line: 2 }), "{error}");
    assert!(!error.to_string().contains("hunter2"), "{error}");
    let error = take("v 0 0 0\ngarbage\n").unwrap_err();
    assert_eq!(error.to_string(), "test.obj: line 2: unknown keyword \"garbage\"; export the file again");
    // Among many faces, and the first of several.
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    text += &"f 1 2 3\n".repeat(3000);
    text += "f 1 2 4\nf 1 2\nv 0 0 inf\n";
    let error = take(&text).unwrap_err().to_string();
    assert_eq!(error, "test.obj: line 3004: corner 4 of 3 points above; export the file again");
    assert!(matches!(refused(""), ImportProblem::Empty(_)));
    assert!(matches!(refused("v 0 0 0\nf 1 1 1 1\n"), ImportProblem::Empty(_)));
    assert!(matches!(refused("v 0 0 0\n"), ImportProblem::Empty(_)));
    assert!(matches!(refused("surf 0 1 0 1 1 2 3 4\n"), ImportProblem::Unsupported { .. }));
}

#[test]
fn nonsense_units_are_refused() {
    let with = |unit: f64, x: f64| {
        surface(CUBE.as_bytes(), "c", Placement { unit, translate: [x, 0.0, 0.0] }).map_err(|e| e.problem)
    };
    for unit in [1e7, 1e-13, 1e308] {
        assert!(matches!(with(unit, 0.0), Err(ImportProblem::Size { .. })), "{unit}");
    }
    for unit in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(with(unit, 0.0), Err(ImportProblem::Placement { .. })), "{unit}");
    }
    assert!(matches!(with(1e-6, 1e5), Err(ImportProblem::FarAway { .. })));
}

#[test]
fn a_concave_face_is_cut_inside_its_outline() {
    // An L pulled upwards.
    let outline = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];
    let mut text = String::new();
    for z in 0..2 {
        for [x, y] in outline {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text += "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
    for k in 0..6 {
        text += &format!("f {} {} {} {}\n", k + 1, (k + 1) % 6 + 1, (k + 1) % 6 + 7, k + 7);
    }
    let (surface, repairs) = take(&text).unwrap();
    assert!((volume(&surface) - 3.0).abs() < 1e-15);
    assert_eq!(repairs, Repairs::default());
}

#[test]
fn two_surfaces_must_be_apart() {
    let [a, b, far, small] =
        [(1.0, 0.0), (1.0, 0.9), (1.0, 3.0), (0.2, 0.1)].map(|(s, x)| take(&cube(s, x, false, 0)).unwrap().0);
    assert_eq!(apart(&[("a", &a), ("far", &far)]), Ok(()));
    let overlap = apart(&[("a", &a), ("far", &far), ("b", &b)]).unwrap_err();
    assert!(
        overlap.file == "b"
            && matches!(&overlap.problem, ImportProblem::Overlap { other, .. } if other == "a"),
        "{overlap}"
    );
    for pair in [[("a", &a), ("small", &small)], [("small", &small), ("a", &a)]] {
        let inside = apart(&pair).unwrap_err();
        assert!(
            inside.file == "small"
                && matches!(&inside.problem, ImportProblem::Inside { other, .. } if other == "a"),
            "{inside}"
        );
    }
}

#[test]
fn the_winding_number_tells_inside_from_outside() {
    let (cube, _) = take(CUBE).unwrap();
    assert!((winding_number(&cube, [0.1, 0.2, -0.3]) - 1.0).abs() < 1e-14);
    assert!(winding_number(&cube, [0.1, 0.7, -0.3]).abs() < 1e-14);
    assert!(contains(&cube, [0.4999, 0.0, 0.0]) && !contains(&cube, [0.5001, 0.0, 0.0]));
}

#[test]
fn a_ball_of_a_hundred_thousand_triangles_passes_the_audit() {
    let text = ball(92);
    let (surface, _) = take(&text).unwrap();
    assert_eq!(surface.faces.len(), 12 * 92 * 92);
    assert_eq!(surface.points.len(), 6 * 92 * 92 + 2);
    assert!((volume(&surface) / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 3e-4);
}
