//! Triangulations of the plane for fields that are singular at corners and along edges.
//!
//! A coarse triangulation follows the outlines ([`coarse()`]). Its triangles are then divided geometrically
//! ([`graded`]): towards each marked corner into rings, towards each marked edge into strips, every one a
//! fixed share of the width of the one before. With polynomials on such meshes the error falls exponentially
//! with the number of layers (Babuska and Guo, Comput. Mech. 1, 1986).

mod bands;
mod circle;
mod circles;
mod coarse;
mod cubics;
mod divided;
mod grading;
mod outline;

pub use bands::{Band, bands};
pub use circle::Circle;
pub use coarse::{Coarse, RoundSide, Triangles, coarse};
pub use outline::{Course, Outline, Side};

use elastocap_fem::bent::Bent;
use grading::Grading;
use std::collections::{HashMap, HashSet};

/// The corners and edges of a coarse triangulation towards which it is graded.
#[derive(Debug, Clone, Default)]
pub struct Marks {
    /// For each point whether it is a corner.
    pub corners: Vec<bool>,
    /// Sides of triangles, by the numbers of their ends in ascending order.
    pub edges: HashSet<[u32; 2]>,
    /// Sides of triangles that belong to chains, by their ends in the same way, each with the number of its
    /// chain.
    pub chains: HashMap<[u32; 2], u32>,
    /// Pairs of triangles that are divided together.
    pub bands: Vec<Band>,
}

/// The parameters of the grading of a triangulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// Rings around each marked corner.
    pub corners: usize,
    /// Strips along each marked edge; at most as many as rings.
    pub edges: usize,
    /// Width of a layer over that of the next one outwards.
    pub ratio: f64,
}

/// A divided mesh.
#[derive(Debug, Clone, Default)]
pub struct Graded {
    /// The points, those in bent triangles moved with them, and the triangles.
    pub mesh: Triangles,
    /// For each triangle the triangle of the coarse mesh that it is a part of.
    pub parents: Vec<u32>,
    /// For each triangle the bent triangle that it is a part of, if there is one.
    pub bent: Vec<Option<Bent>>,
    /// The position of each point if no triangle were bent.
    pub straight: Vec<[f64; 2]>,
    /// The sides of divided triangles that belong to chains, as in [`Marks::chains`].
    pub chains: HashMap<[u32; 2], u32>,
}

/// Divides the triangles of a mesh towards marked corners and edges.
pub fn graded(coarse: &Coarse, marks: &Marks, layers: Layers) -> Graded {
    let mut grading = Grading::new(coarse, marks, layers);
    grading.separate();
    grading.divide()
}

/// A side of a triangle, as the numbers of its two ends in ascending order.
fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::circles::apart;
    use super::*;
    use std::f64::consts::TAU;

    const L: [[f64; 2]; 6] = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    const FRAME: [[f64; 2]; 2] = [[-3.0, -2.0], [4.0, 5.0]];

    fn area(mesh: &Triangles, t: &[u32; 3]) -> f64 {
        let [a, b, c] = t.map(|p| mesh.points[p as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }

    /// Each side belongs to two triangles, or to one and lies on the frame.
    fn is_conforming(mesh: &Triangles) -> bool {
        let mut count: HashMap<[u32; 2], usize> = HashMap::new();
        for [a, b, c] in &mesh.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                *count.entry(side).or_default() += 1;
            }
        }
        let on_frame = |side: &[u32; 2]| {
            let [p, q] = side.map(|p| mesh.points[p as usize]);
            (0..2).any(|k| p[k] == q[k] && (p[k] == FRAME[0][k] || p[k] == FRAME[1][k]))
        };
        count.iter().all(|(side, n)| *n == 2 || (*n == 1 && on_frame(side)))
    }

    fn on_outline(outline: &[[f64; 2]], p: [f64; 2]) -> bool {
        outline.iter().zip(outline.iter().cycle().skip(1)).any(|(a, b)| {
            let along = [b[0] - a[0], b[1] - a[1]];
            let from = [p[0] - a[0], p[1] - a[1]];
            let cross = along[0] * from[1] - along[1] * from[0];
            let dot = (along[0] * from[0] + along[1] * from[1]) / (along[0].powi(2) + along[1].powi(2));
            cross.abs() < 1e-12 && (-1e-12..=1.0 + 1e-12).contains(&dot)
        })
    }

    fn marks(mesh: &Triangles, outline: &[[f64; 2]]) -> Marks {
        let mut edges = HashSet::new();
        for [a, b, c] in &mesh.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                let [p, q] = side.map(|p| mesh.points[p as usize]);
                let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
                if on_outline(outline, p) && on_outline(outline, q) && on_outline(outline, middle) {
                    edges.insert(side);
                }
            }
        }
        let chains = edges.iter().map(|side| (*side, 7)).collect();
        let corners = mesh.points.iter().map(|p| outline.contains(p)).collect();
        Marks { corners, edges, chains, bands: Vec::new() }
    }

    #[test]
    fn a_graded_mesh_fills_the_frame_and_conforms_at_any_number_of_layers() {
        let coarse = coarse(&[Outline::polygon(&L)], FRAME).unwrap();
        let mesh = &coarse.mesh;
        assert!(is_conforming(mesh));
        let marks = marks(mesh, &L);
        assert!(marks.corners.iter().filter(|c| **c).count() == 6 && marks.edges.len() >= 6);
        for corners in 0..4 {
            for edges in 0..=corners {
                let Graded { mesh: fine, parents, chains, .. } =
                    graded(&coarse, &marks, Layers { corners, edges, ratio: 0.15 });
                assert!(is_conforming(&fine), "{corners} {edges}");
                let total: f64 = fine.triangles.iter().map(|t| area(&fine, t)).sum();
                assert!((total - 49.0).abs() < 1e-11, "{corners} {edges}: {total}");
                let mut of_parent = vec![0.0; mesh.triangles.len()];
                fine.triangles
                    .iter()
                    .zip(&parents)
                    .for_each(|(t, p)| of_parent[*p as usize] += area(&fine, t));
                let differ = mesh.triangles.iter().zip(of_parent).map(|(t, a)| (a - area(mesh, t)).abs());
                assert!(differ.fold(0.0, f64::max) < 1e-12);
                let nearest = fine.points.iter().filter(|p| !on_outline(&L, **p));
                let nearest = nearest.map(|p| p[0].hypot(p[1])).fold(f64::INFINITY, f64::min);
                assert!(corners == 0 || nearest < 1.5 * 0.15_f64.powi(corners as i32));
                let length = |side: &[u32; 2]| {
                    let [p, q] = side.map(|p| fine.points[p as usize]);
                    (p[0] - q[0]).hypot(p[1] - q[1])
                };
                let followed: f64 = chains.keys().map(length).sum();
                assert!(
                    (followed - 8.0).abs() < 1e-12 && chains.values().all(|chain| *chain == 7),
                    "{followed}"
                );
                let lies = |side: &&[u32; 2]| side.iter().all(|p| on_outline(&L, fine.points[*p as usize]));
                assert_eq!(chains.keys().filter(lies).count(), chains.len());
            }
        }
    }

    #[test]
    fn bands_between_edges_that_face_each_other_are_divided_as_one_and_the_mesh_conforms() {
        let trace = [[-2.0, 0.1], [3.0, 0.1], [3.0, 0.6], [-2.0, 0.6]];
        let coarse = coarse(&[Outline::polygon(&trace)], FRAME).unwrap();
        let alone = marks(&coarse.mesh, &trace);
        let inside = |t: usize| {
            let x = coarse.mesh.triangles[t].map(|p| coarse.mesh.points[p as usize]);
            crate::outline::contains(&trace, [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0))
        };
        let alike = |one, other| inside(one) == inside(other);
        let bands = bands(&coarse, &alone.edges, &HashMap::new(), &alone.corners, alike);
        assert!(bands.len() >= 3, "{}", bands.len());
        for band in &bands {
            assert!(band.triangles.iter().all(|t| inside(*t as usize)));
            assert!(band.corners.iter().all(|p| !alone.corners[*p as usize]));
        }
        for (corners, edges) in [(1, 1), (3, 1), (3, 2), (3, 3)] {
            let layers = Layers { corners, edges, ratio: 0.15 };
            let as_triangles = graded(&coarse, &alone, layers);
            let together = Marks { bands: bands.clone(), ..alone.clone() };
            let Graded { mesh, parents, bent, chains, .. } = graded(&coarse, &together, layers);
            assert!(is_conforming(&mesh), "{corners} {edges}");
            assert!(mesh.triangles.len() + 5 * bands.len() <= as_triangles.mesh.triangles.len());
            assert!(parents.len() == mesh.triangles.len() && bent.len() == mesh.triangles.len());
            let total: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
            assert!((total - 49.0).abs() < 1e-11, "{total}");
            // No part lies across the outline, and strips are as narrow as those beside them.
            let within: f64 = mesh
                .triangles
                .iter()
                .zip(&parents)
                .filter(|(_, p)| inside(**p as usize))
                .map(|(t, _)| area(&mesh, t))
                .sum();
            assert!((within - 2.5).abs() < 1e-12, "{within}");
            let heights = |mesh: &Triangles| {
                let inner = mesh.points.iter().map(|p| p[1] - 0.1).filter(|y| *y > 1e-9);
                inner.fold(f64::INFINITY, f64::min)
            };
            let [one, other] = [heights(&mesh), heights(&as_triangles.mesh)];
            assert!((one - other).abs() < 1e-9 * other, "{one} {other}");
            assert_eq!(chains.len(), as_triangles.chains.len());
        }
        // Two triangles that are not alike do not form a band.
        assert!(
            super::bands(&coarse, &alone.edges, &HashMap::new(), &alone.corners, |_, _| false).is_empty()
        );
    }

    #[test]
    fn a_triangle_and_a_needle_all_of_whose_edges_are_marked_are_graded_too() {
        for outline in [vec![[0.0, 0.0], [1.0, 0.1], [0.2, 0.9]], vec![[0.0, 0.0], [3.0, 0.0], [3.0, 0.02]]] {
            let coarse = coarse(&[Outline::polygon(&outline)], FRAME).unwrap();
            let layers = Layers { corners: 3, edges: 2, ratio: 0.15 };
            let fine = graded(&coarse, &marks(&coarse.mesh, &outline), layers);
            assert!(is_conforming(&fine.mesh));
        }
    }

    #[test]
    fn circles_are_followed_by_arcs_that_end_where_other_outlines_cross_them() {
        let circle = Circle { center: [0.0, 1.0], radius: 1.5 };
        let outlines = [Outline::Circle(circle), Outline::polygon(&L)];
        // Whole, and cut in two by the frame through its middle.
        for frame in [FRAME, [[0.0, -2.0], [4.0, 5.0]]] {
            let coarse = coarse(&outlines, frame).unwrap();
            let turned: f64 = coarse
                .arcs
                .keys()
                .map(|side| {
                    let [p, q] = side.map(|p| coarse.mesh.points[p as usize]);
                    for p in [p, q] {
                        let distance = (p[0] - circle.center[0]).hypot(p[1] - circle.center[1]);
                        assert!((distance - circle.radius).abs() < 1e-12);
                    }
                    apart(circle.angle(p), circle.angle(q))
                })
                .sum();
            let share = if frame[0][0] == 0.0 { 0.5 } else { 1.0 };
            assert!((turned - share * TAU).abs() < 1e-9, "{turned}");
            let crosses = |t: &[u32; 3]| {
                let x = t.map(|p| coarse.mesh.points[p as usize]);
                let middle = [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0);
                let inside = crate::outline::contains(&L, middle);
                let strictly = |p: &[f64; 2]| crate::outline::contains(&L, *p) && !on_outline(&L, *p);
                !inside && x.iter().any(strictly)
            };
            assert!(!coarse.mesh.triangles.iter().any(crosses));
        }
    }

    #[test]
    fn arcs_that_go_over_into_straight_sides_or_into_one_another_are_followed() {
        let arc = |from: [f64; 2], center: [f64; 2], radius: f64, turn: f64| Side {
            from,
            curve: Some(Course::Circle(Circle { center, radius }, turn)),
        };
        let straight = |from: [f64; 2]| Side { from, curve: None };
        let stadium = vec![
            straight([-1.0, 0.0]),
            arc([1.0, 0.0], [1.0, 1.0], 1.0, 0.5 * TAU),
            straight([1.0, 2.0]),
            arc([-1.0, 2.0], [-1.0, 1.0], 1.0, 0.5 * TAU),
        ];
        let drop = vec![
            arc([0.0, 0.0], [0.0, 1.0], 1.0, 0.25 * TAU),
            arc([1.0, 1.0], [2.0, 1.0], 1.0, -0.25 * TAU),
            straight([2.0, 2.0]),
            straight([0.0, 2.0]),
        ];
        // Twice, as the outlines of an electrode and of the body below it.
        let twice = [Outline::Path(stadium.clone()), Outline::Path(stadium.clone())];
        for (outlines, turn) in [(&twice[..1], 1.0), (&twice, 1.0), (&[Outline::Path(drop)][..], 0.5)] {
            let coarse = coarse(outlines, FRAME).unwrap();
            assert!(is_conforming(&coarse.mesh));
            let turned = coarse.arcs.iter().map(|([p, q], arc)| {
                let RoundSide::Circle(circle) = arc else { panic!("{arc:?}") };
                let [p, q] = [p, q].map(|p| coarse.mesh.points[*p as usize]);
                circle.turn(p, q).abs()
            });
            let turned: f64 = turned.sum();
            assert!((turned - turn * TAU).abs() < 1e-9, "{turned}");
        }
        // There is no mesh where an arc touches a circle at a point other than its ends.
        let touching = Outline::Circle(Circle { center: [2.5, 1.0], radius: 0.5 });
        assert!(coarse(&[twice[0].clone(), touching], FRAME).is_none());
        let apart = Outline::Circle(Circle { center: [0.0, 1.0], radius: 0.5 });
        assert!(
            coarse(&[twice[0].clone(), apart], FRAME).is_some(),
            "it touches the circle, but no arc of it"
        );
    }

    #[test]
    fn circles_that_cross_are_divided_where_they_do_and_those_that_touch_have_no_mesh() {
        let one = Circle { center: [0.0, 1.0], radius: 1.5 };
        let coarse_of = |other: Circle| coarse(&[one, other].map(Outline::Circle), FRAME);
        for other in [
            Circle { center: [1.1, 1.7], radius: 0.9 },
            Circle { center: [0.0, 1.4], radius: 1.5 },
            Circle { center: [-0.3, 0.8], radius: 0.2 },
        ] {
            let coarse = coarse_of(other).unwrap();
            for circle in [one, other] {
                let arcs = coarse.arcs.iter().filter(|(_, side)| **side == RoundSide::Circle(circle));
                let turned: f64 = arcs
                    .map(|(side, _)| {
                        let [p, q] = side.map(|p| coarse.mesh.points[p as usize]);
                        apart(circle.angle(p), circle.angle(q))
                    })
                    .sum();
                assert!((turned - TAU).abs() < 1e-9, "{circle:?}: {turned}");
            }
        }
        assert!(coarse_of(Circle { center: [2.0, 1.0], radius: 0.5 }).is_none());
        assert!(coarse_of(Circle { center: [0.5, 1.0], radius: 1.0 }).is_none());
    }

    #[test]
    fn outlines_that_reach_beyond_the_frame_end_on_it() {
        let wide = [[-9.0, 1.0], [9.0, 1.0], [9.0, 2.0], [-9.0, 2.0]];
        let mesh = coarse(&[&wide[..], &L].map(Outline::polygon), FRAME).unwrap().mesh;
        assert!(is_conforming(&mesh));
        let total: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
        assert!((total - 49.0).abs() < 1e-12);
        let crosses = |t: &[u32; 3]| {
            let y = t.map(|p| mesh.points[p as usize][1]);
            y.iter().any(|y| *y < 1.0 - 1e-12) && y.iter().any(|y| *y > 1.0 + 1e-12)
        };
        assert!(!mesh.triangles.iter().any(crosses));
    }

    #[test]
    fn every_point_on_the_frame_is_on_it_to_the_last_bit() {
        for k in 0..40 {
            let shift = 0.013 * f64::from(k);
            let frame = [[-0.95 / 1.1 - shift, -1.0 / 0.7], [1.05 / 1.1 + shift, 3.0_f64.sqrt()]];
            let outline = vec![[-0.5, -0.3], [0.4, -0.3], [0.4, 0.35 + shift], [-0.5, 0.35]];
            let mesh = coarse(&[Outline::polygon(&outline)], frame).unwrap().mesh;
            for p in &mesh.points {
                for c in 0..2 {
                    for end in frame.map(|corner| corner[c]) {
                        assert!(p[c] == end || (p[c] - end).abs() > 1e-6, "{p:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn outlines_that_cross_are_both_followed() {
        let one = vec![[0.1, -0.4], [0.5, -0.4], [0.5, 0.5], [0.1, 0.5]];
        let other = vec![[-0.6, -0.5], [0.4, -0.5], [0.4, 0.3], [-0.6, 0.3]];
        for turn in [0.0_f64, 0.3, 1.1] {
            let turned = |outline: &[[f64; 2]]| -> Vec<[f64; 2]> {
                let (s, c) = turn.sin_cos();
                outline.iter().map(|p| [c * p[0] - s * p[1], s * p[0] + c * p[1]]).collect()
            };
            let outlines = [turned(&one), turned(&other)];
            let mesh =
                coarse(&outlines.each_ref().map(|corners| Outline::polygon(corners)), FRAME).unwrap().mesh;
            for (outline, exact) in outlines.iter().zip([0.36, 0.8]) {
                let inside = mesh.triangles.iter().filter(|t| {
                    let x = t.map(|p| mesh.points[p as usize]);
                    let middle = [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0);
                    crate::outline::contains(outline, middle)
                });
                let total: f64 = inside.map(|t| area(&mesh, t)).sum();
                assert!((total - exact).abs() < 1e-12, "{turn}: {total} {exact}");
            }
        }
    }
}
