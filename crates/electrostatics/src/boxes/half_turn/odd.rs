//! The state of two conductors at opposite potentials where a half turn about the second axis puts each in the place of the other.
//!
//! Its potential is odd under the turn, u(-x1, x2, -x3) = -u(x1, x2, x3), and so is known from the half of the scene above x1 = 0. There
//! it is a potential like any other, but for the plane x1 = 0, on which it is odd across x3 = 0; the flux through that plane is even.
//!
//! - Potentials are functions on this half whose trace is odd. The projection on these ([`Fold::make_middle_odd`](super::fold::Fold))
//!   is all that sets the primal problem apart.
//! - The flux on lines of the first axis that cross the plane is that of the whole line. So these lines are taken on the half above
//!   x3 = 0, to which the unknowns are carried and back ([`Exchange`](super::exchange::Exchange)): a line and its turned image are one.
//! - Where the scene is its own mirror image across both planes, the state falls into two parts on a quarter of it: one that is even across
//!   x1 = 0 and odd across x3 = 0, and one the other way round. Permittivity and map are their own images, so that the problem without
//!   conductors falls apart in this way, and with it the repair of a divergence, and the boxes of the preconditioner that meet no
//!   conductor on either side ([`Fold`](super::fold::Fold)).

use crate::SolveError;
use crate::boxes::conductor_free::{FreeBox, free_boxes};
use crate::boxes::domain::{Block, Domain};
use crate::boxes::layout::{Grid, Layout};
use crate::floating::Floating;
use crate::target::Target;
use elastocap_geometry::scene::{Scene, Wall};

/// The layouts that the state is solved on.
#[derive(Debug, Clone)]
pub(crate) struct OddState {
    /// The half above the middle of the first axis.
    pub(crate) half: Layout,
    /// The half above the middle of the last axis.
    other_half: Layout,
    /// The quarter above both, with the conductors on both sides of the middle of the last axis, which grids are made for.
    pub(crate) quarter: Layout,
    /// Potentials of the scene's conductors, one volt apart.
    pub(crate) potentials: Vec<f64>,
    /// Energy of the whole scene over that of the half.
    pub(crate) copies: f64,
}

/// The parts of a scene, besides the half above the middle of the first axis, that a state is seen on which is odd under a half turn.
#[derive(Debug, Clone)]
pub(crate) struct OtherParts {
    /// The half above the middle of the last axis.
    pub(crate) half: Domain,
    /// The quarter above both, with what is a conductor on either side of the middle of the last axis: for what is odd across that, and
    /// for what is even.
    pub(crate) quarters: [Domain; 2],
}

impl OddState {
    /// Axes whose middle the turn is across.
    const ACROSS: [usize; 2] = [0, 2];

    /// The state of a target with two opposite conductors; `None` where no half turn about the second axis puts each in the place of the
    /// other, or where a mirror makes less of the scene than half.
    ///
    /// # Errors
    /// Those of a layout.
    pub(crate) fn of(
        layout: &Layout,
        scene: &Scene,
        floating: &Floating,
        target: Target,
    ) -> Result<Option<Self>, SolveError> {
        let Some(pair) = target.opposite(floating.driven.len()) else { return Ok(None) };
        let [Some(&one), Some(&other)] = pair.map(|k| floating.driven.get(k)) else { return Ok(None) };
        let mirrored = |a: usize| layout.map.as_ref().is_none_or(|map| map.is_mirrored(a));
        let suited = Self::ACROSS
            .iter()
            .all(|&a| layout.mirror[a].is_none() && layout.is_even(a) && mirrored(a));
        if !suited || !floating.floating.is_empty() {
            return Ok(None);
        }
        let (whole, [first, last]) = layout.centred(scene, Self::ACROSS)?;
        let turned = |c: usize| whole.flipped(&whole.flipped(&whole.conductors[c], 0), 2);
        let others = || (0..whole.conductors.len()).filter(|c| *c != one && *c != other);
        let keeps_others = others().all(|c| {
            let image = turned(c);
            others().any(|other| whole.conductors[other] == image)
        });
        let is_even = |c: usize| whole.mirror[1].is_none() || whole.image(c, 1) == c;
        if turned(one) != whole.conductors[other] || !keeps_others || ![one, other].into_iter().all(is_even) {
            return Ok(None);
        }
        let copies = if whole.mirror[1].is_some() { 4.0 } else { 2.0 };
        let whole = whole.half(1, false);
        // What ends at a plane is on it: the turned rest begins there, but elsewhere.
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
        let mut potentials = vec![0.0; whole.conductors.len()];
        (potentials[one], potentials[other]) = (0.5, -0.5);
        Ok(Some(Self { half, other_half, quarter, potentials, copies }))
    }

    /// The other parts on a grid of the quarter, and for each block of the other half its conductor.
    pub(crate) fn other_parts(&self, grid: &Grid) -> (OtherParts, Vec<usize>) {
        let (half, held) = self.other_half.domain(&grid.reflected([true, false, false]));
        let quarters = [2, 0].map(|odd| {
            let mut layout = self.quarter.clone();
            layout.walls[odd][0] = Wall::Grounded;
            layout.domain(grid).0
        });
        (OtherParts { half, quarters }, held)
    }
}

impl OtherParts {
    /// See [`Domain::truncated`].
    pub(crate) fn truncated(&self) -> Self {
        Self { half: self.half.truncated(), quarters: self.quarters.each_ref().map(Domain::truncated) }
    }
}

/// Of boxes of a domain without conductors those that the preconditioner needs besides the boxes of the quarters; all of them where the
/// domain is not the half of a scene.
///
/// The functions of a box that ends in the middle of the first axis vanish there, as those of each box do at its ends: what does not vanish
/// is in the boxes of the quarters, since the scene is free on both sides of what is free in that plane.
pub(crate) fn not_in_quarters(domain: &Domain, mut boxes: Vec<FreeBox>) -> Vec<FreeBox> {
    let Some(turn) = &domain.turn else { return boxes };
    let [quarter, _] = &turn.quarters;
    let both = free_boxes(quarter);
    let middle = quarter.cells()[2];
    boxes.retain(|own| !both.iter().any(|both| is_in(own, both, middle)));
    boxes.iter_mut().filter(|own| own.block.lo[0] == 0).for_each(|own| own.held[0][0] = true);
    boxes
}

/// Whether a box of a half lies in one of a quarter, or in its mirror image across the middle of the last axis.
fn is_in(own: &FreeBox, both: &FreeBox, middle: usize) -> bool {
    let (p, q) = (&own.block, &both.block);
    let within = |lo: usize, hi: usize, a: usize| q.lo[a] <= lo && hi <= q.hi[a];
    // Where both reach an end on which a sheet lies, the functions of both have to vanish on it.
    let (held, is_held) = (&both.held, &own.held);
    let ends = (held[0][0] && p.lo[0] == 0 && q.lo[0] == 0 && !is_held[0][0])
        || (held[0][1] && p.hi[0] == q.hi[0] && !is_held[0][1])
        || (0..2).any(|side| {
            let shared = if side == 0 { p.lo[1] == q.lo[1] } else { p.hi[1] == q.hi[1] };
            shared && held[1][side] && !is_held[1][side]
        });
    if ends || !(0..2).all(|a| within(p.lo[a], p.hi[a], a)) {
        return false;
    }
    let (lo, hi) = (p.lo[2], p.hi[2]);
    // Above the middle, below it, or across.
    let (from, to) = match (lo.checked_sub(middle), hi.checked_sub(middle)) {
        (Some(from), Some(to)) => (from, to),
        (None, Some(to)) if to > 0 => (0, to.max(middle - lo)),
        _ => (middle - hi, middle - lo),
    };
    let at_end = to == q.hi[2] && held[2][1] && !(is_held[2][0] || is_held[2][1]);
    within(from, to, 2) && !(from == 0 && held[2][0]) && !at_end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::dual::mapped::{Solved, lower as bent_lower};
    use crate::boxes::energy::{Start, lower, upper};
    use crate::boxes::grid_problem::GridProblem;
    use crate::boxes::mapped::map::{MapAxis, SceneMap};
    use crate::boxes::resolution::graded;
    use crate::solution::{ResolutionLevel, Settings};
    use elastocap_geometry::scene::{Body, Box3};
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

    /// Two combs of two fingers each in a layer over a grounded plate, in open space or in a box with insulating sides; the first has a
    /// finger beside the middle.
    fn combs(wall: Wall) -> Scene {
        let left = [([-0.7, 0.1, -0.6], [0.7, 0.2, -0.5]), ([-0.6, 0.1, -0.5], [-0.4, 0.2, 0.3]), ([0.05, 0.1, -0.5], [0.25, 0.2, 0.3])];
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
        let mut walls = [[wall; 2]; 3];
        if wall != Wall::Open {
            walls[1][0] = Wall::Grounded;
        }
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

    /// Upper and lower energies of the state on the whole scene and on the half of it, on the same grid.
    fn energies(scene: &Scene, map: Option<&Arc<SceneMap>>, order: usize) -> [[f64; 2]; 2] {
        const SHARE: f64 = 1e-11;
        let settings = Settings { target: Target::TwoTerminal, target_alone: true, ..Settings::default() };
        let problem = GridProblem::new(scene, map, None, &settings).unwrap();
        let state = OddState::of(&problem.layout, scene, &problem.floating, settings.target).unwrap().unwrap();
        let grid = problem.core.grid(&graded(ResolutionLevel { order, levels: 1 }), 2.0);
        let (whole, _) = problem.layout.centred(scene, OddState::ACROSS).unwrap();
        let (on_whole, held) = whole.domain(&grid.reflected([true, false, true]));
        let (mut on_half, mut held_on_half) = state.half.domain(&grid.reflected([false, false, true]));
        let (others, more) = state.other_parts(&grid);
        on_half.turn = Some(Box::new(others));
        held_on_half.extend(more);
        [(on_whole, held, 1.0), (on_half, held_on_half, state.copies)].map(|(domain, held, copies)| {
            let potentials = vec![held.iter().map(|c| state.potentials[*c]).collect::<Vec<f64>>()];
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
            println!("{} {} {:?} {:?}", above.iterations, below.iterations, above.converged, below.converged);
            [copies * above.matrix[(0, 0)], copies * below.matrix[(0, 0)]]
        })
    }

    #[test]
    fn half_of_a_scene_has_half_of_the_energies_of_its_odd_state() {
        for (wall, map) in [(Wall::Insulated, None), (Wall::Open, None), (Wall::Insulated, Some(map()))] {
            let [whole, half] = energies(&combs(wall), map.as_ref(), 3);
            println!("{wall:?}: {whole:?} {half:?}");
            assert!(whole[1] < whole[0] && whole[1] > 0.8 * whole[0]);
            for (whole, half) in whole.into_iter().zip(half) {
                assert!((half / whole - 1.0).abs() < 1e-8, "{wall:?}: {whole} {half}");
            }
        }
    }
}
