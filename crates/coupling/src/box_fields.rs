//! A scene of boxes for the box solver: straight ones, or boxes inside and around electrodes that are bent.

use elastocap_electrostatics::{Bounded, Settings, Solution, SolveError, solve, solve_mapped};
use elastocap_geometry::scene::Scene;

use crate::bent_in_space::BentScene;
use crate::failure::Stop;
use crate::scene::{DeformedScene, Enclosing, SceneError};
use crate::terminals::pair_among;

/// What is said of a pair among other conductors.
pub(crate) const MATRIX_ONLY: &str =
    "the pair's capacitance is known less well than the Maxwell matrix it comes from";

/// The solution, and the two-terminal capacitance.
pub fn field_of(deformed: &DeformedScene, asked_for: &Settings) -> Result<(Solution, Option<Bounded>), Stop> {
    field_under(deformed, asked_for, solve)
}

/// The same for the boxes of a scene under the map that bends them.
pub(crate) fn mapped(
    deformed: &DeformedScene,
    bent: &BentScene,
    asked_for: &Settings,
) -> Result<(Solution, Option<Bounded>), Stop> {
    field_under(deformed, asked_for, |_, settings| solve_mapped(&bent.scene, &bent.map, settings))
}

fn field_under(
    deformed: &DeformedScene,
    asked_for: &Settings,
    solve: impl Fn(&Scene, &Settings) -> Result<Solution, SolveError>,
) -> Result<(Solution, Option<Bounded>), Stop> {
    let mut settings = asked_for.clone();
    let mut tries = 3;
    loop {
        let mut solution = solve(&deformed.scene, &settings)?;
        let Some(pair) = deformed.pair_among_others() else {
            let two_terminal = solution.two_terminal;
            return Ok((solution, two_terminal));
        };
        // The solver's tolerance is that of the matrix; what is asked for is that of the pair.
        let pair = pair_among(&solution.maxwell, pair);
        let error = pair.map_or(0.0, |pair| pair.spread_over_value());
        let allowed = asked_for.allowed_spread();
        tries -= 1;
        if error <= allowed || tries == 0 || !solution.reached {
            if error <= allowed {
                (solution.reached, solution.shortfall) = (true, None);
            } else {
                solution.reached = false;
                solution.shortfall.get_or_insert_with(|| MATRIX_ONLY.to_owned());
            }
            return Ok((solution, pair));
        }
        settings.relative_tolerance *= 0.7 * allowed / error;
    }
}

/// The boxes inside and around the bent electrodes of a scene.
pub(crate) fn enclosing(deformed: &DeformedScene) -> Result<Enclosing, SceneError> {
    match &deformed.bent {
        Some(enclosing) => enclosing.clone(),
        None => Err(SceneError::Missing("bent electrodes")),
    }
}

/// The capacitance of two electrodes that are not boxes, from boxes inside them (which have less) and boxes around them (which
/// have more): see [`crate::deform::ElectrodeBox`]. The field and the counts are those of the boxes around.
pub(crate) fn between(
    deformed: &DeformedScene,
    enclosing: Enclosing,
    settings: &Settings,
) -> Result<(Solution, Option<Bounded>), Stop> {
    // What the shape leaves open comes on top of what the solver does.
    let each = Settings { relative_tolerance: 0.5 * settings.relative_tolerance, ..settings.clone() };
    let of = |regions, settings: &Settings| {
        let scene = deformed.with_pair(regions);
        field_of(&DeformedScene { scene, bent: None, ..deformed.clone() }, settings)
    };
    let (less, low) = of(enclosing.inside, &Settings { field: false, ..each.clone() })?;
    let (mut solution, high) = of(enclosing.around, &each)?;
    let join = |low: &Bounded, high: &Bounded| Bounded {
        value: 0.5 * (low.value + high.value),
        lower: low.lower.min(high.lower),
        upper: high.upper.max(low.upper),
    };
    let two_terminal = low.zip(high).map(|(low, high)| join(&low, &high));
    for (row, other) in solution.maxwell.iter_mut().zip(&less.maxwell) {
        for (entry, other) in row.iter_mut().zip(other) {
            *entry = join(other, entry);
        }
    }
    solution.seconds = less.seconds.plus(&solution.seconds);
    solution.reached = two_terminal.is_none_or(|c| c.spread_over_value() <= settings.allowed_spread());
    solution.shortfall = (!solution.reached).then(|| {
        "the electrodes are bent and tilted, and the solver takes boxes: the bounds are those of boxes inside and around them"
            .to_owned()
    });
    Ok((solution, two_terminal))
}
