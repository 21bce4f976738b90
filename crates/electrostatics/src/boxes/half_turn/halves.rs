//! Halves and quarters of a scene that a half turn about the second axis takes to itself, for potentials that
//! are even or odd under the turn.
//!
//! A potential with u(-x1, x2, -x3) = u(x1, x2, x3), or minus that, is known from the half of the scene above
//! x1 = 0. There it is a potential like any other, but for the plane x1 = 0, on which it is even, or odd,
//! across x3 = 0; and so is the flux through that plane, with the other sign.
//!
//! - Potentials are functions on this half whose values on that plane have this parity. The projection on
//!   these functions ([`Fold::project`](super::fold::Fold)) is all that distinguishes the primal problem.
//! - The flux on lines of the first axis that cross the plane is that of the whole line. So these lines are
//!   taken on the half above x3 = 0, to which the unknowns are carried and back
//!   ([`Exchange`](super::exchange::Exchange)): a line and its turned image are one.
//! - Permittivity and map are mirror-symmetric across both planes. So the problem without conductors
//!   separates into two, each on a quarter of the scene: one for what is odd across x3 = 0, one for what is
//!   even. The same holds for the repair of a divergence, and for the boxes of the preconditioner that meet
//!   no conductor on either side ([`Fold`](super::fold::Fold)).

use super::mirror_images;
use crate::boxes::conductor_free::{FreeBox, free_boxes};
use crate::boxes::domain::{Axis, Block, Domain, OtherParts};
use crate::boxes::holders::ACROSS;
use crate::boxes::layout::{Grid, Layout};
use elastocap_fem::reflection::reflected_functions;
use elastocap_geometry::scene::Wall;
use faer::Mat;

/// The layouts of the halves and the quarter.
#[derive(Debug, Clone)]
pub(crate) struct Halves {
    /// The half above the middle of the first axis.
    pub(crate) half: Layout,
    /// The half above the middle of the last axis.
    other_half: Layout,
    /// The quarter above both middles, with the conductors on both sides of the middle of the last axis.
    /// Grids are made for this quarter.
    pub(crate) quarter: Layout,
    /// Whether the potential is odd under the turn.
    pub(crate) odd: bool,
}

impl Halves {
    /// The halves and the quarter of a layout that a half turn takes to itself, and that has the planes
    /// `first` and `last` in the middle of these two axes.
    pub(crate) fn of(whole: &Layout, [first, last]: [usize; 2], odd: bool) -> Self {
        // A block that ends at the plane touches it: its turned image begins there, at another place.
        let touches = |a: usize| move |b: &Block, first: usize| b.hi[a] >= first;
        let half = whole.above(0, first, Wall::Insulated, touches(0));
        let other_half = whole.above(2, last, Wall::Insulated, touches(2));
        let mut quarter = half.above(2, last, Wall::Insulated, touches(2));
        let mut below = half.clone();
        for blocks in &mut below.conductors {
            *blocks = half.flipped(blocks, 2);
        }
        let below = below.above(2, last, Wall::Insulated, touches(2));
        for (blocks, more) in quarter.conductors.iter_mut().zip(below.conductors) {
            blocks.extend(more);
            blocks.sort_unstable();
            blocks.dedup();
        }
        Self { half, other_half, quarter, odd }
    }

    /// The other parts on a grid of the quarter, and for each block of the other half its conductor.
    pub(crate) fn other_parts(&self, grid: &Grid) -> (OtherParts, Vec<usize>) {
        let (half, held) = self.other_half.domain(&grid.reflected([true, false, false]));
        // What is even across both middles, or odd across both, is even under the turn.
        let quarters = [true, false].map(|odd_across_last| {
            let mut layout = self.quarter.clone();
            let wall = |odd: bool| if odd { Wall::Grounded } else { Wall::Insulated };
            layout.walls[2][0] = wall(odd_across_last);
            layout.walls[0][0] = wall(odd_across_last != self.odd);
            layout.domain(grid).0
        });
        (OtherParts { half, quarters, odd: self.odd }, held)
    }
}

/// The half, quarter or eighth of a layout that grids are made for.
pub(crate) fn core_of(layout: &Layout) -> Layout {
    let reduced = (0..3).fold(layout.clone(), |layout, a| layout.half(a, false));
    match &reduced.turn {
        Some(turn) => Halves::of(&reduced, turn.planes, false).quarter,
        None => reduced,
    }
}

/// Extends a potential from the half of a scene to the whole, in the functions of the axes there
/// ([`whole_axes`]). `None` where these axes are not mirror-symmetric.
pub(crate) fn on_whole(domain: &Domain, turn: &OtherParts, u: &[f64]) -> Option<Vec<f64>> {
    let axes = whole_axes(domain, turn);
    let [m0, n1, n2] = axes.map(|axis| axis.functions().len());
    let [first, last] = ACROSS.map(|a| mirror_images(reflected(axes[a]).as_ref()));
    let (first, last) = (first?, last?);
    let above = m0 - domain.axes[0].functions().len();
    let plane = n1 * n2;
    let mut out = vec![0.0; m0 * plane];
    for (slab, index) in u.chunks_exact(plane.max(1)).zip(above..) {
        let (image, sign) = first[index];
        for (row, from) in slab.chunks_exact(n2.max(1)).enumerate() {
            let start = image * plane + row * n2;
            for (x, (there, last_sign)) in from.iter().zip(&last) {
                out[start + there] = turn.parity() * sign * last_sign * x;
            }
        }
        out[index * plane..(index + 1) * plane].copy_from_slice(slab);
    }
    Some(out)
}

/// The axes of the whole scene, given the domain of half of it.
pub(crate) fn whole_axes<'d>(domain: &'d Domain, turn: &'d OtherParts) -> [&'d Axis; 3] {
    [&turn.half.axes[0], &domain.axes[1], &domain.axes[2]]
}

/// The matrix that takes coefficients of the functions of an axis that no wall holds to those of the mirror
/// image.
pub(crate) fn reflected(axis: &Axis) -> Mat<f64> {
    let (whole, free) = (reflected_functions(&axis.line), axis.functions());
    whole.as_ref().submatrix(free.start, free.start, free.len(), free.len()).to_owned()
}

/// Keeps the conductor-free boxes of a domain that the preconditioner needs besides the boxes of the
/// quarters; all of them where the domain is not the half of a scene.
///
/// The functions of a box that ends in the middle of the first axis are made to vanish there, as at any end
/// of a box. Functions that do not vanish there are in boxes of the quarters: what is free of conductors in
/// that plane is so on both sides of the middle of the last axis, since the turn takes the plane to itself.
pub(crate) fn not_in_quarters(domain: &Domain, mut boxes: Vec<FreeBox>) -> Vec<FreeBox> {
    let Some(turn) = &domain.turn else { return boxes };
    let [quarter, _] = &turn.quarters;
    let quarter_boxes = free_boxes(quarter);
    let middle = quarter.cells()[2];
    boxes.retain(|half_box| !quarter_boxes.iter().any(|quarter_box| is_in(half_box, quarter_box, middle)));
    for half_box in boxes.iter_mut().filter(|half_box| half_box.block.lo[0] == 0) {
        half_box.held[0][0] = true;
    }
    boxes
}

/// Whether a box of a half lies in one of a quarter, or in its mirror image across the middle of the last
/// axis.
fn is_in(half_box: &FreeBox, quarter_box: &FreeBox, middle: usize) -> bool {
    let (p, q) = (&half_box.block, &quarter_box.block);
    let within = |lo: usize, hi: usize, a: usize| q.lo[a] <= lo && hi <= q.hi[a];
    // Where both reach an end on which a sheet lies, the functions of both have to vanish on it.
    let (held, half_held) = (&quarter_box.held, &half_box.held);
    let does_not_vanish = (held[0][0] && p.lo[0] == 0 && q.lo[0] == 0 && !half_held[0][0])
        || (held[0][1] && p.hi[0] == q.hi[0] && !half_held[0][1])
        || (0..2).any(|side| {
            let shared = if side == 0 { p.lo[1] == q.lo[1] } else { p.hi[1] == q.hi[1] };
            shared && held[1][side] && !half_held[1][side]
        });
    if does_not_vanish || !(0..2).all(|a| within(p.lo[a], p.hi[a], a)) {
        return false;
    }
    let (lo, hi) = (p.lo[2], p.hi[2]);
    // The range above the middle that the box covers, or its mirror image: the box lies above the middle,
    // across it, or below it.
    let (from, to) = match (lo.checked_sub(middle), hi.checked_sub(middle)) {
        (Some(from), Some(to)) => (from, to),
        (None, Some(to)) if to > 0 => (0, to.max(middle - lo)),
        _ => (middle - hi, middle - lo),
    };
    let at_end = to == q.hi[2] && held[2][1] && !(half_held[2][0] || half_held[2][1]);
    within(from, to, 2) && !(from == 0 && held[2][0]) && !at_end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::dual::mapped::{Solved, lower as bent_lower};
    use crate::boxes::energy::{Start, lower, upper};
    use crate::boxes::resolution::graded;
    use crate::boxes::scene_map::{MapAxis, SceneMap};
    use crate::solution::ResolutionLevel;
    use elastocap_geometry::scene::{Body, Box3, Scene};
    use elastocap_geometry::shapes::Shape;
    use std::sync::Arc;

    fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
        Shape::Box(Box3 { min, max })
    }

    fn body(name: &str, boxes: &[([f64; 3], [f64; 3])]) -> Body {
        let mut parts = boxes.iter().map(|(min, max)| cuboid(*min, *max));
        let mut out = Body::conductor(name, parts.next().unwrap());
        out.parts.extend(parts);
        out
    }

    /// Two combs of two fingers each in a layer over a grounded plate, in open space or in an insulating box;
    /// the first has a finger beside the middle.
    fn combs(wall: Wall) -> Scene {
        let left = [
            ([-0.7, 0.1, -0.6], [0.7, 0.2, -0.5]),
            ([-0.6, 0.1, -0.5], [-0.4, 0.2, 0.3]),
            ([0.05, 0.1, -0.5], [0.25, 0.2, 0.3]),
        ];
        let turned = left.map(|(min, max)| ([-max[0], min[1], -max[2]], [-min[0], max[1], -min[2]]));
        let bodies = vec![
            body("left", &left),
            body("right", &turned),
            Body::grounded("plate", cuboid([-0.8, -0.3, -0.7], [0.8, -0.2, 0.7])),
            Body::dielectric("layer", cuboid([-0.9, 0.0, -0.8], [0.9, 0.5, 0.8]), 3.0),
        ];
        let domain = match wall {
            Wall::Open => Box3::SPACE,
            Wall::Grounded | Wall::Insulated => Box3 { min: [-1.0, -0.5, -0.9], max: [1.0, 0.7, 0.9] },
        };
        let walls = [[wall; 2]; 3];
        Scene { bodies, background_permittivity: 1.0, domain, walls }
    }

    fn map() -> Arc<SceneMap> {
        let axis = |breaks: &[f64], degree: usize, mirrored: bool| MapAxis {
            breaks: breaks.to_vec(),
            degrees: vec![degree; breaks.len() - 1],
            mirrored,
        };
        let axes = [
            axis(&[0.0, 0.4, 1.0], 4, true),
            axis(&[-0.5, 0.3, 0.5, 0.7], 4, false),
            axis(&[0.0, 0.9], 2, true),
        ];
        let ends = |y: f64| (y + 0.5) * (0.7 - y);
        let bend = move |[x, y, z]: [f64; 3]| {
            let side = (1.0 - x * x) * (0.81 - z * z);
            [0.1 * x * side * ends(y), 0.3 * side * ends(y) * (x * x - 0.4), 0.0]
        };
        Arc::new(SceneMap::new(axes, bend))
    }

    /// Upper and lower energies of the two conductors at equal or at opposite potentials, on the whole scene
    /// and on the half of it, on the same grid.
    fn energies(scene: &Scene, map: Option<&Arc<SceneMap>>, order: usize, odd: bool) -> [[f64; 2]; 2] {
        const SHARE: f64 = 1e-11;
        let layout = Layout::in_frame(scene, map, None, u64::MAX).unwrap();
        let halves = Halves::of(&layout, layout.turn.as_ref().unwrap().planes, odd);
        let grid = halves.quarter.grid(&graded(ResolutionLevel { order, levels: 0 }), 2.0);
        let (on_whole, held) = layout.domain(&grid.reflected([true, false, true]));
        let (mut on_half, mut held_on_half) = halves.half.domain(&grid.reflected([false, false, true]));
        let (others, more) = halves.other_parts(&grid);
        on_half.turn = Some(Box::new(others));
        held_on_half.extend(more);
        let volts = [1.0, if odd { -1.0 } else { 1.0 }, 0.0];
        [(on_whole, held, 1.0), (on_half, held_on_half, 2.0)].map(|(domain, held, copies)| {
            let potentials = vec![held.iter().map(|c| volts[*c]).collect::<Vec<f64>>()];
            let start = || [Start::Nothing];
            let (above, primal) = upper(&domain, &potentials, &start(), None, SHARE, None).unwrap();
            let below = if map.is_some() {
                let solved = Solved {
                    coefficients: &above.coefficients,
                    less: None,
                    energies: &above.matrix,
                    images: &[None],
                    bent: primal.bent(),
                };
                bent_lower(&domain, &potentials, &solved, SHARE, None).unwrap()
            } else {
                lower(&domain, &potentials, &start(), SHARE, false, None).unwrap().0
            };
            assert!(above.converged && below.converged);
            [copies * above.matrix[(0, 0)], copies * below.matrix[(0, 0)]]
        })
    }

    #[test]
    fn half_of_a_scene_has_half_of_the_energies_of_what_is_even_or_odd_under_the_turn() {
        for (wall, map) in [(Wall::Open, None), (Wall::Insulated, Some(map()))] {
            for odd in [true, false] {
                let [whole, half] = energies(&combs(wall), map.as_ref(), 2, odd);
                println!("{wall:?} {odd}: {whole:?} {half:?}");
                assert!(whole[1] < whole[0] && whole[1] > 0.8 * whole[0]);
                // The error of the linear solver lowers the bound by about the geometric mean of that error
                // and the grid's.
                for (whole, half) in whole.into_iter().zip(half) {
                    assert!((half / whole - 1.0).abs() < 1e-7, "{wall:?} {odd}: {whole} {half}");
                }
            }
        }
    }
}
