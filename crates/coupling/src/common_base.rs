//! The field without the indenter, which the steps of an approach have in common when they are solved again for their change. What the
//! indenter changes in it takes a coarse grid under its map, so that the fine one is solved once.

use elastocap_electrostatics::{
    Additions, Base, Bounded, Settings, Solution, solve, solve_base, solve_superposed,
};
use elastocap_geometry::scene::{Body, Purpose, Scene};

use crate::mapped::BentScene;
use crate::route_change::NoBase;

/// Relative spread to aim for of the base, over the tolerance of what is added to it.
const SHARE: f64 = 0.6;

/// A solution of the scene without its indenter.
pub(crate) struct CommonBase {
    scene: Scene,
    base: Base,
    number: usize,
}

/// The purpose that a base is to serve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Purposes {
    /// Tells it from other bases of the same run.
    pub(crate) number: usize,
    /// Whether nothing but differences between the steps is to be known to the tolerance.
    pub(crate) differences: bool,
}

impl CommonBase {
    /// The base of a scene and of others with the indenter elsewhere, for the tolerance in the settings. No face of any of them, and
    /// nothing that is bent, is farther than `reach` (m) from the origin, and the indenter of none is nearer by more than `nearer` (m), where
    /// their differences alone are wanted. `None` where nothing presses in them, or bounds are not asked for.
    ///
    /// # Errors
    /// Why the scene cannot serve as a base.
    pub(crate) fn of(
        bent: &BentScene,
        (reach, nearer): (f64, Option<f64>),
        known: Known<'_>,
        number: usize,
        settings: &Settings,
    ) -> Result<Option<Self>, NoBase> {
        let Some(scene) = without_indenter(&bent.scene).filter(|_| settings.bounds) else { return Ok(None) };
        let roughly =
            Settings { relative_tolerance: known.relative_tolerance, field: false, ..settings.clone() };
        let without = solve(&scene, &roughly)?.measured.ok_or(NoBase::NotMeasured)?;
        let change = known.largest_change(&without);
        let additions = Additions { reach, change, share: SHARE, nearer };
        let base = solve_base(&scene, (&bent.scene, &bent.map), additions, settings)?;
        base.map(|base| Some(Self { scene, base, number })).ok_or(NoBase::Tolerance)
    }

    /// Tells it from other bases of the same run.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// Whether its error cancels in differences of what is added to it, and in these alone is what was asked for.
    pub(crate) fn cancels(&self) -> bool {
        self.base.cancels()
    }

    /// The field of a scene by what its indenter changes.
    ///
    /// # Errors
    /// A scene whose base is another one, or whose tolerance is not met in this way.
    pub(crate) fn add(&self, bent: &BentScene, settings: &Settings) -> Result<Solution, NoBase> {
        if without_indenter(&bent.scene).as_ref() != Some(&self.scene) {
            return Err(NoBase::OtherScene);
        }
        let is_stopped =
            settings.cancel.as_ref().is_some_and(|c| c.load(std::sync::atomic::Ordering::Relaxed));
        let found = solve_superposed(&bent.scene, &bent.map, &self.base, settings)?;
        if found.reached || is_stopped {
            return Ok(found);
        }
        Err(found.shortfall.map_or(NoBase::Tolerance, NoBase::Shortfall))
    }
}

/// The capacitances of the steps that are to have a base in common, as known so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<'a> {
    /// Their capacitances, F.
    pub(crate) capacitances: &'a [Bounded],
    /// The relative tolerance to which these were solved.
    pub(crate) relative_tolerance: f64,
}

impl Known<'_> {
    /// The largest difference from the capacitance without the indenter that the bounds allow, over that; at most one.
    fn largest_change(&self, without: &Bounded) -> f64 {
        let of = |own: &Bounded| {
            let most = (own.upper - without.lower).abs().max((own.lower - without.upper).abs());
            (most / without.value.abs()).min(1.0)
        };
        self.capacitances.iter().map(of).fold(0.0, f64::max)
    }
}

/// The scene without what presses; `None` where there is nothing, or conductors that are not behind all others.
fn without_indenter(scene: &Scene) -> Option<Scene> {
    let presses: Vec<bool> = scene.conductors().map(|own| is_indenter(own.body)).collect();
    let others = presses.iter().take_while(|presses| !**presses).count();
    if others == 0 || presses[others..].iter().any(|presses| !presses) {
        return None;
    }
    let mut out = scene.clone();
    out.bodies.retain(|body| !is_indenter(body));
    (out.bodies.len() < scene.bodies.len()).then_some(out)
}

fn is_indenter(body: &Body) -> bool {
    match body.purpose {
        Purpose::Indenter | Purpose::OnIndenter => true,
        Purpose::Electrode
        | Purpose::InLayer
        | Purpose::Layer
        | Purpose::Substrate
        | Purpose::Cover
        | Purpose::OnTop
        | Purpose::Fixed => false,
    }
}
