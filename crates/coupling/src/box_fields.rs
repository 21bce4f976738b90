//! Field solves by the box solver for bent electrodes: boxes under a map, and boxes inside and around the
//! electrodes.

use elastocap_electrostatics::{Bounded, Settings, Shortfall, Solution, Target, solve, solve_mapped};
use elastocap_geometry::scene::Purpose;

use crate::failure::Stop;
use crate::layer_outlines::with_surface_at;
use crate::mapped::BentScene;
use crate::scene::{DeformedScene, Enclosing, SceneError};

/// Solves a scene of boxes under its map.
pub(crate) fn mapped(bent: &BentScene, settings: &Settings) -> Result<Solution, Stop> {
    Ok(solve_mapped(&bent.scene, &bent.map, settings)?)
}

/// The boxes inside and around the bent electrodes of a scene.
pub(crate) fn enclosing(deformed: &DeformedScene) -> Result<Enclosing, SceneError> {
    match &deformed.bent {
        Some(enclosing) => enclosing.clone(),
        None => Err(SceneError::Missing("bent electrodes")),
    }
}

/// Bounds on the capacitance of two electrodes that are not boxes, from boxes inside them, which have a
/// smaller capacitance, and boxes around them, which have a larger one: see [`crate::deform::ElectrodeBox`].
/// The surface of the layer, which is `bent_between` two heights, m, is treated likewise: where the layer has
/// the larger permittivity, a flat surface at the lower height gives a smaller capacitance and one at the
/// higher height a larger one. The field and the counts are those of the outer boxes.
pub(crate) fn between(
    deformed: &DeformedScene,
    enclosing: Enclosing,
    bent_between: Option<[f64; 2]>,
    settings: &Settings,
) -> Result<Solution, Stop> {
    // The spread from the shape adds to that of the solver.
    let each = Settings { relative_tolerance: 0.5 * settings.relative_tolerance, ..settings.clone() };
    let permittivity = |purpose: Purpose| {
        deformed
            .scene
            .dielectrics()
            .find(|dielectric| dielectric.body.purpose == purpose)
            .map(|dielectric| dielectric.relative_permittivity)
    };
    let flats = match (permittivity(Purpose::Layer), permittivity(Purpose::Cover), bent_between) {
        (Some(layer), Some(cover), Some([low, high])) => {
            if layer >= cover {
                [Some(low), Some(high)]
            } else {
                [Some(high), Some(low)]
            }
        }
        _ => [None; 2],
    };
    let solve_boxes = |regions, flat: Option<f64>, settings: &Settings| {
        let scene = deformed.with_pair(regions);
        solve(&flat.map_or(scene.clone(), |height| with_surface_at(scene, height)), settings)
    };
    let less = solve_boxes(enclosing.inside, flats[0], &Settings { field: false, ..each.clone() })?;
    let mut solution = solve_boxes(enclosing.around, flats[1], &each)?;
    let join = |low: Bounded, high: Bounded| Bounded {
        value: 0.5 * (low.value + high.value),
        lower: low.lower.min(high.lower),
        upper: high.upper.max(low.upper),
    };
    let sum = |one: &Bounded, other: &Bounded| Bounded {
        value: one.value + other.value,
        lower: one.lower + other.lower,
        upper: one.upper + other.upper,
    };
    let joined =
        |low: Option<Bounded>, high: Option<Bounded>| low.zip(high).map(|(low, high)| join(low, high));
    solution.maxwell = polarised(&less.maxwell, &solution.maxwell);
    solution.two_terminal = joined(less.two_terminal, solution.two_terminal);
    solution.measured = match settings.target {
        // At any potentials the energy grows with the conductors, and so does its minimum over floating
        // potentials.
        Target::TwoTerminal | Target::Pair(_) | Target::Own(_) | Target::Matrix => {
            joined(less.measured, solution.measured)
        }
        Target::Mutual([i, j]) => solution.maxwell.get(i).and_then(|row| row.get(j)).map(Bounded::negative),
        Target::Guarded([i, j]) => {
            solution.maxwell.get(i).and_then(|row| Some(sum(row.get(i)?, row.get(j)?)))
        }
    };
    solution.seconds = less.seconds.plus(&solution.seconds);
    let capacitance = solution.measured.or(solution.two_terminal);
    solution.reached = capacitance.is_none_or(|c| c.spread_over_value() <= settings.allowed_spread());
    solution.shortfall = (!solution.reached)
        .then_some(Shortfall::EnclosingBoxes { flat_surfaces: flats.iter().all(Option::is_some) });
    Ok(solution)
}

/// Bounds on the matrix of conductors between smaller and larger ones, whose matrices are `less` and `more`.
/// As quadratic forms the three matrices ascend, and so do their diagonals. With G the difference of the
/// outer two, an off-diagonal entry deviates from the mean of theirs by at most sqrt(G_ii G_jj) / 2.
fn polarised(less: &[Vec<Bounded>], more: &[Vec<Bounded>]) -> Vec<Vec<Bounded>> {
    let gap = |i: usize| {
        let diagonal = less.get(i).and_then(|row| row.get(i)).zip(more.get(i).and_then(|row| row.get(i)));
        diagonal
            .map_or(0.0, |(less, more)| (more.upper.max(less.upper) - less.lower.min(more.lower)).max(0.0))
    };
    let entry = |(i, j): (usize, usize), less: &Bounded, more: &Bounded| {
        if i == j {
            let (lower, upper) = (less.lower.min(more.lower), more.upper.max(less.upper));
            return Bounded { value: 0.5 * (less.value + more.value), lower, upper };
        }
        let half = 0.5 * (gap(i) * gap(j)).sqrt();
        let (lower, upper) = (0.5 * (less.lower + more.lower) - half, 0.5 * (less.upper + more.upper) + half);
        Bounded { value: (0.5 * (less.value + more.value)).min(0.0), lower, upper: upper.min(0.0) }
    };
    let rows = less.iter().zip(more).enumerate();
    rows.map(|(i, (less, more))| {
        less.iter().zip(more).enumerate().map(|(j, (less, more))| entry((i, j), less, more)).collect()
    })
    .collect()
}
