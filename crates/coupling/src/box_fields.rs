//! A scene of boxes for the box solver: straight ones, or boxes inside and around electrodes that are bent.

use elastocap_electrostatics::{Bounded, Settings, Shortfall, Solution, Target, solve, solve_mapped};
use elastocap_geometry::scene::Purpose;

use crate::failure::Stop;
use crate::layer_outlines::with_surface_at;
use crate::mapped::BentScene;
use crate::scene::{DeformedScene, Enclosing, SceneError};

/// The boxes of a scene under the map that bends them.
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

/// The capacitance of two electrodes that are not boxes, from boxes inside them (which have less) and boxes around them (which
/// have more): see [`crate::deform::ElectrodeBox`]. So it is with the surface of the layer, which is `bent_between` two heights, m: where the
/// layer has the larger permittivity, a flat one at the lower of them gives less and one at the higher more. The field and the counts are
/// those of the boxes around.
pub(crate) fn between(
    deformed: &DeformedScene,
    enclosing: Enclosing,
    bent_between: Option<[f64; 2]>,
    settings: &Settings,
) -> Result<Solution, Stop> {
    // What the shape leaves open comes on top of what the solver does.
    let each = Settings { relative_tolerance: 0.5 * settings.relative_tolerance, ..settings.clone() };
    let own = |purpose: Purpose| {
        deformed
            .scene
            .dielectrics()
            .find(|own| own.body.purpose == purpose)
            .map(|own| own.relative_permittivity)
    };
    let flats = match (own(Purpose::Layer), own(Purpose::Cover), bent_between) {
        (Some(layer), Some(cover), Some([low, high])) => {
            if layer >= cover {
                [Some(low), Some(high)]
            } else {
                [Some(high), Some(low)]
            }
        }
        _ => [None; 2],
    };
    let of = |regions, flat: Option<f64>, settings: &Settings| {
        let scene = deformed.with_pair(regions);
        solve(&flat.map_or(scene.clone(), |height| with_surface_at(scene, height)), settings)
    };
    let less = of(enclosing.inside, flats[0], &Settings { field: false, ..each.clone() })?;
    let mut solution = of(enclosing.around, flats[1], &each)?;
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
        // The energies of larger conductors are larger at any potentials, and so is their least.
        Target::TwoTerminal | Target::Pair(_) | Target::Own(_) | Target::Matrix => {
            joined(less.measured, solution.measured)
        }
        Target::Mutual([i, j]) => solution.maxwell.get(i).and_then(|row| row.get(j)).map(Bounded::negative),
        Target::Guarded([i, j]) => {
            solution.maxwell.get(i).and_then(|row| Some(sum(row.get(i)?, row.get(j)?)))
        }
    };
    solution.seconds = less.seconds.plus(&solution.seconds);
    let own = solution.measured.or(solution.two_terminal);
    solution.reached = own.is_none_or(|c| c.spread_over_value() <= settings.allowed_spread());
    solution.shortfall = (!solution.reached)
        .then_some(Shortfall::EnclosingBoxes { flat_surfaces: flats.iter().all(Option::is_some) });
    Ok(solution)
}

/// The matrix of conductors between smaller and larger ones, whose matrices these are. As quadratic forms the three ascend, so that the
/// diagonal does too; with G the difference of the outer two, an entry is in the middle of theirs up to sqrt(G_ii G_jj) / 2.
fn polarised(less: &[Vec<Bounded>], more: &[Vec<Bounded>]) -> Vec<Vec<Bounded>> {
    let gap = |i: usize| {
        let own = less.get(i).and_then(|row| row.get(i)).zip(more.get(i).and_then(|row| row.get(i)));
        own.map_or(0.0, |(less, more)| (more.upper.max(less.upper) - less.lower.min(more.lower)).max(0.0))
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
