//! The field without the indenter, which all steps of an approach share when they are solved again for their
//! change. The effect of the indenter is solved on a coarse grid under its map, so that the fine grid is
//! solved only once.

use elastocap_electrostatics::{
    Additions, Base, Bounded, Settings, Solution, solve, solve_base, solve_superposed,
};
use elastocap_geometry::scene::{Body, Purpose, Scene};

use crate::mapped::BentScene;
use crate::route_change::NoBase;

/// Relative spread aimed for in the base, over the tolerance of the steps. Tuned: time the runs of the balls
/// in docs/change.md, section "Reach".
const SHARE: f64 = 0.6;

/// A solution of the scene without its indenter.
pub(crate) struct CommonBase {
    scene: Scene,
    base: Base,
    number: usize,
}

/// The purpose of a base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Purposes {
    /// Distinguishes bases of the same run.
    pub(crate) number: usize,
    /// Whether only differences between the steps are to meet the tolerance.
    pub(crate) differences: bool,
}

impl CommonBase {
    /// The base of a scene, and of others with the indenter elsewhere, for the tolerance in `settings`. No
    /// conductor face and no break of their maps is farther than `reach` (m) from the origin. Where only
    /// differences are wanted, `nearer` is the largest distance (m) by which the indenter of another scene is
    /// nearer to the layer. `None` without an indenter, or where no bounds are requested.
    ///
    /// # Errors
    /// The reason that the scene cannot serve as a base.
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

    /// Distinguishes bases of the same run.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// Whether the error of the base cancels in differences of the steps, which alone are wanted.
    pub(crate) fn cancels(&self) -> bool {
        self.base.cancels()
    }

    /// Solves a scene by the effect of its indenter on the base.
    ///
    /// # Errors
    /// The scene belongs to another base, or does not meet its tolerance in this way.
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

/// The earlier results of the steps that share a base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known<'a> {
    /// The capacitances, F.
    pub(crate) capacitances: &'a [Bounded],
    /// The relative tolerance of these capacitances.
    pub(crate) relative_tolerance: f64,
}

impl Known<'_> {
    /// The largest relative difference from the capacitance without the indenter that the bounds allow, at
    /// most 1.
    fn largest_change(&self, without: &Bounded) -> f64 {
        let change = |with: &Bounded| {
            let most = (with.upper - without.lower).abs().max((with.lower - without.upper).abs());
            (most / without.value.abs()).min(1.0)
        };
        self.capacitances.iter().map(change).fold(0.0, f64::max)
    }
}

/// The scene without its indenter and bodies attached to it; `None` if there are none, or if a conductor
/// among them precedes another conductor.
fn without_indenter(scene: &Scene) -> Option<Scene> {
    let presses: Vec<bool> = scene.conductors().map(|conductor| is_indenter(conductor.body)).collect();
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
